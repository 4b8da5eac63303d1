// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/fiber_manager_options.h>

#include "broadphase/object_source.h"
#include "geometry/segment.h"
#include "parallel/executor.h"

namespace fcl_fibers::broadphase {

/// Names an object by its place among those of a call.
inline std::string nameOfPlace(SegmentId place) { return nameOf(static_cast<std::size_t>(place)); }

/// Reads an object of a call in the world's frame. Throws RefusedObject, or std::invalid_argument
/// if it is null.
template <typename S>
FCL_FIBERS_ALWAYS_INLINE void readNew(const char* call,
                                      const std::vector<fcl::CollisionObject<S>*>& objects,
                                      std::size_t place, Bounds bounds,
                                      geometry::Segment& segment) {
  if (objects[place] == nullptr) {
    fibers::throwInvalidArgument(call, nameOf(place) + " is null; pass a pointer to an object");
  }
  if (const char* problem = readSegment(*objects[place], geometry::Frame{}, bounds, segment)) {
    refuse(problem, static_cast<SegmentId>(place));
  }
}
template <typename S>
geometry::Segment readNew(const char* call, const std::vector<fcl::CollisionObject<S>*>& objects,
                          std::size_t place, Bounds bounds) {
  geometry::Segment segment;
  readNew(call, objects, place, bounds, segment);
  return segment;
}

/// The objects of one call that registers them, as they are read before anything is changed. The
/// build reads them again, and finds margins, which cannot make an object unreadable unless they
/// overflow.
template <typename S>
class NewObjects {
 public:
  using Object = fcl::CollisionObject<S>;

  /// @param objects  borrowed
  NewObjects(const char* call, const std::vector<Object*>& objects,
             const FiberManagerOptions& options);

  /// Reads all. Throws what readNew() throws about the first that is refused.
  /// @param is_fiber  whether they are one fiber. Otherwise a capsule that shares an end point with
  ///                  the capsule before continues its fiber.
  /// @param before    the capsule before the first one; null if that may not be continued
  /// @param executor  null for one thread
  void read(bool is_fiber, const geometry::Segment* before, parallel::Executor* executor);

  std::vector<std::uint8_t> starts_fiber;  ///< 1 for each that starts a fiber, 0 for others
  std::vector<double> lengths;             ///< see ObjectRegistry::add()
  std::vector<std::size_t> others;         ///< places of those other than capsules and spheres
  std::optional<geometry::Segment> last;   ///< the last one, if it may be continued

 private:
  std::optional<geometry::Segment> capsuleAt(std::size_t place) const;
  void readRange(std::size_t begin, std::size_t end, bool is_fiber, const geometry::Segment* before,
                 std::vector<std::size_t>& others_here);

  const char* const call_;
  const std::vector<Object*>& objects_;
  const Bounds bounds_;
};

extern template class NewObjects<float>;
extern template class NewObjects<double>;

}  // namespace fcl_fibers::broadphase
