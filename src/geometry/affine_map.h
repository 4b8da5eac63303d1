// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "geometry/vec3.h"

namespace fcl_fibers::geometry {

/// Whether three columns are nearly those of a rotation R: no entry of R^T R - I is larger than
/// `tolerance`, and R does not reflect. NaN and infinity fail.
inline bool isRotation(const Vec3d& x, const Vec3d& y, const Vec3d& z, double tolerance) {
  const auto off = [tolerance](double product, double value) {
    return static_cast<int>(!(std::fabs(product - value) <= tolerance));
  };
  // One branch for all, because nearly all matrices are rotations.
  const int wrong = (off(dot(x, x), 1) | off(dot(y, y), 1) | off(dot(z, z), 1)) |
                    (off(dot(x, y), 0) | off(dot(x, z), 0) | off(dot(y, z), 0));
  return wrong == 0 && dot(cross(x, y), z) > 0;
}

/// A linear map and a shift: p becomes x column[0] + y column[1] + z column[2] + shift.
struct AffineMap {
  Vec3d column[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  Vec3d shift{0, 0, 0};

  Vec3d linear(const Vec3d& p) const { return p.x * column[0] + p.y * column[1] + p.z * column[2]; }
  Vec3d operator()(const Vec3d& p) const { return linear(p) + shift; }

  /// Whether it does more than scale by a positive factor and shift.
  bool turns() const {
    const double scale = column[0].x;
    return !(scale > 0 && column[0] == Vec3d{scale, 0, 0} && column[1] == Vec3d{0, scale, 0} &&
             column[2] == Vec3d{0, 0, scale});
  }

  /// A power of two that brings the columns near one, so that their products neither overflow nor
  /// vanish where the sizes of two frames differ much.
  double unitScale() const {
    int exponent = 0;
    std::frexp(maxNorm(column[0]), &exponent);
    return std::ldexp(1.0, std::min(-exponent, 1000));
  }

  /// Of the map as it is, by cofactors.
  /// @pre the columns are nearly orthogonal and of one length that is not zero
  AffineMap inverse() const {
    const double unit = unitScale();
    const Vec3d x = unit * column[0], y = unit * column[1], z = unit * column[2];
    const Vec3d rows[3] = {cross(y, z), cross(z, x), cross(x, y)};
    const double factor = unit / dot(x, rows[0]);
    AffineMap inverse;
    inverse.column[0] = factor * Vec3d{rows[0].x, rows[1].x, rows[2].x};
    inverse.column[1] = factor * Vec3d{rows[0].y, rows[1].y, rows[2].y};
    inverse.column[2] = factor * Vec3d{rows[0].z, rows[1].z, rows[2].z};
    inverse.shift = -1.0 * inverse.linear(shift);
    return inverse;
  }
};

inline bool operator==(const AffineMap& p, const AffineMap& q) {
  return p.column[0] == q.column[0] && p.column[1] == q.column[1] && p.column[2] == q.column[2] &&
         p.shift == q.shift;
}

}  // namespace fcl_fibers::geometry
