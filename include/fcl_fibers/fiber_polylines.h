// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

namespace fcl_fibers {

using Point = std::array<double, 3>;  ///< x, y, z

/// A fiber assembly as polylines in the world frame. Fiber f owns the points [point_begin[f],
/// point_begin[f + 1]), ordered root to tip, and one segment fewer than points.
struct FiberPolylines {
  std::vector<Point> points;  ///< fiber after fiber, in the scene's unit of length; finite

  /// Ascends strictly from 0 to points.size(): every fiber has at least one point.
  std::vector<std::size_t> point_begin = {0};

  /// Radius of every segment, unless `radii` has them. Finite, not negative.
  double radius = 0;

  /// By point: the radius of the segment that starts there. The number at a fiber's last point is
  /// not used. Finite, not negative. If this is empty, `radius` is that of all.
  std::vector<double> radii;

  /// By fiber: 1 if it is a closed curve, else 0. The last point of a closed curve repeats its
  /// first, so its last segment is a neighbour of its first. If this is empty, no fiber is closed.
  std::vector<std::uint8_t> closed;

  /// Number of fibers, including those with a single point.
  std::size_t fiberCount() const { return point_begin.size() - 1; }

  /// Number of segments of all fibers.
  std::size_t segmentCount() const { return points.size() - fiberCount(); }

  /// Whether a fiber is a closed curve.
  bool isClosed(std::size_t fiber) const { return !closed.empty() && closed[fiber] != 0; }

  /// Radius of the segment that starts at a point.
  double radiusAt(std::size_t point) const { return radii.empty() ? radius : radii[point]; }
};

/// The polylines as FiberTree takes them. They borrow the arrays of `scene`.
inline FiberArrays<double> fiberArrays(const FiberPolylines& scene) {
  FiberArrays<double> arrays;
  arrays.points = scene.points.empty() ? nullptr : scene.points.front().data();
  arrays.point_count = scene.points.size();
  arrays.point_begin = scene.point_begin.data();
  arrays.fiber_count = scene.fiberCount();
  arrays.radii = scene.radii.empty() ? &scene.radius : scene.radii.data();
  arrays.radii_are = scene.radii.empty() ? FiberArrays<double>::Radii::kOne
                                         : FiberArrays<double>::Radii::kPerSegment;
  arrays.closed = scene.closed.empty() ? nullptr : scene.closed.data();
  return arrays;
}

}  // namespace fcl_fibers
