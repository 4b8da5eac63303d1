// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/neuron.h"

#include <cmath>
#include <cstddef>

#include "scenes/hair.h"

namespace fcl_fibers::scenes {
namespace {

constexpr double kStep = 4.5;  // micrometres
constexpr double kWander = 0.12, kOutward = 0.03, kSpread = 1.1;
constexpr double kThinner = 0.9, kThinnerAtTip = 0.5;
constexpr int kMostBranchings = 6;
constexpr double kThinnest = 0.05;      // radii
constexpr double kTurnPerFrame = 1e-4;  // rad per micrometre

class Neuron {
 public:
  Neuron(const NeuronParameters& parameters, FiberPolylines& scene)
      : parameters_(parameters), scene_(scene), random_(parameters.seed) {}

  // The order of the draws is part of the scene.
  void grow() {
    const double r = parameters_.radius;
    add({0, 0, -4 * r}, 2 * r);
    add({0, 0, 0}, 5 * r);
    add({0, 0, 7 * r}, 2 * r);
    endFiber(-1);
    branch(0, -Vector::UnitZ(), 0.35 * r, 0, 3);
    branch(2, Vector::UnitZ(), 2 * r, 0, 3);
    for (int f = 0; f < parameters_.fibers; ++f) {
      const double angle = 2 * kPi * (f + 0.5 * random_.uniform()) / parameters_.fibers;
      const double height = -0.7 + random_.uniform();
      branch(1, Vector(std::cos(angle), std::sin(angle), height).normalized(), r, 0, 1);
    }
  }

 private:
  void add(const Vector& p, double radius) {
    scene_.points.push_back({p.x(), p.y(), p.z()});
    scene_.radii.push_back(radius);
  }
  void endFiber(std::int32_t starts_at) {
    scene_.point_begin.push_back(scene_.points.size());
    scene_.starts_at.push_back(starts_at);
  }

  // A fiber from a point on, and those that begin at its end.
  void branch(std::size_t from, Vector way, double radius, int branchings, int length) {
    const Point& start = scene_.points[from];
    Vector p(start[0], start[1], start[2]);
    const bool is_tip = branchings == kMostBranchings || radius < kThinnest * parameters_.radius;
    const double tip = (is_tip ? kThinnerAtTip : kThinner) * radius;
    const int segments = length * parameters_.segments;
    add(p, radius);
    for (int i = 1; i <= segments; ++i) {
      // The first segment of a dendrite leaves the soma.
      const bool is_in_soma = i == 1 && from < 3;
      p += (kStep + (is_in_soma ? scene_.radii[from] + radius : 0)) * way;
      add(p, radius + (tip - radius) * i / segments);
      const Vector wander(random_.normal(), random_.normal(), random_.normal());
      way = (way + kWander * wander + kOutward * p.normalized()).normalized();
    }
    endFiber(static_cast<std::int32_t>(from));
    if (is_tip) return;
    const std::size_t end = scene_.points.size() - 1;
    const double share = 0.35 + 0.3 * random_.uniform(), angle = 2 * kPi * random_.uniform();
    const Vector side = way.unitOrthogonal(), other = way.cross(side);
    const Vector across = std::cos(angle) * side + std::sin(angle) * other;
    for (const double part : {share, share - 1}) {
      const double turn = (part > 0 ? 1 - share : -share) * kSpread;
      branch(end, std::cos(turn) * way + std::sin(turn) * across,
             tip * std::pow(std::abs(part), 2.0 / 3), branchings + 1, 1);
    }
  }

  const NeuronParameters& parameters_;
  FiberPolylines& scene_;
  Random random_;
};

}  // namespace

FiberPolylines makeNeuron(const NeuronParameters& parameters) {
  FiberPolylines scene = emptyScene("makeNeuron", parameters);
  scene.radii_are = FiberArrays<double>::Radii::kPerPoint;
  Neuron(parameters, scene).grow();
  for (Point& p : scene.points) {
    const double angle = kTurnPerFrame * parameters.frame * std::hypot(p[0], p[1], p[2]);
    const double c = std::cos(angle), s = std::sin(angle);
    p = {c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]};
  }
  return scene;
}

}  // namespace fcl_fibers::scenes
