// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/rigid_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fcl_fibers::geometry {
namespace {

/// The rotation about `axis` by the angle of its length: that of a unit quaternion.
AffineMap rotationBy(const Vec3d& axis) {
  const double angle = norm(axis);
  const double half = angle < 1e-8 ? 0.5 : std::sin(angle / 2) / angle;
  const double w = std::cos(angle / 2), x = half * axis.x, y = half * axis.y, z = half * axis.z;
  AffineMap turn;
  turn.column[0] = {1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)};
  turn.column[1] = {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)};
  turn.column[2] = {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)};
  return turn;
}

/// Makes columns orthonormal that nearly are.
void orthonormalize(AffineMap& map) {
  Vec3d *const x = &map.column[0], *const y = &map.column[1], *const z = &map.column[2];
  *x = (1 / norm(*x)) * *x;
  *y = *y - dot(*x, *y) * *x;
  *y = (1 / norm(*y)) * *y;
  *z = cross(*x, *y);
}

}  // namespace

AffineMap rigidFit(const std::vector<MovedPoint>& points) {
  AffineMap fit;
  if (points.empty()) return fit;
  const double count = static_cast<double>(points.size());
  Vec3d before{0, 0, 0}, after{0, 0, 0};
  for (const MovedPoint& p : points) {
    before = before + (1 / count) * p.before;
    after = after + (1 / count) * p.after;
  }
  // Newton's method for the rotation. The motion of a step is small, so a few turns are enough.
  constexpr int kMostTurns = 8;
  for (int i = 0; i < kMostTurns; ++i) {
    // The moments of inertia, and what turns the points to where they are.
    double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
    Vec3d torque{0, 0, 0};
    for (const MovedPoint& p : points) {
      const Vec3d q = fit.linear(p.before - before);
      torque = torque + cross(q, p.after - after);
      xx += q.y * q.y + q.z * q.z;
      yy += q.x * q.x + q.z * q.z;
      zz += q.x * q.x + q.y * q.y;
      xy -= q.x * q.y;
      xz -= q.x * q.z;
      yz -= q.y * q.z;
    }
    // About a line on which all points are, any turn fits.
    const double least = 1e-9 * (xx + yy + zz);
    xx += least;
    yy += least;
    zz += least;
    const Vec3d rows[3] = {{yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy},
                           {xz * yz - xy * zz, xx * zz - xz * xz, xy * xz - xx * yz},
                           {xy * yz - xz * yy, xy * xz - xx * yz, xx * yy - xy * xy}};
    const double determinant = xx * rows[0].x + xy * rows[0].y + xz * rows[0].z;
    const Vec3d turn =
        (1 / determinant) * Vec3d{dot(rows[0], torque), dot(rows[1], torque), dot(rows[2], torque)};
    const double angle = norm(turn);
    if (!(angle <= 1)) break;  // also if numbers are not finite or all points are in one place
    const AffineMap step = rotationBy(turn);
    for (Vec3d& column : fit.column) column = step.linear(column);
    if (angle < 1e-12) break;
  }
  orthonormalize(fit);
  fit.shift = after - fit.linear(before);
  if (!std::isfinite(maxNorm(fit.shift))) fit.shift = {0, 0, 0};
  return fit;
}

}  // namespace fcl_fibers::geometry
