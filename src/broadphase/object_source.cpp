// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/object_source.h"

#include <limits>

#include "geometry/posed_shapes.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::Frame;
using geometry::PosedShapes;
using geometry::Segment;
using geometry::Vec3d;

/// Puts an object at place i if it is a capsule, sphere or box. Returns whether it is.
/// @param is_marked  as segmentOf() marks boxes
template <typename S>
FCL_FIBERS_ALWAYS_INLINE bool put(const fcl::CollisionObject<S>& object, ObjectKind kind,
                                  bool is_marked, int i, PosedShapes& out) {
  const bool is_box = kind == ObjectKind::kBar && isBox(object);
  if (is_box) {
    const Vec3d sides = sidesOf(object);
    out.size[0][i] = sides.x;
    out.size[1][i] = sides.y;
    out.size[2][i] = sides.z;
    out.radius[i] = is_marked ? -markOf(poseOf(object), sides) : -1;
  } else if (!readSize(object, kind, out.radius[i], out.size[2][i])) {
    return false;
  }
  const auto& pose = ObjectMembers<S>::pose(object).matrix();
  const fcl::AABB<S>& box = ObjectMembers<S>::box(object);
  for (int axis = 0; axis < 3; ++axis) {
    for (int column = 0; column < 3; ++column) {
      out.rotation[column][axis][i] = static_cast<double>(pose(axis, column));
    }
    out.position[axis][i] = static_cast<double>(pose(axis, 3));
    out.low[axis][i] = static_cast<double>(box.min_[axis]);
    out.high[axis][i] = static_cast<double>(box.max_[axis]);
  }
  return true;
}

template <typename S>
geometry::ScalarLimits scalarLimits() {
  using Limits = std::numeric_limits<S>;
  return {double{Limits::epsilon()}, 4 * double{Limits::denorm_min()}, double{Limits::max()} / 4,
          double{Eigen::NumTraits<S>::dummy_precision()}};
}

}  // namespace

/// Reads most capsules, spheres and boxes together, and others by readSegment(), which gives the
/// same segments.
template <typename S>
bool ObjectSource<S>::read(const index::SegmentId* ids, int count, int ahead, const Frame& frame,
                           index::SegmentBlock& out, index::BlockMask& present) const {
  const auto objectAt = [&](std::size_t i) { return objects_[static_cast<std::size_t>(ids[i])]; };
  const auto known = static_cast<std::size_t>(count + ahead);
  PosedShapes shapes;
  index::BlockMask together = 0, boxes = 0;
  const bool may_be_beside = mayBeBeside(ids, count);
  present = 0;
  for (int i = 0; i < count; ++i) {
    prefetchObject<S>(objectAt, static_cast<std::size_t>(i), known);
    const Object* object = objectAt(static_cast<std::size_t>(i));
    const index::BlockMask bit = index::BlockMask{1} << i;
    if (may_be_beside && isBeside(ids[i])) continue;
    if (object != nullptr) present |= bit;
    if (object == nullptr || bounds_ == Bounds::kObjects) continue;
    const ObjectKind kind = kindOf(*object);
    if (isRefused(kind)) return false;
    if (count == 1 || !put(*object, kind, counts_shapes_, i, shapes)) continue;
    together |= bit;
    if (!isRound(kind)) boxes |= bit;
  }
  if (together != 0) {
    // Capsules among boxes have all numbers of a box.
    for (index::BlockMask rest = boxes != 0 ? together & ~boxes : 0; rest != 0; rest &= rest - 1) {
      const int i = __builtin_ctzll(rest);
      shapes.size[0][i] = shapes.size[1][i] = 0;
    }
    const index::BlockMask read = geometry::firstOfBlock((count + 7) / 8 * 8);
    for (index::BlockMask rest = read & ~together; rest != 0; rest &= rest - 1) {
      shapes.clear(__builtin_ctzll(rest));
    }
    together &= segmentsOf(shapes, boxes, count, frame, kUsualRotation, scalarLimits<S>(),
                           bounds_ == Bounds::kShapesAndMargins, out);
  }
  for (index::BlockMask rest = present & ~together; rest != 0; rest &= rest - 1) {
    const int i = __builtin_ctzll(rest);
    Segment segment;
    if (readSegment(*objectAt(static_cast<std::size_t>(i)), frame, bounds_, segment,
                    counts_shapes_) != nullptr) {
      return false;
    }
    out.set(i, segment);
  }
  for (index::BlockMask absent = geometry::firstOfBlock(count) & ~present; absent != 0;
       absent &= absent - 1) {
    out.set(__builtin_ctzll(absent), Segment{});
  }
  return true;
}

template <typename S>
void ObjectSource<S>::refuse(index::SegmentId id, const Frame& frame) const {
  if (const Object* object = objects_[static_cast<std::size_t>(id)]) {
    named(
        call_, [this](SegmentId i) { return nameOf(i); },
        [&] {
          if (isRefused(kindOf(*object))) broadphase::refuse(kIsMeshNow, id);
          requireSegment(*object, frame, bounds_, id);
        });
  }
  // If the object can be read now, another thread has changed it meanwhile.
  fibers::throwInvalidArgument(call_,
                               "an object has changed during the call; change objects after it");
}

template class ObjectSource<float>;
template class ObjectSource<double>;

}  // namespace fcl_fibers::broadphase
