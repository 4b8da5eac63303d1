// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/segment_distance.h"

namespace fcl_fibers::geometry {
namespace {

/// The direction of v with a length near one; zero stays zero.
Vec3d scaledToOne(const Vec3d& v) {
  const double largest = maxNorm(v);
  if (largest == 0) return v;
  const int exponent = std::ilogb(largest);
  // Two steps are needed because 2^1074 is not a double.
  const double half = std::ldexp(1.0, -exponent / 2);
  return std::ldexp(1.0, -exponent - -exponent / 2) * (half * v);
}

/// @pre v is not zero
Vec3d normalized(const Vec3d& v) {
  const double squared = squaredNorm(v);
  if (squared > 0x1p-900 && squared < 0x1p900) return (1 / std::sqrt(squared)) * v;
  const Vec3d direction = scaledToOne(v);
  return (1 / norm(direction)) * direction;
}

Vec3d cross(const Vec3d& p, const Vec3d& q) {
  return {p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
}

/// A unit vector perpendicular to v: the cross product of v and the axis that is farthest from it.
Vec3d perpendicularTo(const Vec3d& v) {
  const double x = std::fabs(v.x), y = std::fabs(v.y), z = std::fabs(v.z);
  const Vec3d axis = x <= y && x <= z ? Vec3d{1, 0, 0} : y <= z ? Vec3d{0, 1, 0} : Vec3d{0, 0, 1};
  return normalized(cross(v, axis));
}

/// A unit vector perpendicular to both, on the side of `apart`.
Vec3d perpendicularTo(const Vec3d& along_p, const Vec3d& along_q, const Vec3d& apart) {
  const Vec3d u = scaledToOne(along_p), v = scaledToOne(along_q);
  if (maxNorm(u) == 0) return maxNorm(v) == 0 ? Vec3d{0, 0, 1} : perpendicularTo(v);
  // A cross product with v itself would lean along u, by rounding divided by the angle.
  const Vec3d across = v - (dot(u, v) / squaredNorm(u)) * u;
  constexpr double kParallel = 0x1p-40;
  if (maxNorm(across) <= kParallel) return perpendicularTo(u);
  const Vec3d normal = normalized(cross(u, across));
  return dot(normal, apart) < 0 ? -1.0 * normal : normal;
}

}  // namespace

const char* contactProblem(const Segment& capsule) {
  constexpr double kLargest = 0x1p1000;
  if (!(capsule.radius >= 0)) return "its radius is negative or NaN; set a radius of 0 or more";
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

CapsuleContact capsuleContact(const Segment& p, const Segment& q, const Vec3d& origin) {
  const ClosestPoints closest = closestPoints(p, q);
  const Vec3d u = p.b - p.a, v = q.b - q.a;
  // This bounds the rounding of end points, which were rounded in world coordinates before.
  const double rounding =
      16 * std::numeric_limits<double>::epsilon() *
      (maxNorm(origin) + std::max({maxNorm(p.a), maxNorm(p.b), maxNorm(q.a), maxNorm(q.b)}));
  const bool axes_intersect = maxNorm(closest.apart) <= rounding;
  const Vec3d normal =
      axes_intersect ? perpendicularTo(u, v, closest.apart) : normalized(closest.apart);

  const double axes =
      maxNorm(closest.apart) > 0 ? dot(normalized(closest.apart), closest.apart) : 0;
  return {closest.s,
          closest.t,
          axes - p.radius - q.radius,
          p.a + closest.s * u + p.radius * normal + origin,
          q.a + closest.t * v - q.radius * normal + origin,
          normal};
}

}  // namespace fcl_fibers::geometry
