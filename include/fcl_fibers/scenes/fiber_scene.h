// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/eigen_alignment.h>
#include <fcl_fibers/scenes/export.h>
#include <fcl_fibers/scenes/fiber_polylines.h>

namespace fcl_fibers::scenes {

/// Poses of all segments, fiber after fiber: an `fcl::Capsule` along z is centred between the two
/// points and turned onto them, from the first (-z) to the second (+z). Its ends meet the points to
/// 2 ulp of the largest coordinate. A segment of length zero is not turned.
///
/// Throws std::invalid_argument if point_begin is not as FiberScene says, or if a coordinate is not
/// a number that S holds with two bits to spare.
template <typename S>
FCL_FIBERS_SCENES_EXPORT std::vector<fcl::Transform3<S>> segmentPoses(const FiberScene& scene);

/// One object per segment, fiber after fiber, each with a capsule of its own, posed as segmentPoses
/// says. Throws as segmentPoses does, if a radius is not finite in S or negative, and if there are
/// radii but not one for each point.
template <typename S>
FCL_FIBERS_SCENES_EXPORT std::vector<std::unique_ptr<fcl::CollisionObject<S>>> makeObjects(
    const FiberScene& scene);

/// @cond
extern template FCL_FIBERS_SCENES_EXPORT std::vector<fcl::Transform3<float>> segmentPoses<float>(
    const FiberScene& scene);
extern template FCL_FIBERS_SCENES_EXPORT std::vector<fcl::Transform3<double>> segmentPoses<double>(
    const FiberScene& scene);
extern template FCL_FIBERS_SCENES_EXPORT std::vector<std::unique_ptr<fcl::CollisionObject<float>>>
makeObjects<float>(const FiberScene& scene);
extern template FCL_FIBERS_SCENES_EXPORT std::vector<std::unique_ptr<fcl::CollisionObject<double>>>
makeObjects<double>(const FiberScene& scene);
/// @endcond

}  // namespace fcl_fibers::scenes
