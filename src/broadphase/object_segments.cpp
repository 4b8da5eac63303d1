// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/object_segments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "broadphase/object_members.h"
#include "broadphase/object_source.h"
#include "broadphase/program_margin.h"
#include "broadphase/shape_box.h"
#include "geometry/affine_map.h"
#include "geometry/posed_capsules.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::Frame;
using geometry::PosedCapsules;
using geometry::Segment;
using geometry::Vec3d;

bool allFinite(const Vec3d& v) {
  // Zero times infinity or NaN is NaN.
  return 0 * v.x + 0 * v.y + 0 * v.z == 0;
}

/// What segmentsOf() takes without a second look: the six numbers of its sum bound the entries of
/// R^T R - I, of which that of the third column by twice the sum and a little.
constexpr double kUsualRotation = kRotationTolerance / 2.05;

const char* rangeProblem(const Segment& segment) {
  return isFinite(segment)
             ? nullptr
             : "its coordinates overflow; bring the scene nearer to the origin or change its unit";
}

/// Adds to a capsule or sphere the margin that the program has added to its box.
template <typename S>
const char* addWidening(const fcl::CollisionObject<S>& object, const Frame& frame, double radius,
                        double length, Segment& segment) {
  const Widening added = wideningOf(object, radius, length);
  segment.radius += frame.scale * added.margin;
  if (added.is_uneven) {
    const Corners own = ownCorners(ObjectMembers<S>::box(object), frame);
    const Segment box = boxAround(segment, endPointError(segment));
    segment = Segment::box(min(own.low, box.a), max(own.high, box.b));
    return nullptr;
  }
  return rangeProblem(segment);
}

/// Whether a box has the size that FCL gives to a capsule, rotated or not, or the least size in
/// this pose. Nearly all boxes have. Boxes too small to be squared, and rotated capsules without
/// length, are left to wideningOf(). segmentsOf() decides in the same way.
template <typename S>
bool isUsualBox(const fcl::AABB<S>& box, const fcl::Transform3<S>& pose, double radius,
                double length) {
  const Vec3d size = toVec3(box.max_) - toVec3(box.min_);
  const Vec3d axis = toVec3(pose.matrix().col(2));
  const double thickness = radius + radius, end = length + thickness;
  // Bound on the rounding of the sides of a box in this pose.
  const double slack = double{std::numeric_limits<S>::epsilon()} *
                       (1.25 * maxNorm(toVec3(pose.matrix().col(3))) + 5 * end);
  const auto is = [&](const Vec3d& sides) {
    const Vec3d off = size - sides;
    return std::fabs(off.x) <= slack && std::fabs(off.y) <= slack && std::fabs(off.z) <= slack;
  };
  // The side of the rotated box is the diagonal of the unrotated one.
  constexpr double kSmall = 1e-280;
  const double squared = thickness * thickness * 2 + end * end;
  const bool is_turned = is({size.x, size.x, size.x}) && length > 0 && squared > kSmall &&
                         std::fabs(size.x * size.x - squared) <= 2 * slack * size.x;
  return is_turned || is({thickness, thickness, end}) ||
         is({length * std::fabs(axis.x) + thickness, length * std::fabs(axis.y) + thickness,
             length * std::fabs(axis.z) + thickness});
}

/// Puts a capsule or sphere at place i.
template <typename S>
FCL_FIBERS_ALWAYS_INLINE void put(const fcl::CollisionObject<S>& object, double radius,
                                  double length, int i, PosedCapsules& out) {
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
  out.radius[i] = radius;
  out.length[i] = length;
}

}  // namespace

template <typename S>
const char* poseProblem(const fcl::Transform3<S>& pose, double tolerance) {
  const auto& matrix = pose.matrix();
  const Vec3d x = toVec3(matrix.col(0)), y = toVec3(matrix.col(1)), z = toVec3(matrix.col(2));
  const Vec3d t = toVec3(matrix.col(3));
  if (geometry::isRotation(x, y, z, tolerance) && allFinite(t)) return nullptr;
  if (!allFinite(x) || !allFinite(y) || !allFinite(z) || !allFinite(t)) {
    return "its pose is NaN or infinite; give it a finite pose";
  }
  return "its rotation is not orthonormal or is a reflection; give it a proper rotation";
}

