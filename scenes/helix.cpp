// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/helix.h"

#include <cmath>
#include <cstddef>

#include "scenes/hair.h"

namespace fcl_fibers::scenes {
namespace {

constexpr double kFiberLength = 30;      // cm
constexpr double kDeviation = 0.02;      // of turns, helix radius and phase
constexpr double kSteepestSlope = 0.95;  // of R w; at 1 the helix would not rise
constexpr double kTurnPerFrame = 0.01;   // rad

struct Helix {
  Vector root;          // cm
  double radius;        // cm
  double angular_rate;  // rad per cm of arc
  double phase;         // rad

  Point at(double s) const {
    const double slope = radius * angular_rate;
    const double angle = angular_rate * s + phase;
    return {root.x() + radius * (std::cos(angle) - std::cos(phase)),
            root.y() + radius * (std::sin(angle) - std::sin(phase)),
            std::sqrt(1 - slope * slope) * s};
  }
};

// The order of the draws is part of the scene.
Helix drawHelix(Random& random, double ellipse_area) {
  Helix helix;
  helix.root = drawRoot(random, ellipse_area);
  const double turns = 4 * (1 + kDeviation * random.normal());
  helix.angular_rate = 2 * kPi * turns / kFiberLength;
  helix.radius = 1 + kDeviation * random.normal();
  helix.phase = kDeviation * random.normal();
  if (helix.radius * helix.angular_rate > kSteepestSlope) {
    helix.radius = kSteepestSlope / helix.angular_rate;
  }
  return helix;
}

// Turn about y, then about x.
class Turn {
 public:
  Turn(double about_y, double about_x)
      : cos_y_(std::cos(about_y)),
        sin_y_(std::sin(about_y)),
        cos_x_(std::cos(about_x)),
        sin_x_(std::sin(about_x)) {}

  Point operator()(const Point& p) const {
    const double x = cos_y_ * p[0] + sin_y_ * p[2];
    const double z = cos_y_ * p[2] - sin_y_ * p[0];
    return {x, cos_x_ * p[1] - sin_x_ * z, sin_x_ * p[1] + cos_x_ * z};
  }

 private:
  double cos_y_, sin_y_, cos_x_, sin_x_;
};

}  // namespace

FiberPolylines makeHelix(const HelixParameters& parameters) {
  FiberPolylines scene = emptyScene("makeHelix", parameters);
  const double motion = kTurnPerFrame * parameters.frame;
  const Turn turn(kPi / 4, kPi / 4 + motion);
  Random random(parameters.seed);
  for (int f = 0; f < parameters.fibers; ++f) {
    Helix helix = drawHelix(random, parameters.fibers / kRootsPerArea);
    helix.phase += motion;
    for (int i = 0; i <= parameters.segments; ++i) {
      scene.points.push_back(turn(helix.at(kFiberLength * i / parameters.segments)));
    }
    scene.point_begin.push_back(scene.points.size());
  }
  return scene;
}

}  // namespace fcl_fibers::scenes
