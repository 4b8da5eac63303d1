// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include <fcl_fibers/fiber_polylines.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "arguments.h"
#include "scenes/cosserat_rod.h"
#include "scenes/random.h"

namespace fcl_fibers::scenes {

/// @file
/// What scenes of hair have in common. Lengths are in cm, forces in dyn.

using Quaternion = Eigen::Quaterniond;
using Vector = Eigen::Vector3d;

constexpr double kPi = 3.141592653589793;
constexpr double kRootsPerArea = 325;  ///< 1 / cm2, of a human scalp

/// Throws std::invalid_argument as the scenes do.
template <typename Parameters>
void requireCounts(const char* call, const Parameters& parameters) {
  if (parameters.fibers < 1) {
    refuseArgument(call, "fibers", parameters.fibers, "ask for at least 1 fiber");
  }
  if (parameters.segments < 1) {
    refuseArgument(call, "segments", parameters.segments, "ask for at least 1 segment per fiber");
  }
}

/// A scene without fibers and with room for all. Throws std::invalid_argument as the scenes do.
template <typename Parameters>
FiberPolylines emptyScene(const char* call, const Parameters& parameters) {
  requireCounts(call, parameters);
  const auto fibers = static_cast<std::size_t>(parameters.fibers);
  FiberPolylines scene;
  scene.radius = requireRadius<double>(call, parameters.radius);
  scene.points.reserve(fibers * (static_cast<std::size_t>(parameters.segments) + 1));
  scene.point_begin.reserve(fibers + 1);
  return scene;
}

/// A hair without load. Its own weight stretches it by a part in a million, which is left out.
CosseratRod hair(double length);

/// By pi/4 about y, then by pi/4 about x: the paper's turn of a whole assembly.
Quaternion turnedAboutTwoAxes();

/// Uniform over an ellipse in the plane z = 0, its axes in ratio 1.5 : 1, the longer along x.
Vector drawRoot(Random& random, double area);

/// How a fiber of so many segments is solved: at `least` points of equal distance or more. The
/// fiber's points are some of these, or these are some of the fiber's.
class RodGrid {
 public:
  RodGrid(int segments, int least);

  int solved() const { return solved_; }
  void append(const RodShape& shape, FiberPolylines& scene) const;

 private:
  int solved_;
  int pieces_ = 1;  ///< of each solved segment
  int stride_ = 1;  ///< of the fiber's points among the refined ones
};

}  // namespace fcl_fibers::scenes
