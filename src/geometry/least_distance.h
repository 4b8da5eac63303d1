// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "geometry/vec3.h"

namespace fcl_fibers::geometry {

// What the searches for the least distance of two shapes share. T is double or DoubleDouble.

template <typename T>
Vec3<T> difference(const Vec3d& p, const Vec3d& q) {
  return Vec3<T>{p.x, p.y, p.z} - Vec3<T>{q.x, q.y, q.z};
}
template <typename T>
T clampedToUnit(const T& x) {
  return x < T(0) ? T(0) : x > T(1) ? T(1) : x;
}
/// x / y, or 0 if y is not positive.
template <typename T>
T quotientOrZero(const T& x, const T& y) {
  return y > T(0) ? x / y : T(0);
}

/// The power of two that brings shapes to a size of about one.
/// @param size     of their differences
/// @param largest  magnitude of their coordinates, which must not overflow either
inline double scaleForSize(double size, double largest) {
  return std::ldexp(1.0, size < 1 ? std::min(-std::ilogb(size), 1000) : -std::ilogb(largest));
}

}  // namespace fcl_fibers::geometry
