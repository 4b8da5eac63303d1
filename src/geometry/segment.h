// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include "geometry/always_inline.h"
#include "geometry/vec3.h"

namespace fcl_fibers::geometry {

/// One capsule: all points within `radius` of the line from a to b, in the scene's frame. Something
/// known by its box alone is kept as the diagonal of that box; box and enclosing sphere of the
/// diagonal, taken with radius 0, are those of the box.
struct Segment {
  Vec3d a, b;
  double radius;  ///< negative: a and b are the low and high corner of a box

  static Segment box(const Vec3d& low, const Vec3d& high) { return {low, high, -1}; }
  bool isBox() const { return radius < 0; }
  double thickness() const { return radius < 0 ? 0 : radius; }

  friend bool operator==(const Segment& p, const Segment& q) {
    return p.a == q.a && p.b == q.b && p.radius == q.radius;
  }
};

/// How far the stored end points may lie from those that pose and length define. In the scene's
/// frame a = t - h and b = t + h, where t and h carry one and one and a half roundings of their own
/// size, which is at most that of a and b; the sum adds half of one. That makes three halves of
/// eps and sqrt(3) for three axes; the constant 8 leaves room for the rotation's own rounding.
FCL_FIBERS_ALWAYS_INLINE double endPointError(const Segment& segment) {
  constexpr double kEps = std::numeric_limits<double>::epsilon();
  return 8 * kEps * std::max(maxNorm(segment.a), maxNorm(segment.b));
}

/// Whether all coordinates are finite: true of a capsule that was read, not of a box open to a
/// side.
inline bool isBounded(const Segment& segment) {
  // Infinities and NaN survive addition; coordinates so large that their sum does not fit are as
  // bad.
  return std::isfinite(segment.a.x + segment.a.y + segment.a.z + segment.b.x + segment.b.y +
                       segment.b.z);
}

inline Vec3d midpoint(const Segment& segment) { return 0.5 * segment.a + 0.5 * segment.b; }

}  // namespace fcl_fibers::geometry
