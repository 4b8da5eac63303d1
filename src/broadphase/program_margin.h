// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl/narrowphase/collision_object.h>

#include "geometry/vec3.h"

namespace fcl_fibers::broadphase {

// What a program has added to FCL's boxes. docs/contract.md, "Boxes that a program widens", states
// the rule and why it misses nothing.

/// Half the size of a box, which no translation changes.
struct BoxSize {
  geometry::Vec3d half;
  double rounding;  ///< bound on the error of `half` from rounding the corners
  bool is_open;     ///< a side is infinite, or as far out as FCL's planes reach

  template <typename S>
  explicit BoxSize(const fcl::AABB<S>& box);
};

/// What a program has added to the box of a capsule or sphere. A margin that is equal on all sides
/// counts as the object's. If it is uneven, the box counts in place of the shape.
struct Widening {
  double margin = 0;
  bool is_uneven = false;
};

template <typename S>
Widening wideningOf(const fcl::CollisionObject<S>& object, double radius, double length);

/// The margin of any other shape whose box is of another pose.
/// @param posed  half the size of the shape's own box in the object's pose
template <typename S>
double marginOfOldBox(const fcl::CollisionObject<S>& object, const BoxSize& size,
                      const geometry::Vec3d& posed);

}  // namespace fcl_fibers::broadphase
