// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

namespace fcl_fibers::tools::trade {

/// @file
/// Distances of segments and triangles in more digits than double. The judge shares no code with
/// the library, so they are made here anew.

using Real = long double;
using Vector = std::array<Real, 3>;

inline Vector operator-(const Vector& p, const Vector& q) {
  return {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
}
inline Vector operator+(const Vector& p, const Vector& q) {
  return {p[0] + q[0], p[1] + q[1], p[2] + q[2]};
}
inline Vector operator*(Real s, const Vector& p) { return {s * p[0], s * p[1], s * p[2]}; }
inline Real dot(const Vector& p, const Vector& q) {
  return p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
}
inline Real norm(const Vector& p) { return std::sqrt(dot(p, p)); }
inline Vector cross(const Vector& p, const Vector& q) {
  return {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
}
inline Vector between(const Vector& from, const Vector& to, Real time) {
  return from + time * (to - from);
}

/// The axis of a segment.
struct Axis {
  Vector from, to;
  Real radius;     ///< at `from`
  Real taper = 0;  ///< by how much the radius at `to` is larger

  Real most() const { return taper > 0 ? radius + taper : radius; }  ///< the larger radius
};

/// The closest points of two things.
struct Closest {
  Real distance;
  Vector p, q;
};

/// The least of the distances of ends from axes and of the common perpendicular. None of them is
/// too small, because each is the distance of two points.
Closest closest(const Axis& a, const Axis& b);
/// The least of the distances of ends from the triangle and of the axis from its edges; or 0, where
/// the axis crosses it.
Closest closest(const Axis& axis, const std::array<Vector, 3>& triangle);

/// Where two things are nearest to each other or overlap most: the balls of the least distance.
struct Gap {
  Real gap;  ///< from surface to surface
  Vector p, q;
  Real radius_p, radius_q;
};

/// The balls along two segments of the least distance: |p - q| without the two radii. If neither
/// tapers, they are at the closest points. Otherwise the distance is a convex function of the two
/// places, which is halved to its least value.
Gap gapOf(const Axis& a, const Axis& b);
/// A segment and a triangle, whose points have no radius.
Gap gapOf(const Axis& axis, const std::array<Vector, 3>& triangle);

}  // namespace fcl_fibers::tools::trade
