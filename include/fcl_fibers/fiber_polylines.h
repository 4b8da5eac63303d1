// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

namespace fcl_fibers {

using Point = std::array<double, 3>;  ///< x, y, z

/// Fibers as polylines, which own their points; readFibers() and the test scenes return them. Fiber
/// f has the points [point_begin[f], point_begin[f + 1]), ordered from root to tip, and a segment
/// between each two consecutive ones. Points are in the world frame.
///
///     FiberPolylines fibers;
///     fibers.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
///     fibers.point_begin = {0, 2, 4};  // two fibers of two points
///     fibers.radius = 0.1;
///     tree.build(fiberArrays(fibers));
struct FiberPolylines {
  std::vector<Point> points;  ///< fiber after fiber, in the scene's unit of length; finite

  /// fiber count + 1 numbers, which run from 0 to points.size() and never descend. A fiber may have
  /// one point, or none.
  std::vector<std::size_t> point_begin = {0};

  /// Radius of every segment, if `radii` is empty. Finite, not negative.
  double radius = 0;

  /// One number per point; `radii_are` tells what they are. If this is empty, `radius` counts for
  /// all. Finite, not negative.
  std::vector<double> radii;

  /// What `radii` holds: the radius of the segment that starts at each point (kPerFirstPoint), or
  /// the radius at each point, so that segments are rounded cones (kPerPoint).
  FiberArrays<double>::Radii radii_are = FiberArrays<double>::Radii::kPerFirstPoint;

  /// One number per fiber: 1 if it is a closed curve, else 0. The last point of a closed curve
  /// repeats its first, so its last segment is a neighbour of its first. If this is empty, no fiber
  /// is closed.
  std::vector<std::uint8_t> closed;

  /// One number per fiber: the point of a fiber that its first point repeats, or -1 for none; see
  /// FiberArrays::starts_at. If this is empty, no fiber starts at another one.
  std::vector<std::int32_t> starts_at;

  /// One number per fiber: the point of a fiber that its last point repeats, or -1 for none. If
  /// this is empty, no fiber ends at another one.
  std::vector<std::int32_t> ends_at;

  /// One number per fiber: its group, or 0 for none; see FiberArrays::groups. If this is empty, no
  /// fiber has a group.
  std::vector<std::int32_t> groups;

  /// One number per point: the sample of an .swc file that it is, or -1 if it is none. A segment is
  /// the piece between the sample of its second point and that sample's parent. Queries do not read
  /// them. Empty if the file has none.
  std::vector<std::int64_t> samples;
  /// One number per point: the type of its sample, such as 3 for a dendrite. Empty without samples.
  std::vector<std::int64_t> types;

  /// Number of fibers, including those without segments.
  std::size_t fiberCount() const { return point_begin.size() - 1; }

  /// Number of segments of all fibers.
  std::size_t segmentCount() const {
    std::size_t count = 0;
    for (std::size_t f = 0; f < fiberCount(); ++f) count += segmentCount(f);
    return count;
  }

  /// Number of segments of one fiber.
  std::size_t segmentCount(std::size_t fiber) const {
    const std::size_t begin = point_begin[fiber], end = point_begin[fiber + 1];
    return end > begin ? end - begin - 1 : 0;
  }

  /// Returns whether a fiber is a closed curve.
  bool isClosed(std::size_t fiber) const { return !closed.empty() && closed[fiber] != 0; }

  /// Returns whether `radii` are those of points, so that segments may taper.
  bool hasRadiiOfPoints() const {
    return !radii.empty() && radii_are == FiberArrays<double>::Radii::kPerPoint;
  }

  /// Returns the radius of the segment that starts at a point, or the larger one of its two ends if
  /// they differ.
  /// @pre the point is not the last one of its fiber, which starts no segment
  double radiusAt(std::size_t point) const {
    if (hasRadiiOfPoints()) return std::max(radii[point], radii[point + 1]);
    return radii.empty() ? radius : radii[point];
  }

  /// Returns the radius of the segment that starts at a point, at s in [0, 1] from its first end to
  /// its second, such as Contact::s.
  double radiusAt(std::size_t point, double s) const {
    if (!hasRadiiOfPoints()) return radiusAt(point);
    return radii[point] + s * (radii[point + 1] - radii[point]);
  }
};

/// Returns the polylines as FiberTree takes them. The result borrows the arrays of `scene`.
inline FiberArrays<double> fiberArrays(const FiberPolylines& scene) {
  FiberArrays<double> arrays;
  arrays.points = scene.points.empty() ? nullptr : scene.points.front().data();
  arrays.point_count = scene.points.size();
  arrays.point_begin = scene.point_begin.data();
  arrays.fiber_count = scene.fiberCount();
  arrays.radii = scene.radii.empty() ? &scene.radius : scene.radii.data();
  arrays.radii_are = scene.radii.empty() ? FiberArrays<double>::Radii::kOne : scene.radii_are;
  arrays.closed = scene.closed.empty() ? nullptr : scene.closed.data();
  arrays.starts_at = scene.starts_at.empty() ? nullptr : scene.starts_at.data();
  arrays.ends_at = scene.ends_at.empty() ? nullptr : scene.ends_at.data();
  arrays.groups = scene.groups.empty() ? nullptr : scene.groups.data();
  return arrays;
}

}  // namespace fcl_fibers
