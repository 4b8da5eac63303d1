// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/fiber_manager_options.h>

#include "broadphase/object_reader.h"
#include "index/segment_source.h"
#include "simd/always_inline.h"

namespace fcl_fibers::broadphase {

constexpr const char* kIsNoMeshNow = "it is no mesh any more; unregister it and register it again";
constexpr const char* kIsMeshNow = "it has become a mesh; unregister it and register it again";

inline std::string nameOf(std::size_t index) { return "object " + std::to_string(index); }

/// Names an object by its id among all, of which those that were removed are null.
template <class Object>
std::string nameOf(const std::vector<Object*>& objects, index::SegmentId id) {
  const auto empty = std::count(objects.begin(), objects.begin() + id, nullptr);
  return nameOf(static_cast<std::size_t>(id - empty)) + " in order of registration";
}

/// Reads FCL's objects as segments. An object's id is its position. A null pointer is an empty id.
template <typename S>
class ObjectSource final : public index::SegmentSource {
 public:
  using Object = fcl::CollisionObject<S>;
  using Ids = std::vector<index::SegmentId>;

  /// @param call            for the text of refuse()
  /// @param objects         by id; borrowed
  /// @param beside          the objects that are no segments, in ascending order; borrowed, or null
  /// @param counts_shapes   whether objects count by more than their boxes: then boxes are marked,
  /// as
  ///                        segmentOf() does, and any other fcl::BVHModel is refused
  ObjectSource(const char* call, const std::vector<Object*>& objects, Bounds bounds,
               const Ids* beside = nullptr, bool counts_shapes = false)
      : call_(call),
        objects_(objects),
        bounds_(bounds),
        beside_(beside),
        counts_shapes_(counts_shapes) {}

  bool read(const index::SegmentId* ids, int count, int ahead, const geometry::Frame& frame,
            index::SegmentBlock& out, index::BlockMask& present) const override;
  bool readNow(index::SegmentId id, const geometry::Frame& frame,
               geometry::Segment& segment) const override {
    const Object* object = objects_[static_cast<std::size_t>(id)];
    return object != nullptr && !isBeside(id) && !isRefused(kindOf(*object)) &&
           readSegment(*object, frame, bounds_, segment, counts_shapes_) == nullptr;
  }
  bool staysFiniteIn(const geometry::Frame&) const override { return true; }
  bool isFasterInOrder() const override { return true; }
  /// Names an object in an error text.
  std::string nameOf(index::SegmentId id) const { return broadphase::nameOf(objects_, id); }
  [[noreturn]] void refuse(index::SegmentId id, const geometry::Frame& frame) const override;

 private:
  bool isBeside(index::SegmentId id) const {
    return beside_ != nullptr && std::binary_search(beside_->begin(), beside_->end(), id);
  }
  /// Whether some of these ids may be no segments.
  bool mayBeBeside(const index::SegmentId* ids, int count) const {
    if (beside_ == nullptr || beside_->empty()) return false;
    const auto [first, last] = std::minmax_element(ids, ids + count);
    const auto next = std::lower_bound(beside_->begin(), beside_->end(), *first);
    return next != beside_->end() && *next <= *last;
  }
  bool isRefused(ObjectKind kind) const { return counts_shapes_ && kind == ObjectKind::kMesh; }

  const char* call_;
  const std::vector<Object*>& objects_;
  Bounds bounds_;
  const Ids* beside_;
  bool counts_shapes_;
};

/// Prefetches the line that is `offset` bytes behind an address. The address may be null and the
/// object there may end before, so this is no sum of pointers.
FCL_FIBERS_ALWAYS_INLINE void prefetchBehind(const void* address, std::size_t offset) {
  __builtin_prefetch(
      reinterpret_cast<const void*>(reinterpret_cast<std::uintptr_t>(address) + offset));
}

FCL_FIBERS_ALWAYS_INLINE void prefetchLines(const void* object, std::size_t count) {
  if (object == nullptr) return;
  for (std::size_t line = 0; line < count; ++line) prefetchBehind(object, 64 * line);
}

/// FCL objects are scattered on the heap. Round `i` of a loop over objectAt(0), ...,
/// objectAt(count - 1) calls this to prefetch what a round soon after it reads. It is inlined by
/// force, because gcc removes a call of a function that only prefetches.
template <typename S, class ObjectAt>
FCL_FIBERS_ALWAYS_INLINE void prefetchObject(ObjectAt&& objectAt, std::size_t i,
                                             std::size_t count) {
  constexpr std::size_t kAhead = 8;
  if (i + 2 * kAhead < count) prefetchLines(objectAt(i + 2 * kAhead), 4);
  if (i + kAhead >= count) return;
  // The object that is kAhead rounds ahead is in the cache by now, so the address of its shape is
  // known. Behind the members of all geometries a capsule and a cylinder have two numbers, and a
  // box has three. A line may begin between them.
  const fcl::CollisionObject<S>* next = objectAt(i + kAhead);
  if (next == nullptr) return;
  const fcl::CollisionGeometry<S>* shape = ObjectMembers<S>::shape(*next);
  prefetchBehind(shape, 0);
  prefetchBehind(shape, sizeof(fcl::CollisionGeometry<S>));
  prefetchBehind(shape, sizeof(fcl::CollisionGeometry<S>) + 3 * sizeof(S) - 1);
}

}  // namespace fcl_fibers::broadphase
