// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <limits>

#include <fcl/narrowphase/collision_object.h>

#include "geometry/always_inline.h"
#include "geometry/vec3.h"

namespace fcl_fibers::broadphase {

/// Half the size of an object's box, which no translation changes, and how far rounding may have
/// moved it.
struct BoxSize {
  geometry::Vec3d half;
  double rounding;

  template <typename S>
  FCL_FIBERS_ALWAYS_INLINE explicit BoxSize(const fcl::AABB<S>& box) {
    const geometry::Vec3d low{double{box.min_[0]}, double{box.min_[1]}, double{box.min_[2]}};
    const geometry::Vec3d high{double{box.max_[0]}, double{box.max_[1]}, double{box.max_[2]}};
    half = 0.5 * high - 0.5 * low;
    // Each corner was rounded, and so was what FCL added to the position. Neither half the size nor
    // FCL's own rounding of it exceeds the corners.
    rounding =
        4 * double{std::numeric_limits<S>::epsilon()} * std::max(maxNorm(low), maxNorm(high)) +
        4 * double{std::numeric_limits<S>::denorm_min()};
  }

  /// Whether nothing but rounding parts the two.
  FCL_FIBERS_ALWAYS_INLINE bool isAbout(const geometry::Vec3d& other) const {
    return maxNorm(half - other) <= rounding;
  }
};

/// What a program has added to an object's box: a margin to all sides, which counts as the
/// object's, or more to some sides than to others, so that the box counts in place of the shape.
struct Widening {
  double margin = 0;
  bool is_uneven = false;
};

/// docs/contract.md, "Boxes that a program widens", has the rule and why it misses nothing.
///
/// @param unrotated  half the size of FCL's box of the shape where it is not rotated
/// @param tight      half the size of the least box of the shape in the object's pose
template <typename S>
Widening wideningOf(const fcl::CollisionObject<S>& object, const BoxSize& size,
                    const geometry::Vec3d& unrotated, const geometry::Vec3d& tight);

}  // namespace fcl_fibers::broadphase
