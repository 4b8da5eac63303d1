// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/object_segments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/sphere.h>

#include "broadphase/object_members.h"
#include "broadphase/object_source.h"
#include "broadphase/program_margin.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::Frame;
using geometry::Segment;
using geometry::Vec3d;

bool allFinite(const Vec3d& v) {
  // Zero times infinity or NaN is NaN.
  return 0 * v.x + 0 * v.y + 0 * v.z == 0;
}

/// Rotations drift if they are multiplied for long without normalisation. This much, in sum, is
/// harmless, because end points are computed from the matrix as it is.
template <typename S>
constexpr double kRotationTolerance = std::is_same_v<S, float> ? 5e-3 : 5e-6;

template <typename S>
const char* poseProblem(const fcl::Transform3<S>& pose) {
  const auto& matrix = pose.matrix();
  const Vec3d x = toVec3(matrix.col(0)), y = toVec3(matrix.col(1)), z = toVec3(matrix.col(2));
  const Vec3d t = toVec3(matrix.col(3));
  // Two columns must be perpendicular unit vectors, and the third their cross product. The sum is
  // written out, because packed loads from an array just written would wait for it.
  const Vec3d off = cross(x, y) - z;
  const double deviation = (std::fabs(dot(x, x) - 1) + std::fabs(dot(y, y) - 1)) +
                           (std::fabs(dot(x, y)) + std::fabs(off.x)) +
                           (std::fabs(off.y) + std::fabs(off.z));
  // NaN and infinity fail the comparison.
  if (deviation <= kRotationTolerance<S> && allFinite(t)) return nullptr;
  if (!allFinite(x) || !allFinite(y) || !allFinite(z) || !allFinite(t)) {
    return "its pose is NaN or infinite; give it a finite pose";
  }
  return "its rotation is not orthonormal or is a reflection; give it a proper rotation";
}

constexpr const char* kBadRadius =
    "its radius is negative, NaN or infinite; give it a finite radius of 0 or more";
constexpr const char* kBadLength =
    "its length is negative, NaN or infinite; give it a finite length of 0 or more";

const char* rangeProblem(const Segment& segment) {
  return isBounded(segment) && std::isfinite(segment.radius)
             ? nullptr
             : "its coordinates overflow; bring the scene nearer to the origin or change its unit";
}

/// Two corners in the index's frame. Open sides are at infinity.
struct Corners {
  Vec3d low, high;
};

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// FCL's planes reach to max(), or to infinity if they are rotated.
template <typename S>
double openLow(S side) {
  return side < -std::numeric_limits<S>::max() / 4 ? -kInfinity : static_cast<double>(side);
}
template <typename S>
double openHigh(S side) {
  return side > std::numeric_limits<S>::max() / 4 ? kInfinity : static_cast<double>(side);
}

/// A box far out may overflow, but its low side must not become +infinity, nor its high side
/// -infinity.
double finiteLow(double x) { return std::min(x, std::numeric_limits<double>::max()); }
double finiteHigh(double x) { return std::max(x, -std::numeric_limits<double>::max()); }

template <typename S>
bool isProper(const fcl::AABB<S>& box) {
  return (box.min_.array() <= box.max_.array()).all();
}

template <typename S>
Corners ownCorners(const fcl::AABB<S>& box, const Frame& frame) {
  const Vec3d low = frame.fromWorld(toVec3(box.min_)), high = frame.fromWorld(toVec3(box.max_));
  const auto lowest = [](S side, double local) {
    return openLow(side) == -kInfinity ? -kInfinity : finiteLow(local);
  };
  const auto highest = [](S side, double local) {
    return openHigh(side) == kInfinity ? kInfinity : finiteHigh(local);
  };
  return {
      {lowest(box.min_[0], low.x), lowest(box.min_[1], low.y), lowest(box.min_[2], low.z)},
      {highest(box.max_[0], high.x), highest(box.max_[1], high.y), highest(box.max_[2], high.z)}};
}

/// An open side does not spread to other axes in poses that FCL treats as a translation.
template <typename S>
double product(double entry, double side) {
  const bool is_none = std::fabs(entry) <= double{Eigen::NumTraits<S>::dummy_precision()};
  return is_none && std::isinf(side) ? 0 : entry * side;
}

