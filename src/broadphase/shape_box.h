// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/fiber_manager_options.h>

#include "broadphase/fcl_layout.h"
#include "geometry/affine_map.h"
#include "geometry/vec3.h"
#include "simd/always_inline.h"

namespace fcl_fibers::broadphase {

// The floor of object_reader.h: the boxes of shapes, and the margins that programs add to the boxes
// of objects.

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Two corners of a box. Open sides are at infinity.
struct Corners {
  geometry::Vec3d low, high;

  geometry::Vec3d half() const { return 0.5 * high - 0.5 * low; }
  geometry::Vec3d middle() const { return 0.5 * low + 0.5 * high; }
};

inline bool isBounded(const Corners& box) {
  return std::isfinite(maxNorm(box.low)) && std::isfinite(maxNorm(box.high));
}

inline Corners around(const geometry::Vec3d& middle, const geometry::Vec3d& half) {
  return {middle - half, middle + half};
}

/// FCL's planes reach to max(), or to infinity if they are rotated.
template <typename S>
double openLow(S side) {
  return side < -std::numeric_limits<S>::max() / 4 ? -kInfinity : static_cast<double>(side);
}
template <typename S>
Corners openCorners(const fcl::AABB<S>& box) {
  const auto &low = box.min_, &high = box.max_;
  return {{openLow(low[0]), openLow(low[1]), openLow(low[2])},
          {-openLow(-high[0]), -openLow(-high[1]), -openLow(-high[2])}};
}

template <typename S>
bool isProper(const fcl::AABB<S>& box) {
  return (box.min_.array() <= box.max_.array()).all();
}

/// The boxes of a shape, in the world's unit, computed from its present sizes or vertices.
struct ShapeBox {
  Corners local;        ///< FCL's box, in the axes of the shape
  Corners posed;        ///< in the world's axes, relative to the position
  double ball_squared;  ///< squared radius of FCL's ball around `local`
  double reach;         ///< the largest coordinate that a box was computed from
  bool is_least;        ///< whether `posed` is the least; if not, only `aabb_local` is known

  /// How far the shape may be outside of `posed`, by rounding. The smallest normal number covers
  /// the loss if subnormals are flushed to zero.
  double rounding() const {
    return 16 * std::numeric_limits<double>::epsilon() * reach +
           4 * std::numeric_limits<double>::min();
  }

  /// The boxes of a shape that is symmetric about its position, given by half their sizes.
  FCL_FIBERS_ALWAYS_INLINE static ShapeBox symmetric(const geometry::Vec3d& local_half,
                                                     const geometry::Vec3d& posed_half) {
    const geometry::Vec3d none{0, 0, 0};
    return {around(none, local_half), around(none, posed_half), squaredNorm(local_half),
            maxNorm(posed_half), true};
  }
};

inline bool isBounded(const ShapeBox& shape) { return shape.is_least || isBounded(shape.posed); }

/// Whether FCL takes a pose for more than a translation.
template <typename S>
FCL_FIBERS_ALWAYS_INLINE bool isTurned(const fcl::Transform3<S>& pose) {
  // Eigen's own test is a call. One entry of most rotations tells.
  const auto& rows = pose.matrix();
  constexpr S kNone = Eigen::NumTraits<S>::dummy_precision();
  return std::abs(rows(1, 0)) > kNone || std::abs(rows(2, 1)) > kNone ||
         !pose.linear().isIdentity();
}

/// Half the size of a box, which no translation changes.
struct BoxSize {
  geometry::Vec3d half;
  double rounding;  ///< bound on the error of `half` from rounding the corners
  bool is_open;     ///< a side is infinite, or as far out as FCL's planes reach

