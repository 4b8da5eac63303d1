// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

namespace fcl_fibers::geometry {

/// A vector over any scalar. Eigen's layout would differ between the object files of this folder,
/// which are compiled for several instruction sets.
template <typename T>
struct Vec3 {
  T x, y, z;
};

using Vec3d = Vec3<double>;

constexpr double Vec3d::*kAxes[] = {&Vec3d::x, &Vec3d::y, &Vec3d::z};

template <typename T>
bool operator==(const Vec3<T>& p, const Vec3<T>& q) {
  return p.x == q.x && p.y == q.y && p.z == q.z;
}
template <typename T>
Vec3<T> operator+(const Vec3<T>& p, const Vec3<T>& q) {
  return {p.x + q.x, p.y + q.y, p.z + q.z};
}
template <typename T>
Vec3<T> operator-(const Vec3<T>& p, const Vec3<T>& q) {
  return {p.x - q.x, p.y - q.y, p.z - q.z};
}
template <typename T>
Vec3<T> operator*(const T& s, const Vec3<T>& p) {
  return {s * p.x, s * p.y, s * p.z};
}
template <typename T>
T dot(const Vec3<T>& p, const Vec3<T>& q) {
  return p.x * q.x + p.y * q.y + p.z * q.z;
}
template <typename T>
Vec3<T> cross(const Vec3<T>& p, const Vec3<T>& q) {
  return {p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
}
template <typename T>
T squaredNorm(const Vec3<T>& p) {
  return dot(p, p);
}

inline double norm(const Vec3d& p) { return std::sqrt(squaredNorm(p)); }

inline double norm1(const Vec3d& p) { return std::fabs(p.x) + std::fabs(p.y) + std::fabs(p.z); }

inline double maxNorm(const Vec3d& p) {
  return std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
}

/// The norm, which neither overflows nor vanishes. Standard libraries round std::hypot differently.
inline double safeNorm(const Vec3d& p) {
  const double size = maxNorm(p);
  if (!(size > 0 && std::isfinite(size))) return size;
  return size * norm({p.x / size, p.y / size, p.z / size});
}

inline Vec3d abs(const Vec3d& p) { return {std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)}; }

inline Vec3d min(const Vec3d& p, const Vec3d& q) {
  return {std::min(p.x, q.x), std::min(p.y, q.y), std::min(p.z, q.z)};
}
inline Vec3d max(const Vec3d& p, const Vec3d& q) {
  return {std::max(p.x, q.x), std::max(p.y, q.y), std::max(p.z, q.z)};
}

}  // namespace fcl_fibers::geometry
