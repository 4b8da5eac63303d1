// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/cap.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "scenes/hair.h"

namespace fcl_fibers::scenes {
namespace {

constexpr double kSegmentLength = 0.3;  // cm
constexpr double kTurn = 0.35;          // of the direction, per cm
constexpr double kSideways = 0.3;       // pull along the root's horizontal direction
constexpr double kSidewaysDeviation = 0.02;
constexpr double kSidewaysPerFrame = 0.01;
constexpr double kWave = 0.05;
constexpr double kWavePerSegment = 0.6;  // rad
constexpr double kWavePerRoot = 8;       // rad per unit of the root's normal
constexpr double kDeviation = 0.01;
constexpr double kCombedTurn = 0.05;          // rad per segment
constexpr double kCombedTurnPerFrame = 0.01;  // rad

/// The root of a fiber: the head's normal there, and the direction away from the z axis.
struct Root {
  Vector normal, away;
};

/// Calls add(root, random) for each fiber, which adds the fiber's points.
template <class Add>
FiberPolylines fibersOnHead(const char* call, const CapParameters& parameters, Add&& add) {
  const double cap_height = parameters.fibers / (kRootsPerArea * 2 * kPi * kHeadRadius);
  constexpr int kMostFibers = 330809;
  if (parameters.fibers < 1 || parameters.fibers > kMostFibers) {
    refuseArgument(call, "fibers", parameters.fibers,
                   "ask for at least 1 fiber and for no more than the head has room for, 330809");
  }
  FiberPolylines scene = emptyScene(call, parameters);
  for (std::size_t f = 0; f < static_cast<std::size_t>(parameters.fibers); ++f) {
    Random random = fiberRandom(parameters.seed, f);
    const double z = 1 - cap_height / kHeadRadius * random.uniform();
    const double direction = 2 * kPi * random.uniform();
    const double across = std::sqrt((1 - z) * (1 + z));
    const double x = std::cos(direction), y = std::sin(direction);
    add(Root{{across * x, across * y, z}, {z * x, z * y, -across}}, random, scene);
    scene.point_begin.push_back(scene.points.size());
  }
  return scene;
}

void addPoint(const Vector& point, FiberPolylines& scene) {
  scene.points.push_back({point.x(), point.y(), point.z()});
}

}  // namespace

FiberPolylines makeCap(const CapParameters& parameters) {
  return fibersOnHead(
      "makeCap", parameters, [&](const Root& root, Random& random, FiberPolylines& scene) {
        const Vector& normal = root.normal;
        Vector pull = kSideways * Vector(normal.x(), normal.y(), 0);
        pull.x() += kSidewaysDeviation * random.normal() + kSidewaysPerFrame * parameters.frame;
        pull.y() += kSidewaysDeviation * random.normal();
        pull.z() = -1;

        Vector point = kHeadRadius * normal;
        Vector tangent = normal;
        addPoint(point, scene);
        for (int i = 0; i < parameters.segments; ++i) {
          const double angle = kWavePerSegment * i;
          tangent += kTurn * kSegmentLength * pull;
          tangent.x() += kWave * std::sin(angle + kWavePerRoot * normal.x());
          tangent.y() += kWave * std::cos(angle + kWavePerRoot * normal.y());
          for (int k = 0; k < 3; ++k) tangent[k] += kDeviation * random.normal();
          tangent.normalize();
          point += kSegmentLength * tangent;
          const double distance = point.norm();
          if (distance < kHeadRadius) point *= kHeadRadius / distance;
          addPoint(point, scene);
        }
      });
}

FiberPolylines makeCombed(const CapParameters& parameters) {
  return fibersOnHead(
      "makeCombed", parameters, [&](const Root& root, Random& random, FiberPolylines& scene) {
        Vector normal = root.normal, ahead = root.away;
        const auto turn = [&](double angle) {
          ahead = std::cos(angle) * ahead + std::sin(angle) * normal.cross(ahead);
        };
        const double step = kSegmentLength / kHeadRadius;
        turn(kCombedTurnPerFrame * parameters.frame);
        addPoint(kHeadRadius * normal, scene);
        for (int i = 0; i < parameters.segments; ++i) {
          turn(kCombedTurn * random.normal());
          const Vector before = normal;
          normal = std::cos(step) * normal + std::sin(step) * ahead;
          ahead = std::cos(step) * ahead - std::sin(step) * before;
          const double height = parameters.radius * std::max(0.0, 1 + 0.5 * random.normal());
          addPoint((kHeadRadius + height) * normal.normalized(), scene);
        }
      });
}

}  // namespace fcl_fibers::scenes
