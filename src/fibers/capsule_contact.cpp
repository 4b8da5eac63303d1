// SPDX-License-Identifier: BSD-3-Clause
#include "fibers/capsule_contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "geometry/directions.h"
#include "geometry/segment_distance.h"

namespace fcl_fibers::fibers {

using geometry::Segment;
using geometry::Vec3d;

namespace {

/// By how much all of q lies beyond all of p along a unit vector.
double gapAlong(const Vec3d& n, const Segment& p, const Segment& q) {
  const double p_end =
      std::max(dot(n, p.a - q.a) + p.radiusAtA(), dot(n, p.b - q.a) + p.radiusAtB());
  return std::min(-q.radiusAtA(), dot(n, q.b - q.a) - q.radiusAtB()) - p_end;
}

/// The direction along which q is taken off p if their axes intersect. It is across both axes, or
/// of cones, across the lines along which their surfaces face each other: it leans towards the
/// thinner end of each so that all of the axis is as far from the surface.
Vec3d wayApart(const Segment& p, const Segment& q, const geometry::ClosestPoints& closest) {
  const Vec3d u = p.b - p.a, v = q.b - q.a;
  const Vec3d across = perpendicularTo(u, v, closest.apart);
  if (!p.isTapered() && !q.isTapered()) return across;
  const auto lean = [](const Vec3d& along, double slope) {
    const double squared = squaredNorm(along);
    return squared > 0 ? (slope / squared) * along : Vec3d{0, 0, 0};
  };
  const Vec3d by_p = lean(u, -p.taper), by_q = lean(v, q.taper);
  const double share = squaredNorm(u) > 0 ? dot(u, v) / squaredNorm(u) : 0;
  const Vec3d by_both = by_p + lean(v - share * u, q.taper - dot(by_p, v));
  Vec3d best = across;
  double most = gapAlong(across, p, q);
  for (const Vec3d& leaning : {by_p, by_q, by_both}) {
    const double rest = 1 - squaredNorm(leaning);
    if (!(rest > 0)) continue;
    const Vec3d n = leaning + std::sqrt(rest) * across;
    const double gap = gapAlong(n, p, q);
    if (gap <= most) continue;
    best = n;
    most = gap;
  }
  return best;
}

}  // namespace

const char* contactProblem(const Segment& capsule) {
  constexpr double kLargest = 0x1p1000;
  if (!(capsule.radiusAtA() >= 0 && capsule.radiusAtB() >= 0))
    return "its radius is negative or NaN; set a radius of 0 or more";
  // NaN fails each comparison.
  const bool is_in_range = capsule.radius <= kLargest && std::fabs(capsule.a.x) <= kLargest &&
                           std::fabs(capsule.a.y) <= kLargest &&
                           std::fabs(capsule.a.z) <= kLargest &&
                           std::fabs(capsule.b.x) <= kLargest &&
                           std::fabs(capsule.b.y) <= kLargest && std::fabs(capsule.b.z) <= kLargest;
  return is_in_range
             ? nullptr
             : "a coordinate or the radius is NaN or beyond 2^1000; give smaller, finite numbers";
}

Contact contactOf(const Segment& p, const Segment& q, const Vec3d& origin, FiberSegment a,
                  FiberSegment b) {
  const geometry::ClosestPoints closest = closestPoints(p, q);
  const Vec3d u = p.b - p.a, v = q.b - q.a;
  // This bounds the rounding of end points, which were rounded in world coordinates before.
  const double rounding =
      16 * std::numeric_limits<double>::epsilon() *
      (maxNorm(origin) + std::max({maxNorm(p.a), maxNorm(p.b), maxNorm(q.a), maxNorm(q.b)}));
  const bool axes_intersect = maxNorm(closest.apart) <= rounding;
  const Vec3d normal = axes_intersect ? wayApart(p, q, closest) : normalized(closest.apart);
  const auto toArray = [](const Vec3d& x) { return std::array{x.x, x.y, x.z}; };

  const double p_radius = p.radiusAt(closest.s), q_radius = q.radiusAt(closest.t);
  const double axes =
      maxNorm(closest.apart) > 0 ? dot(normalized(closest.apart), closest.apart) : 0;
  Contact contact;
  contact.s = closest.s;
  contact.t = closest.t;
  contact.distance = axes - p_radius - q_radius;
  contact.normal = toArray(normal);
  contact.a = a;
  contact.b = b;
  contact.point_a = toArray(p.a + closest.s * u + p_radius * normal + origin);
  contact.point_b = toArray(q.a + closest.t * v - q_radius * normal + origin);
  return contact;
}

}  // namespace fcl_fibers::fibers