/// The intersection of the boxes around FCL's two bounds of a posed shape, which are its local box
/// and the ball around that.
/// @param half  is set to half its size, in the world's unit
template <typename S>
Corners posedCorners(const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& pose,
                     const Frame& frame, Vec3d& half) {
  constexpr double kEps = std::numeric_limits<double>::epsilon();
  const Vec3d position = frame.fromWorld(toVec3(pose.matrix().col(3)));
  const double at[] = {position.x, position.y, position.z};
  // Radius 0 means that there is no ball.
  const auto radius = static_cast<double>(shape.aabb_radius);
  const double ball =
      radius > 0 ? radius * (1 + 8 * double{std::numeric_limits<S>::epsilon()}) : kInfinity;
  double low[3], high[3], size[3];
  for (int row = 0; row < 3; ++row) {
    double from = 0, to = 0, center = 0, largest = 0;
    for (int column = 0; column < 3; ++column) {
      const auto entry = static_cast<double>(pose.matrix()(row, column));
      const double p = product<S>(entry, openLow(shape.aabb_local.min_[column]));
      const double q = product<S>(entry, openHigh(shape.aabb_local.max_[column]));
      from += std::min(p, q);
      to += std::max(p, q);
      center += entry * static_cast<double>(shape.aabb_center[column]);
      for (const double x : {p, q})
        largest = std::isfinite(x) ? std::max(largest, std::fabs(x)) : largest;
    }
    const double rounding = 16 * kEps * largest;
    from = std::max(from, std::isfinite(center) ? center - ball : -kInfinity) - rounding;
    to = std::min(to, std::isfinite(center) ? center + ball : kInfinity) + rounding;
    size[row] = (to - from) / 2;
    low[row] = from == -kInfinity ? from : finiteLow(at[row] + frame.scale * from);
    high[row] = to == kInfinity ? to : finiteHigh(at[row] + frame.scale * to);
  }
  half = {size[0], size[1], size[2]};
  return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

/// How far the finite corners of a box may have been rounded.
template <typename S>
double roundingOf(const fcl::AABB<S>& box) {
  double farthest = 0;
  for (const auto& corner : {box.min_, box.max_}) {
    for (int axis = 0; axis < 3; ++axis) {
      const double x = std::fabs(static_cast<double>(corner[axis]));
      if (x <= double{std::numeric_limits<S>::max()} / 4) farthest = std::max(farthest, x);
    }
  }
  return 4 * double{std::numeric_limits<S>::epsilon()} * farthest;
}

double finiteNorm(const Vec3d& v) {
  double largest = 0;
  for (const double x : {v.x, v.y, v.z}) {
    if (std::isfinite(x)) largest = std::max(largest, std::fabs(x));
  }
  return largest;
}

bool contains(const Corners& outer, const Corners& inner, double rounding) {
  const auto reaches = [rounding](const Vec3d& low, const Vec3d& high) {
    return low.x <= high.x + rounding && low.y <= high.y + rounding && low.z <= high.z + rounding;
  };
  return reaches(outer.low, inner.low) && reaches(inner.high, outer.high);
}

bool haveOneMiddle(const Corners& p, const Corners& q, double rounding) {
  return maxNorm((p.low - q.low) + (p.high - q.high)) <= 2 * rounding;
}

/// Reads an object as a box: any under Bounds::kObjects, else all except capsules and spheres.
template <typename S>
const char* readBox(const fcl::CollisionObject<S>& object, const Frame& frame, Bounds bounds,
                    Segment& segment) {
  const fcl::CollisionGeometry<S>& shape = *ObjectMembers<S>::shape(object);
  const fcl::AABB<S>& box = ObjectMembers<S>::box(object);
  const bool has_own = bounds != Bounds::kShapes && isProper(box);
  const bool has_shape = bounds != Bounds::kObjects && isProper(shape.aabb_local);
  if (!has_own && !has_shape) {
    return "its box is empty or NaN; give it a non-empty shape and call computeAABB()";
  }
  if (!has_shape) {
    const Corners own = ownCorners(box, frame);
    segment = Segment::box(own.low, own.high);
    return nullptr;
  }
  Vec3d half;
  Corners corners = posedCorners(shape, ObjectMembers<S>::pose(object), frame, half);
  if (has_own) {
    const BoxSize size(box);
    const Corners own = ownCorners(box, frame);
    // FCL treats small rotations as the identity.
    const double tilt = 4 * double{Eigen::NumTraits<S>::dummy_precision()} * finiteNorm(half);
    const double rounding = frame.scale * (roundingOf(box) + tilt);
    const bool contains_shape = contains(own, corners, rounding);
    // A box with the same middle is of this pose too. The program has made it smaller somewhere.
    const bool is_of_this_pose = contains_shape || haveOneMiddle(own, corners, rounding);
    if (!contains_shape) {
      const double margin = frame.scale * marginOfOldBox(object, size, half);
      corners.low = corners.low - Vec3d{margin, margin, margin};
      corners.high = corners.high + Vec3d{margin, margin, margin};
    }
    if (is_of_this_pose) {
      corners = {min(own.low, corners.low), max(own.high, corners.high)};
    }
  }
  segment = Segment::box(corners.low, corners.high);
  return nullptr;
}

/// Adds to a capsule or sphere the margin that the program has added to its box.
template <typename S>
const char* addWidening(const fcl::CollisionObject<S>& object, const Frame& frame, double radius,
                        double length, Segment& segment) {
  const Widening added = wideningOf(object, radius, length);
  segment.radius += frame.scale * added.margin;
  if (added.is_uneven) {
    const Corners own = ownCorners(ObjectMembers<S>::box(object), frame);
    const double r = segment.radius + endPointError(segment);
    segment = Segment::box(min(own.low, min(segment.a, segment.b) - Vec3d{r, r, r}),
                           max(own.high, max(segment.a, segment.b) + Vec3d{r, r, r}));
    return nullptr;
  }
  return rangeProblem(segment);
}

/// Whether a box has the size that FCL gives to a capsule, rotated or not, as nearly all have.
/// Boxes too small to be squared, and rotated capsules without length, are left to wideningOf().
template <typename S>
FCL_FIBERS_ALWAYS_INLINE bool isStockBox(const fcl::AABB<S>& box, const fcl::Transform3<S>& pose,
                                         double radius, double length) {
  const Vec3d size = toVec3(box.max_) - toVec3(box.min_);
  const Vec3d t = toVec3(pose.matrix().col(3));
  const double thickness = 2 * radius, end = length + thickness;
  // Bound on the rounding of the sides of a box in this pose.
  const double slack = double{std::numeric_limits<S>::epsilon()} * (1.25 * maxNorm(t) + 5 * end);
  if (length > 0 && std::fabs(size.x - size.y) <= slack && std::fabs(size.x - size.z) <= slack) {
    // The side of the rotated box is the diagonal of the unrotated one.
    constexpr double kSmall = 1e-280;
    const double squared = 2 * thickness * thickness + end * end;
    return squared > kSmall && std::fabs(size.x * size.x - squared) <= 2 * slack * size.x;
  }
  return std::fabs(size.x - thickness) <= slack && std::fabs(size.y - thickness) <= slack &&
         std::fabs(size.z - end) <= slack;
}

}  // namespace

