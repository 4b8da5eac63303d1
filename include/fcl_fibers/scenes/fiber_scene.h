// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/scenes/export.h>

namespace fcl_fibers::scenes {

using Point = std::array<double, 3>;

/// A fiber assembly as polylines in the world frame, one radius for all. Fiber f owns the points
/// [point_begin[f], point_begin[f + 1]), ordered root to tip, and one segment less than points.
struct FiberScene {
  std::vector<Point> points;

  /// Ascends strictly from 0 to points.size(): every fiber has at least one point.
  std::vector<std::size_t> point_begin = {0};

  /// Finite, not negative.
  double radius = 0;

  std::size_t fiberCount() const { return point_begin.size() - 1; }
  std::size_t segmentCount() const { return points.size() - fiberCount(); }
};

/// Poses of all segments, fiber after fiber: an `fcl::Capsule` along z is centred between the two
/// points and turned onto them, from the first (-z) to the second (+z). Its ends meet the points to
/// 2 ulp of the largest coordinate. A segment of length zero is not turned.
///
/// Throws std::invalid_argument if point_begin is not as FiberScene says, or if a coordinate is not
/// a number that S holds with two bits to spare.
template <typename S>
FCL_FIBERS_SCENES_EXPORT std::vector<fcl::Transform3<S>> segmentPoses(const FiberScene& scene);

/// One object per segment, fiber after fiber, each with a capsule of its own, posed as segmentPoses
/// says. Throws as segmentPoses does, and if the radius is not finite in S or negative.
template <typename S>
FCL_FIBERS_SCENES_EXPORT std::vector<std::unique_ptr<fcl::CollisionObject<S>>> makeObjects(
    const FiberScene& scene);

extern template FCL_FIBERS_SCENES_EXPORT std::vector<fcl::Transform3<float>> segmentPoses<float>(
    const FiberScene& scene);
extern template FCL_FIBERS_SCENES_EXPORT std::vector<fcl::Transform3<double>> segmentPoses<double>(
    const FiberScene& scene);
extern template FCL_FIBERS_SCENES_EXPORT std::vector<std::unique_ptr<fcl::CollisionObject<float>>>
makeObjects<float>(const FiberScene& scene);
extern template FCL_FIBERS_SCENES_EXPORT std::vector<std::unique_ptr<fcl::CollisionObject<double>>>
makeObjects<double>(const FiberScene& scene);

}  // namespace fcl_fibers::scenes
