// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <limits>

#include <fcl/narrowphase/collision_object.h>

#include "broadphase/object_members.h"
#include "broadphase/shape_box.h"
#include "geometry/vec3.h"
#include "simd/always_inline.h"

namespace fcl_fibers::broadphase {

// Margins that a program has added to FCL's boxes. docs/contract.md, "Boxes that a program widens",
// states the rule and why it misses nothing.

/// Half the size of a box, which no translation changes.
struct BoxSize {
  geometry::Vec3d half;
  double rounding;  ///< bound on the error of `half` from rounding the corners
  bool is_open;     ///< a side is infinite, or as far out as FCL's planes reach

  template <typename S>
  explicit BoxSize(const fcl::AABB<S>& box) {
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

/// What a program has added to an object's box: on all sides the same, or more on some than on
/// others. If it is uneven, another object has to meet the box as well as the shape.
struct Widening {
  double margin = 0;  ///< the most on any side
  bool is_uneven = false;
  /// If it is uneven: what counts on all sides, wherever the box is.
  double everywhere = 0;
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
  return !pose.linear().isIdentity();
}

/// @param shape  a bounded shape
template <typename S>
Widening wideningOf(const fcl::CollisionObject<S>& object, const BoxSize& size,
                    const ShapeBox& shape);

/// The same for a capsule, or for a sphere, whose length is 0.
template <typename S>
Widening wideningOf(const fcl::CollisionObject<S>& object, double radius, double length);

}  // namespace fcl_fibers::broadphase
