// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/object_segments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cylinder.h>

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
  if (added.is_uneven) {
    segment.radius += frame.scale * added.everywhere;
    const Corners own = ownCorners(ObjectMembers<S>::box(object), frame);
    const Segment box = boxAround(segment, endPointError(segment));
    segment = {min(own.low, box.a), max(own.high, box.b), -2};
    return nullptr;
  }
  segment.radius += frame.scale * added.margin;
  return rangeProblem(segment);
}

/// Whether a box has the size that FCL gives to a capsule, rotated or not, or the least size in
/// this pose, up to the rounding of both; see BoxSize. Nearly all boxes have. Boxes too small to be
/// squared, and rotated capsules with hardly any length, are left to wideningOf(). segmentsOf()
/// decides in the same way.
template <typename S>
bool isUsualBox(const fcl::AABB<S>& box, const fcl::Transform3<S>& pose, double radius,
                double length) {
  const Vec3d size = toVec3(box.max_) - toVec3(box.min_);
  const Vec3d axis = toVec3(pose.matrix().col(2));
  const double thickness = radius + radius, end = length + thickness;
  // Bound on the rounding of the sides of a box in this pose.
  const double slack = double{std::numeric_limits<S>::epsilon()} *
                       (2.5 * maxNorm(toVec3(pose.matrix().col(3))) + 8 * end);
  const auto is = [&](const Vec3d& sides) {
    const Vec3d off = size - sides;
    return std::fabs(off.x) <= slack && std::fabs(off.y) <= slack && std::fabs(off.z) <= slack;
  };
  // The side of the rotated box is the diagonal of the unrotated one.
  // Without length both are cubes, and one that a program widened may be as large as the other.
  constexpr double kSmall = 1e-280;
  const double squared = thickness * thickness * 2 + end * end;
  const bool is_turned = is({size.x, size.x, size.x}) && length > 2 * slack && squared > kSmall &&
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
  // Most rotations are close to orthonormal, and their right hand tells so in fewer steps. The sum
  // bounds what isRotation() asks for; see kUsualRotation.
  const Vec3d off = cross(x, y) - z;
  const double deviation =
      (std::fabs(dot(x, x) - 1) + std::fabs(dot(y, y) - 1)) + (std::fabs(dot(x, y)) + norm1(off));
  if (deviation <= kUsualRotation && allFinite(t)) return nullptr;
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

template <typename S>
void numberBox(const fcl::CollisionObject<S>& object, Segment& segment) {
  if (!segment.isBox()) return;
  // Odd numbers, at random.
  constexpr std::uint64_t kFactors[] = {0x9e3779b97f4a7c15, 0xbf58476d1ce4e5b9, 0x94d049bb133111eb,
                                        0xd6e8feb86659fd93, 0xa0761d6478bd642f, 0xe7037ed1a0b428db,
                                        0x8ebc6af09c88c6e3, 0x589965cc75374cc3, 0x1d8e4e27c47d124f,
                                        0xeb44accab455d165, 0x2127599bf4325c37, 0x880355f21e6d1965,
                                        0xff51afd7ed558ccd, 0xc4ceb9fe1a85ec53, 0xd2a98b26625eee7b};
  double numbers[std::size(kFactors)] = {};
  const auto& pose = ObjectMembers<S>::pose(object).matrix();
  for (int i = 0; i < 12; ++i) numbers[i] = static_cast<double>(pose(i % 3, i / 3));
  const fcl::CollisionGeometry<S>& shape = *ObjectMembers<S>::shape(object);
  const fcl::NODE_TYPE type = shape.getNodeType();
  if (type == fcl::GEOM_BOX) {
    const auto& side = static_cast<const fcl::Box<S>&>(shape).side;
    for (int i = 0; i < 3; ++i) numbers[12 + i] = static_cast<double>(side[i]);
  } else if (type == fcl::GEOM_CYLINDER) {
    const auto& cylinder = static_cast<const fcl::Cylinder<S>&>(shape);
    numbers[12] = static_cast<double>(cylinder.radius);
    numbers[13] = static_cast<double>(cylinder.lz);
  } else if (!readSize(shape, type, numbers[12], numbers[13])) {
    return;
  }
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < std::size(kFactors); ++i) {
    std::uint64_t bits;
    std::memcpy(&bits, &numbers[i], sizeof(bits));
    // The signs of two numbers, which are their highest bits, must not cancel out.
    sum += (bits ^ bits >> 32) * kFactors[i];
  }
  sum = (sum ^ sum >> 29) * kFactors[0];
  const std::uint64_t bits = std::uint64_t{0x3ff} << 52 | sum >> 12;
  double number;  // from 1 to 2
  std::memcpy(&number, &bits, sizeof(number));
  segment.radius *= number;
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
  const bool may_be_beside = mayBeBeside(ids, count);
  present = 0;
  for (int i = 0; i < count; ++i) {
    prefetchObject<S>(objectAt, static_cast<std::size_t>(i), known);
    const Object* object = objectAt(static_cast<std::size_t>(i));
    const index::BlockMask bit = index::BlockMask{1} << i;
    if (may_be_beside && isBeside(ids[i])) continue;
    if (object != nullptr) present |= bit;
    if (object == nullptr || bounds_ == Bounds::kObjects) continue;
    const fcl::CollisionGeometry<S>* shape = ObjectMembers<S>::shape(*object);
    double radius, length;
    if (shape == nullptr || !readSize(*shape, shape->getNodeType(), radius, length)) {
      if (isRefused(*object)) return false;
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
    if (counts_shapes_) numberBox(*objectAt(static_cast<std::size_t>(i)), segment);
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
    if (isRefused(*object)) fibers::throwInvalidArgument(call_, nameOf(id) + ": " + kIsMeshNow);
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
template void numberBox(const fcl::CollisionObject<float>&, Segment&);
template void numberBox(const fcl::CollisionObject<double>&, Segment&);
template const char* readSegment(const fcl::CollisionObject<float>&, const Frame&, Bounds,
                                 Segment&);
template const char* readSegment(const fcl::CollisionObject<double>&, const Frame&, Bounds,
                                 Segment&);

}  // namespace fcl_fibers::broadphase