  template <typename S>
  FCL_FIBERS_ALWAYS_INLINE explicit BoxSize(const fcl::AABB<S>& box) {
    const geometry::Vec3d low = toVec3(box.min_), high = toVec3(box.max_);
    half = 0.5 * high - 0.5 * low;
    const double farthest = std::max(maxNorm(low), maxNorm(high));
    is_open = farthest > double{std::numeric_limits<S>::max()} / 4;
    // Each corner carries one rounding of its own, and one of the end point from which a program
    // may have made it. The extent of FCL's boxes carries three roundings, and an axis that was
    // made from two end points some more.
    rounding = double{std::numeric_limits<S>::epsilon()} * (1.25 * farthest + 4 * maxNorm(half)) +
               4 * double{std::numeric_limits<S>::denorm_min()};
  }
};

/// Whether a box has a size that FCL gives to this shape, turned or not. Nearly all boxes have.
/// Boxes too small to be squared are left to wideningOf(), and so is FCL's cube in a pose for which
/// FCL does not make it.
template <typename S>
FCL_FIBERS_ALWAYS_INLINE bool isStockSize(const BoxSize& size, const ShapeBox& shape,
                                          const fcl::Transform3<S>& pose) {
  const geometry::Vec3d own = shape.local.half(), &half = size.half;
  if (size.is_open) return false;
  if (maxNorm(half - own) <= size.rounding) return true;
  constexpr double kSmall = 1e-280;
  if (std::fabs(half.x * half.x - shape.ball_squared) > 2 * size.rounding * half.x ||
      std::fabs(half.y - half.x) > size.rounding || std::fabs(half.z - half.x) > size.rounding ||
      !(shape.ball_squared > kSmall)) {
    return false;
  }
  return isTurned(pose);
}

FCL_FIBERS_ALWAYS_INLINE ShapeBox boxOfSides(const geometry::AffineMap& pose,
                                             const geometry::Vec3d& sides) {
  const geometry::Vec3d half = 0.5 * sides, *axes = pose.column;
  return ShapeBox::symmetric(half,
                             half.x * abs(axes[0]) + half.y * abs(axes[1]) + half.z * abs(axes[2]));
}

/// Half the box of a disc of radius 1 in the plane of the x and y axes. Squares of tiny entries
/// lose less than the rounding of the largest coordinate.
FCL_FIBERS_ALWAYS_INLINE geometry::Vec3d discHalf(const geometry::AffineMap& pose) {
  const geometry::Vec3d &x = pose.column[0], &y = pose.column[1];
  return {std::sqrt(x.x * x.x + y.x * y.x), std::sqrt(x.y * x.y + y.y * y.y),
          std::sqrt(x.z * x.z + y.z * y.z)};
}

FCL_FIBERS_ALWAYS_INLINE ShapeBox boxOfCylinder(const geometry::AffineMap& pose, double radius,
                                                double length) {
  const geometry::Vec3d end = (length / 2) * abs(pose.column[2]);
  return ShapeBox::symmetric({radius, radius, length / 2}, end + radius * discHalf(pose));
}

/// FCL's two bounds of a mesh or an octree in its own axes: a box, and a ball around its middle.
struct LocalBounds {
  Corners box{{0, 0, 0}, {0, 0, 0}};
  geometry::Vec3d center{0, 0, 0};
  double radius = 0;  ///< 0 means that there is no ball
};

/// What a program has added to an object's box: on all sides the same, or more on some than on
/// others. If it is uneven, another object has to meet the box as well as the shape.
struct Widening {
  double margin = 0;  ///< the most on any side
  bool is_uneven = false;
  /// If it is uneven: what counts on all sides, wherever the box is.
  double everywhere = 0;

  /// What counts on all sides.
  double onAllSides() const { return is_uneven ? everywhere : margin; }
};

/// Guesses what a program has added to an object's box. docs/contract.md, "Boxes that a program
/// widens", states the rule and why it misses nothing.
/// @param shape  of the object, which is bounded
template <typename S>
Widening wideningOf(const fcl::CollisionObject<S>& object, const ShapeBox& shape);

constexpr const char* kBadRadius =
    "its radius is negative, NaN or infinite; give it a finite radius of 0 or more";
constexpr const char* kBadLength =
    "its length is negative, NaN or infinite; give it a finite length of 0 or more";

inline bool isSize(double x) { return x >= 0 && std::isfinite(x); }

/// Why the size of a capsule, sphere, cylinder or cone is refused; nullptr if it is not.
inline const char* sizeProblem(double radius, double length) {
  return !isSize(radius) ? kBadRadius : !isSize(length) ? kBadLength : nullptr;
}

constexpr const char* kBadSides =
    "a side is negative, NaN or infinite; give it finite sides of 0 or more";

inline bool areSizes(const geometry::Vec3d& v) { return isSize(v.x) && isSize(v.y) && isSize(v.z); }

template <typename S>
FCL_FIBERS_ALWAYS_INLINE bool isBox(const fcl::CollisionObject<S>& object) {
  return ObjectMembers<S>::shape(object)->getNodeType() == fcl::GEOM_BOX;
}
/// @pre isBox(object)
template <typename S>
FCL_FIBERS_ALWAYS_INLINE geometry::Vec3d sidesOf(const fcl::CollisionObject<S>& object) {
  return toVec3(static_cast<const fcl::Box<S>&>(*ObjectMembers<S>::shape(object)).side);
}

/// Reads a box or a cylinder.
/// @param size  as in ReadObject
/// @return nullptr, or why it is refused and the remedy
template <typename S>
FCL_FIBERS_ALWAYS_INLINE const char* readBar(const fcl::CollisionObject<S>& object,
                                             const geometry::AffineMap& pose, geometry::Vec3d& size,
                                             ShapeBox& box) {
  if (isBox(object)) {
    size = sidesOf(object);
    box = boxOfSides(pose, size);
    return areSizes(size) ? nullptr : kBadSides;
  }
  const auto& cylinder = static_cast<const fcl::Cylinder<S>&>(*ObjectMembers<S>::shape(object));
  size = {static_cast<double>(cylinder.radius), static_cast<double>(cylinder.lz), 0};
  box = boxOfCylinder(pose, size.x, size.y);
  return sizeProblem(size.x, size.y);
}

struct ReadObject;

/// Reads the size, the boxes and the kind of an object's shape in the pose that has been read,
/// unless it is a capsule or sphere.
/// @param mesh  the bounds of a mesh that was read, or null for those that FCL has
/// @return nullptr, or why the shape is refused and the remedy
template <typename S>
const char* readShape(const fcl::CollisionObject<S>& object, Bounds bounds, const LocalBounds* mesh,
                      ReadObject& out);

}  // namespace fcl_fibers::broadphase