template <typename S>
const char* readSegment(const fcl::CollisionObject<S>& object, const Frame& frame, Bounds bounds,
                        Segment& segment) {
  const fcl::CollisionGeometry<S>* shape = ObjectMembers<S>::shape(object);
  if (shape == nullptr) return "it has no geometry; construct it with a shape";
  const fcl::Transform3<S>& pose = ObjectMembers<S>::pose(object);
  if (const char* problem = poseProblem(pose)) return problem;

  if (bounds == Bounds::kObjects) return readBox(object, frame, bounds, segment);

  double radius, length = 0;
  switch (shape->getNodeType()) {
    case fcl::GEOM_CAPSULE: {
      const auto& capsule = static_cast<const fcl::Capsule<S>&>(*shape);
      radius = static_cast<double>(capsule.radius);
      length = static_cast<double>(capsule.lz);
      break;
    }
    case fcl::GEOM_SPHERE:
      radius = static_cast<double>(static_cast<const fcl::Sphere<S>&>(*shape).radius);
      break;
    default:
      return readBox(object, frame, bounds, segment);
  }
  if (!(radius >= 0 && std::isfinite(radius))) return kBadRadius;
  if (!(length >= 0 && std::isfinite(length))) return kBadLength;
  const Vec3d center = frame.fromWorld(toVec3(pose.matrix().col(3)));
  // Halving the length instead of the scale could lose the last bit of a subnormal length.
  const Vec3d half = (frame.scale / 2 * length) * toVec3(pose.matrix().col(2));
  segment = {center - half, center + half, frame.scale * radius};
  if (const char* problem = rangeProblem(segment)) return problem;
  if (bounds == Bounds::kShapes ||
      isStockBox(ObjectMembers<S>::box(object), pose, radius, length)) {
    return nullptr;
  }
  return addWidening(object, frame, radius, length, segment);
}

/// This loop takes half of an update's time. It is in this file so that readSegment() can be
/// inlined.
template <typename S>
bool ObjectSource<S>::read(const index::SegmentId* ids, int count, int ahead, const Frame& frame,
                           index::SegmentBlock& out, index::BlockMask& present) const {
  const auto objectAt = [&](std::size_t i) { return objects_[static_cast<std::size_t>(ids[i])]; };
  const auto known = static_cast<std::size_t>(count + ahead);
  present = 0;
  for (int i = 0; i < count; ++i) {
    prefetchObject<S>(objectAt, static_cast<std::size_t>(i), known);
    const Object* object = objectAt(static_cast<std::size_t>(i));
    if (object == nullptr) continue;
    Segment segment;
    if (readSegment(*object, frame, bounds_, segment) != nullptr) return false;
    out.set(i, segment);
    present |= index::BlockMask{1} << i;
  }
  return true;
}

template <typename S>
void ObjectSource<S>::refuse(index::SegmentId id, const Frame& frame) const {
  if (const Object* object = objects_[static_cast<std::size_t>(id)]) {
    const auto empty = std::count(objects_.begin(), objects_.begin() + id, nullptr);
    readObject(call_, *object, frame, bounds_, [&] {
      return "object " + std::to_string(id - empty) + " in order of registration";
    });
  }
  // If the object is readable now, another thread has changed it meanwhile.
  fibers::throwInvalidArgument(call_,
                               "an object has changed during the call; change objects after it");
}

template class ObjectSource<float>;
template class ObjectSource<double>;
template const char* readSegment(const fcl::CollisionObject<float>&, const Frame&, Bounds,
                                 Segment&);
template const char* readSegment(const fcl::CollisionObject<double>&, const Frame&, Bounds,
                                 Segment&);

}  // namespace fcl_fibers::broadphase
