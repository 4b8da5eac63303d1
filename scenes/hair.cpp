// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/hair.h"

#include <cmath>
#include <vector>

namespace fcl_fibers::scenes {
namespace {

constexpr double kEllipseAxesRatio = 1.5;  // longer to shorter
constexpr double kBending = 4.7;           // dyn cm2
constexpr double kTwisting = 3.5;          // dyn cm2

}  // namespace

CosseratRod hair(double length) {
  CosseratRod rod;
  rod.length = length;
  rod.bending_stiffness = {kBending, kBending, kTwisting};
  return rod;
}

Quaternion turnedAboutTwoAxes() {
  return Quaternion(Eigen::AngleAxisd(kPi / 4, Vector::UnitX()) *
                    Eigen::AngleAxisd(kPi / 4, Vector::UnitY()));
}

Vector drawRoot(Random& random, double area) {
  const double minor_axis = std::sqrt(area / (kPi * kEllipseAxesRatio));
  const double distance = minor_axis * std::sqrt(random.uniform());
  const double direction = 2 * kPi * random.uniform();
  return {kEllipseAxesRatio * distance * std::cos(direction), distance * std::sin(direction), 0};
}

RodGrid::RodGrid(int segments, int least) {
  if (segments < least) {
    stride_ = (least + segments - 1) / segments;
    solved_ = segments * stride_;
    return;
  }
  for (solved_ = least; segments % solved_ != 0;) ++solved_;
  pieces_ = segments / solved_;
}

void RodGrid::append(const RodShape& shape, FiberPolylines& scene) const {
  const std::vector<Vector> points = refinedPoints(shape, pieces_);
  for (std::size_t i = 0; i < points.size(); i += static_cast<std::size_t>(stride_)) {
    scene.points.push_back({points[i].x(), points[i].y(), points[i].z()});
  }
  scene.point_begin.push_back(scene.points.size());
}

}  // namespace fcl_fibers::scenes
