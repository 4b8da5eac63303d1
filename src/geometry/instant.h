// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "geometry/double_double.h"
#include "geometry/squared_distance.h"
#include "geometry/squared_triangle_distance.h"

namespace fcl_fibers::geometry {

/// The axis of a capsule and the hull of K corners at one time.
template <int K>
struct Instant {
  Vec3d axis[2], corner[K];
  double radii;  ///< the sum of the radii
  double reach;  ///< how near the two have to be
};

/// The differences that distances depend on: the axis is from w to w + u, and the corners are 0 and
/// v, relative to the first of them. So a place far from the origin costs no precision.
template <int K>
struct Pose {
  Vec3d w, u, v[K - 1];

  explicit Pose(const Instant<K>& i) : w(i.axis[0] - i.corner[0]), u(i.axis[1] - i.axis[0]) {
    for (int k = 1; k < K; ++k) v[k - 1] = i.corner[k] - i.corner[0];
  }
  Vec3d corner(int k) const { return k == 0 ? Vec3d{0, 0, 0} : v[k - 1]; }
  /// The sum of the 1-norms, by which rounding is bounded.
  double size() const {
    double sum = norm1(w) + norm1(u);
    for (const Vec3d& x : v) sum += norm1(x);
    return sum;
  }
  friend Pose operator*(double f, Pose p) {
    p.w = f * p.w, p.u = f * p.u;
    for (Vec3d& x : p.v) x = f * x;
    return p;
  }
  friend Pose operator+(Pose p, const Pose& q) {
    p.w = p.w + q.w, p.u = p.u + q.u;
    for (int k = 0; k < K - 1; ++k) p.v[k] = p.v[k] + q.v[k];
    return p;
  }
};

template <int K>
double sizeOf(const Instant<K>& start, const Instant<K>& end) {
  return std::max(Pose<K>(start).size(), Pose<K>(end).size()) + std::max(start.radii, end.radii);
}

template <int K>
struct Closest {
  double s, weight[K];
  Vec3d apart;  ///< from the point of the hull to that of the axis
};
template <typename T>
Vec3<T> as(const Vec3d& p) {
  return {T(p.x), T(p.y), T(p.z)};
}
inline Vec3d rounded(const Vec3d& p) { return p; }
inline Vec3d rounded(const Vec3<DoubleDouble>& p) {
  return {double(p.x), double(p.y), double(p.z)};
}

template <typename T>
Closest<2> closestOf(const Pose<2>& pose) {
  const SquaredDistance<T> distance(as<T>(pose.w), as<T>(pose.u), as<T>(pose.v[0]));
  const Certified<T> best = distance.atClosestByProjection();
  const auto t = double(best.t);
  return {double(best.s), {1 - t, t}, rounded(distance.between(best.s, best.t))};
}
template <typename T>
Closest<3> closestOf(const Pose<3>& pose) {
  const SquaredTriangleDistance<T> distance(as<T>(pose.w), as<T>(pose.u), as<T>(pose.v[0]),
                                            as<T>(pose.v[1]));
  const CertifiedOnTriangle<T> best = distance.atNearest();
  const auto x = double(best.x), y = double(best.y);
  return {double(best.s), {std::max(1 - x - y, 0.0), x, y}, rounded(distance.between(best))};
}

}  // namespace fcl_fibers::geometry
