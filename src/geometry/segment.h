// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <limits>

#include "geometry/vec3.h"
#include "simd/always_inline.h"

namespace fcl_fibers::geometry {

/// One capsule: all points within `radius` of the line from a to b, in the frame of the index. Or a
/// rounded cone: the hull of two balls around a and b, of which the larger one has that radius, so
/// that the capsule is around it. If only the box of an object is known, the segment is the
/// diagonal of that box: with radius 0 the diagonal has the same box and enclosing sphere.
struct Segment {
  Vec3d a, b;
  /// Negative: a and b are the low and high corner of a box. Then two numbers differ if the boxes
  /// are known to be around different shapes. If a box is around a capsule, it is at most -2.
  double radius;
  double taper = 0;  ///< by how much the radius grows from a to b

  static Segment cone(const Vec3d& a, const Vec3d& b, double at_a, double at_b) {
    return {a, b, std::max(at_a, at_b), at_b - at_a};
  }
  bool isTapered() const { return taper != 0; }
  /// The radii at the ends. They carry two roundings of `radius`.
  ///@{
  double radiusAtA() const { return radius - std::max(taper, 0.0); }
  double radiusAtB() const { return radius + std::min(taper, 0.0); }
  ///@}
  double radiusAt(double s) const { return radiusAtA() + s * taper; }

  static Segment box(const Vec3d& low, const Vec3d& high) { return {low, high, -1}; }
  /// A box that is open to all sides.
  static Segment everywhere() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    return box({-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity});
  }
  bool isBox() const { return radius < 0; }
  /// Whether it is neither a capsule nor a box around one. If only boxes count, it may be either.
  bool isOtherBox() const { return radius < 0 && radius > -2; }
  double thickness() const { return radius < 0 ? 0 : radius; }

  friend bool operator==(const Segment& p, const Segment& q) {
    return p.a == q.a && p.b == q.b && p.radius == q.radius && p.taper == q.taper;
  }
};

/// The largest finite coordinate of a box that is unbounded on a side. It stays out of the loops
/// over capsules, which never call it.
[[gnu::noinline, gnu::cold]] inline double largestFinite(const Segment& segment) {
  double largest = 0;
  for (const Vec3d* corner : {&segment.a, &segment.b}) {
    for (const double x : {corner->x, corner->y, corner->z}) {
      if (std::isfinite(x)) largest = std::max(largest, std::fabs(x));
    }
  }
  return largest;
}

/// Bounds how far the stored end points lie from those that pose and length define. In the frame of
/// the index a = t - h and b = t + h. Here t carries one rounding of its own size and h one and a
/// half; each is at most the size of a and b. The sum adds half a rounding. That makes three halves
/// of eps, times sqrt(3) for three axes; the constant 8 leaves room for the rotation's own
/// rounding.
constexpr double endPointError(double largest) {
  return 8 * std::numeric_limits<double>::epsilon() * largest;
}
FCL_FIBERS_ALWAYS_INLINE double endPointError(const Segment& segment) {
  const double largest = std::max(maxNorm(segment.a), maxNorm(segment.b));
  const bool is_open = segment.isBox() && largest > std::numeric_limits<double>::max();
  return endPointError(is_open ? largestFinite(segment) : largest);
}

/// Whether all coordinates are finite. They are in every capsule, but a box may be unbounded on a
/// side.
inline bool isBounded(const Segment& segment) {
  // Infinities and NaN survive addition. Coordinates whose sum overflows count as unbounded too.
  return std::isfinite(segment.a.x + segment.a.y + segment.a.z + segment.b.x + segment.b.y +
                       segment.b.z);
}

inline bool isFinite(const Segment& segment) {
  return isBounded(segment) && std::isfinite(segment.radius);
}

/// The box of a segment, larger by a length on all sides.
inline Segment boxAround(const Segment& segment, double larger) {
  const double r = segment.thickness() + larger;
  return Segment::box(min(segment.a, segment.b) - Vec3d{r, r, r},
                      max(segment.a, segment.b) + Vec3d{r, r, r});
}

inline Segment scaled(const Segment& s, double scale) {
  return {scale * s.a, scale * s.b, scale * s.radius, scale * s.taper};
}

inline Vec3d midpoint(const Segment& segment) { return 0.5 * segment.a + 0.5 * segment.b; }

}  // namespace fcl_fibers::geometry
