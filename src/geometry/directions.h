// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "geometry/vec3.h"

namespace fcl_fibers::geometry {

/// The direction of v with a length near one; zero stays zero.
inline Vec3d scaledToOne(const Vec3d& v) {
  const double largest = maxNorm(v);
  if (largest == 0) return v;
  const int exponent = std::ilogb(largest);
  // Two steps are needed because 2^1074 is not a double.
  const double half = std::ldexp(1.0, -exponent / 2);
  return std::ldexp(1.0, -exponent - -exponent / 2) * (half * v);
}

/// @pre v is not zero
inline Vec3d normalized(const Vec3d& v) {
  const double squared = squaredNorm(v);
  if (squared > 0x1p-900 && squared < 0x1p900) return (1 / std::sqrt(squared)) * v;
  const Vec3d direction = scaledToOne(v);
  return (1 / norm(direction)) * direction;
}

/// A unit vector perpendicular to v: the cross product of v and the axis that is farthest from it.
inline Vec3d perpendicularTo(const Vec3d& v) {
  const double x = std::fabs(v.x), y = std::fabs(v.y), z = std::fabs(v.z);
  const Vec3d axis = x <= y && x <= z ? Vec3d{1, 0, 0} : y <= z ? Vec3d{0, 1, 0} : Vec3d{0, 0, 1};
  return normalized(cross(v, axis));
}

/// The direction of the vector product u x v, or zero if its sine is at most `parallel`.
inline Vec3d productDirection(const Vec3d& along_u, const Vec3d& along_v, double parallel) {
  const Vec3d u = scaledToOne(along_u), v = scaledToOne(along_v);
  if (maxNorm(u) == 0) return u;
  // A cross product with v itself would lean along u, by rounding divided by the angle.
  const Vec3d across = v - (dot(u, v) / squaredNorm(u)) * u;
  return maxNorm(across) <= parallel ? Vec3d{0, 0, 0} : normalized(cross(u, across));
}

/// A unit vector perpendicular to both, on the side of `apart`.
inline Vec3d perpendicularTo(const Vec3d& u, const Vec3d& v, const Vec3d& apart) {
  if (maxNorm(u) == 0) return maxNorm(v) == 0 ? Vec3d{0, 0, 1} : perpendicularTo(scaledToOne(v));
  constexpr double kParallel = 0x1p-40;
  const Vec3d normal = productDirection(u, v, kParallel);
  if (maxNorm(normal) == 0) return perpendicularTo(scaledToOne(u));
  return dot(normal, apart) < 0 ? -1.0 * normal : normal;
}

}  // namespace fcl_fibers::geometry