template <typename S>
const char* readSegment(const fcl::CollisionObject<S>& object, const Frame& frame, Bounds bounds,
                        Segment& segment) {
  const fcl::CollisionGeometry<S>* shape = ObjectMembers<S>::shape(object);
  if (shape == nullptr) return "it has no geometry; construct it with a shape";
  const fcl::Transform3<S>& pose = ObjectMembers<S>::pose(object);
  if (const char* problem = poseProblem(pose)) return problem;

  const fcl::NODE_TYPE type = shape->getNodeType();
  double radius, length;
  if (bounds == Bounds::kObjects || !readSize(*shape, type, radius, length)) {
    return readBox(object, type, frame, bounds, segment);
  }
  if (const char* problem = sizeProblem(radius, length)) return problem;
  const Vec3d center = frame.fromWorld(toVec3(pose.matrix().col(3)));
  // Halving the length instead of the scale could lose the last bit of a subnormal length.
  const Vec3d half = (frame.scale / 2 * length) * toVec3(pose.matrix().col(2));
  segment = {center - half, center + half, frame.scale * radius};
  if (const char* problem = rangeProblem(segment)) return problem;
  if (bounds == Bounds::kShapes ||
      isUsualBox(ObjectMembers<S>::box(object), pose, radius, length)) {
    return nullptr;
  }
  return addWidening(object, frame, radius, length, segment);
}

/// Reads most capsules and spheres together, and others by readSegment(), which gives the same
/// segments.
template <typename S>
bool ObjectSource<S>::read(const index::SegmentId* ids, int count, int ahead, const Frame& frame,
                           index::SegmentBlock& out, index::BlockMask& present) const {
  const auto objectAt = [&](std::size_t i) { return objects_[static_cast<std::size_t>(ids[i])]; };
  const auto known = static_cast<std::size_t>(count + ahead);
  PosedCapsules capsules;
  index::BlockMask together = 0;
  present = 0;
  for (int i = 0; i < count; ++i) {
    prefetchObject<S>(objectAt, static_cast<std::size_t>(i), known);
    const Object* object = objectAt(static_cast<std::size_t>(i));
    const index::BlockMask bit = index::BlockMask{1} << i;
    if (object != nullptr) present |= bit;
    if (object == nullptr || bounds_ == Bounds::kObjects) continue;
    const fcl::CollisionGeometry<S>* shape = ObjectMembers<S>::shape(*object);
    double radius, length;
    if (shape == nullptr || !readSize(*shape, shape->getNodeType(), radius, length)) {
      if (!isNoSegment(*object)) continue;
      if (!is_apart_(ids[i])) return false;
      present &= ~bit;
      continue;
    }
    if (count == 1) continue;
    put(*object, radius, length, i, capsules);
    together |= bit;
  }
  if (together != 0) {
    const index::BlockMask read = geometry::firstOfBlock((count + 7) / 8 * 8);
    for (index::BlockMask rest = read & ~together; rest != 0; rest &= rest - 1) {
      capsules.clear(__builtin_ctzll(rest));
    }
    const geometry::UsualCapsules usual = {kUsualRotation,
                                           double{std::numeric_limits<S>::epsilon()},
                                           bounds_ == Bounds::kShapesAndMargins};
    together &= segmentsOf(capsules, count, frame, usual, out);
  }
  for (index::BlockMask rest = present & ~together; rest != 0; rest &= rest - 1) {
    const int i = __builtin_ctzll(rest);
    Segment segment;
    if (readSegment(*objectAt(static_cast<std::size_t>(i)), frame, bounds_, segment) != nullptr) {
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
    if (isNoSegment(*object)) fibers::throwInvalidArgument(call_, nameOf(id) + ": " + kIsMeshNow);
    readObject(call_, *object, frame, bounds_, [&] { return nameOf(id); });
  }
  // If the object can be read now, another thread has changed it meanwhile.
  fibers::throwInvalidArgument(call_,
                               "an object has changed during the call; change objects after it");
}

template class ObjectSource<float>;
template class ObjectSource<double>;
template const char* poseProblem(const fcl::Transform3<float>&, double);
template const char* poseProblem(const fcl::Transform3<double>&, double);
template const char* readSegment(const fcl::CollisionObject<float>&, const Frame&, Bounds,
                                 Segment&);
template const char* readSegment(const fcl::CollisionObject<double>&, const Frame&, Bounds,
                                 Segment&);

}  // namespace fcl_fibers::broadphase
