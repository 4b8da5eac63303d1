// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/eigen_alignment.h>
#include <fcl_fibers/export.h>
#include <fcl_fibers/fiber_options.h>
#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers {

/// Poses of all segments, fiber after fiber, in the world frame. An `fcl::Capsule` along z is
/// centred between the two points and turned from the first (-z) to the second (+z). Its ends match
/// the points to 2 ulp of the largest coordinate. A segment of length zero is not turned.
///
/// Throws std::invalid_argument if point_begin is not as FiberPolylines requires, or if a
/// coordinate is not a number that S holds with two bits to spare.
template <typename S>
FCL_FIBERS_EXPORT std::vector<fcl::Transform3<S>> segmentPoses(const FiberPolylines& scene);

/// One object per segment, fiber after fiber, each with a capsule of its own at the pose of
/// segmentPoses(). FCL has no shape that tapers, so where the radii at the ends of a segment
/// differ, its capsule has the larger one. Throws as segmentPoses() does, if a radius is negative
/// or not finite in S, and if `radii` is neither empty nor one for each point.
template <typename S>
FCL_FIBERS_EXPORT std::vector<std::unique_ptr<fcl::CollisionObject<S>>> makeObjects(
    const FiberPolylines& scene);

/// Moves the objects of makeObjects() to another state of the same fibers. Poses, lengths and radii
/// change. A manager finds the fibers there after its update(). FCL's boxes are computed anew, so
/// computeAABB() is not needed, and a margin that the program added to a box is gone.
///
/// Throws std::invalid_argument, and moves nothing, if there are not as many objects as segments,
/// if an object is null or no longer a capsule, and as makeObjects() does. Each capsule must still
/// belong to one object alone, as makeObjects() made it.
template <typename S>
FCL_FIBERS_EXPORT void moveObjects(
    const FiberPolylines& scene,
    const std::vector<std::unique_ptr<fcl::CollisionObject<S>>>& objects);

/// One fiber of a scene, as registerFiber() takes it.
template <typename Object>
struct FiberObjects {
  std::vector<Object*> objects;       ///< one per segment, along the fiber; borrowed
  FiberEnds ends = FiberEnds::kOpen;  ///< from FiberPolylines::closed
  /// Where it meets itself or fibers before it, from FiberPolylines::starts_at and ends_at.
  std::vector<FiberJoint<Object>> joints;
};

/// Returns the pairs of points that starts_at and ends_at of a scene join. In a pair the later
/// point comes first, and the pairs ascend. A fiber of one point has no segment, so the points that
/// are joined to it are joined with each other instead. Throws std::invalid_argument if starts_at
/// or ends_at has another size than there are fibers, or names a point that is not there, that is
/// at another place or that is the fiber's own end.
FCL_FIBERS_EXPORT std::vector<std::pair<std::size_t, std::size_t>> joinedPoints(
    const FiberPolylines& scene);

/// Sorts by fiber what makeObjects() made, or pointers to as many objects in the same order:
///
///     const auto objects = makeObjects<double>(scene);
///     for (const auto& fiber : objectsByFiber(scene, objects)) {
///       manager.registerFiber(fiber.objects, fiber.ends, {}, {}, fiber.joints);
///     }
///
/// A fiber of one point or none has no object. registerFiber() then registers nothing, and the
/// manager does not count this fiber. Throws std::invalid_argument if there are not as many objects
/// as segments, and as joinedPoints() does.
template <typename Pointer>
auto objectsByFiber(const FiberPolylines& scene, const std::vector<Pointer>& objects) {
  using Object = std::remove_reference_t<decltype(*objects.front())>;
  if (objects.size() != scene.segmentCount()) {
    throw std::invalid_argument("objectsByFiber: there are " + std::to_string(objects.size()) +
                                " objects and " + std::to_string(scene.segmentCount()) +
                                " segments; pass the objects of the scene");
  }
  const auto joined = joinedPoints(scene);
  auto joint = joined.begin();
  // The segment that starts at each point; null at the last one of a fiber.
  std::vector<Object*> from(joined.empty() ? 0 : scene.points.size());
  std::vector<FiberObjects<Object>> fibers(scene.fiberCount());
  auto next = objects.begin();
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t begin = scene.point_begin[f], segments = scene.segmentCount(f);
    fibers[f].ends = scene.isClosed(f) ? FiberEnds::kClosed : FiberEnds::kOpen;
    fibers[f].objects.reserve(segments);
    for (std::size_t i = 0; i < segments; ++i) {
      fibers[f].objects.push_back(&**next++);
      if (!joined.empty()) from[begin + i] = fibers[f].objects.back();
    }
    for (; joint != joined.end() && joint->first < scene.point_begin[f + 1]; ++joint) {
      const auto [point, at] = *joint;
      const bool at_end = from[at] == nullptr;
      fibers[f].joints.push_back({point - begin, from[at_end ? at - 1 : at], at_end});
    }
  }
  return fibers;
}

}  // namespace fcl_fibers
