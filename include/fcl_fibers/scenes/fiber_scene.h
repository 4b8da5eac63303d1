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
  std::vector<std::size_t> point_begin = {0};
  double radius = 0;

  std::size_t fiberCount() const { return point_begin.size() - 1; }
  std::size_t segmentCount() const { return points.size() - fiberCount(); }
};

/// Poses of all segments, fiber after fiber: an `fcl::Capsule` along z is centred between the two
/// points and turned onto them.
template <typename S>
std::vector<fcl::Transform3<S>> segmentPoses(const FiberScene& scene);

/// One object per segment, fiber after fiber, each with a capsule of its own.
template <typename S>
std::vector<std::unique_ptr<fcl::CollisionObject<S>>> makeObjects(const FiberScene& scene);

}  // namespace fcl_fibers::scenes
