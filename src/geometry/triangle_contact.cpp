// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/triangle_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/directions.h"

namespace fcl_fibers::geometry {

Vec3d unitNormal(const Triangle& triangle, const Vec3d& otherwise) {
  constexpr double kOnOneLine = 0x1p-40;
  const Vec3d normal =
      productDirection(triangle.b - triangle.a, triangle.c - triangle.a, kOnOneLine);
  return maxNorm(normal) == 0 ? otherwise : normal;
}

TriangleContact triangleContact(const Segment& capsule, const Triangle& triangle,
                                const ClosestOnTriangle& closest, const Vec3d& origin) {
  // This bounds the rounding of points, which were rounded in world coordinates before.
  const double rounding =
      16 * std::numeric_limits<double>::epsilon() *
      (maxNorm(origin) + std::max({maxNorm(capsule.a), maxNorm(capsule.b), maxNorm(triangle.a),
                                   maxNorm(triangle.b), maxNorm(triangle.c)}));
  const bool crosses = maxNorm(closest.apart) <= rounding;
  if (capsule.isTapered() && !crosses &&
      safeNorm(closest.apart) <= std::fabs(capsule.taper) + 64 * rounding) {
    // Where the axis of a cone crosses the triangle, one of its larger balls may be nearer, or the
    // search has ended at a ball beside it that is as near.
    const ClosestOnTriangle of_axis = closestPoints({capsule.a, capsule.b, 0}, triangle);
    if (maxNorm(of_axis.apart) <= rounding) {
      return triangleContact(capsule, triangle, of_axis, origin);
    }
  }
  const double radius = capsule.radiusAt(closest.s);
  Vec3d normal;
  double axis_distance = 0;
  if (crosses) {
    const Vec3d edge = triangle.b - triangle.a;
    normal =
        unitNormal(triangle, perpendicularTo(capsule.b - capsule.a,
                                             maxNorm(edge) > 0 ? edge : triangle.c - triangle.a,
                                             closest.apart));
    const double a = dot(normal, capsule.a - triangle.a), b = dot(normal, capsule.b - triangle.a);
    // By how much each end is thinner than the ball that crosses, which is 0 for capsules.
    const double less_a = radius - capsule.radiusAtA(), less_b = radius - capsule.radiusAtB();
    const double above = std::max({0.0, a - less_a, b - less_b});
    const double below = std::max({0.0, -a - less_a, -b - less_b});
    if (below <= above) normal = -1.0 * normal;
    axis_distance = -std::min(above, below);
  } else {
    normal = normalized(closest.apart);
    axis_distance = dot(normal, closest.apart);
  }
  const auto& weight = closest.weight;
  return {closest.s,
          {weight[0], weight[1], weight[2]},
          axis_distance - radius,
          capsule.a + closest.s * (capsule.b - capsule.a) + radius * normal + origin,
          triangle.a + weight[1] * (triangle.b - triangle.a) +
              weight[2] * (triangle.c - triangle.a) + origin,
          normal,
          crosses};
}

}  // namespace fcl_fibers::geometry
