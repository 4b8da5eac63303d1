// SPDX-License-Identifier: BSD-3-Clause
#include "fibers/capsule_contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "geometry/directions.h"
#include "geometry/segment_distance.h"
#include "geometry/way_apart.h"

namespace fcl_fibers::fibers {

using geometry::Segment;
using geometry::Vec3d;

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
