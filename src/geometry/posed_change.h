// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "geometry/affine_map.h"
#include "geometry/box.h"
#include "geometry/segment.h"
#include "geometry/sphere.h"

namespace fcl_fibers::geometry {

/// Takes volumes through an affine map whose columns are nearly orthogonal and of one length, as a
/// pose has, and rounds outward. The result is a `To`, which is Box or Sphere, whatever the volume.
/// If numbers overflow, it is unbounded.
template <class To>
class PosedChange {
 public:
  /// @param growth  length by which volumes grow, in the frame that the map leads to
  PosedChange(const AffineMap& map, double growth) : growth_(growth) {
    const double shift[3] = {map.shift.x, map.shift.y, map.shift.z};
    double skew = 0;
    const double unit = map.unitScale();
    const Vec3d scaled[3] = {unit * map.column[0], unit * map.column[1], unit * map.column[2]};
    const double squared = squaredNorm(scaled[0]);
    for (int i = 0; i < 3; ++i) {
      const double column[3] = {map.column[i].x, map.column[i].y, map.column[i].z};
      for (int axis = 0; axis < 3; ++axis) {
        column_[i][axis] = column[axis];
        magnitude_[i][axis] = std::fabs(column[axis]);
        across_[axis] += column[axis] * column[axis];
      }
      double row_skew = 0;
      for (int j = 0; j < 3; ++j) {
        row_skew += std::fabs(dot(scaled[i], scaled[j]) / squared - (i == j ? 1 : 0));
      }
      skew = std::max(skew, row_skew);
    }
    for (int axis = 0; axis < 3; ++axis) {
      shift_[axis] = shift[axis];
      // Three products and their sums, and the inverse from which the map may come.
      across_[axis] = std::sqrt(across_[axis]) * (1 + kError);
      most_ += 4 * across_[axis];
      growth_ += kError * std::fabs(shift[axis]);
      most_shift_ += 4 * std::fabs(shift[axis]);
    }
    error_ = kError / 4 * most_;
    most_shift_ += std::fabs(growth_);
    // The singular values lie in between (Gershgorin).
    const double least = std::sqrt(squared * std::max(1 - skew, 0.0)) / unit * (1 - kError);
    least_scale_ = std::isfinite(least) ? least : 0;
    most_scale_ = std::sqrt(squared * (1 + skew)) / unit * (1 + kError);
  }

  /// A lower bound of the length of a unit after the change.
  double scale() const { return least_scale_; }
  double mostScale() const { return most_scale_; }  ///< an upper bound

  FCL_FIBERS_ALWAYS_INLINE To operator()(const Box& box) const {
    double center[3], half[3];
    for (int i = 0; i < 3; ++i) {
      center[i] = 0.5 * double{box.low[i]} + 0.5 * double{box.high[i]};
      half[i] = 0.5 * double{box.high[i]} - 0.5 * double{box.low[i]};
    }
    double extent[4] = {};
    if constexpr (std::is_same_v<To, Box>) {
      for (int axis = 0; axis < 4; ++axis) {
        extent[axis] = magnitude_[0][axis] * half[0] + magnitude_[1][axis] * half[1] +
                       magnitude_[2][axis] * half[2];
      }
    } else {
      extent[0] =
          most_scale_ * std::sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2]);
    }
    return around(center, extent, sumOfMagnitudes(center) + (half[0] + half[1] + half[2]));
  }
  FCL_FIBERS_ALWAYS_INLINE To operator()(const Sphere& sphere) const {
    return aroundBall({sphere.center[0], sphere.center[1], sphere.center[2]},
                      double{sphere.radius});
  }

  /// Around a capsule thickened by `padding`, which is tighter than around its volume.
  FCL_FIBERS_ALWAYS_INLINE To ofCapsule(const Segment& capsule, double padding) const {
    const double r = capsule.radius + padding + endPointError(capsule);
    if constexpr (std::is_same_v<To, Box>) {
      const double a[3] = {capsule.a.x, capsule.a.y, capsule.a.z};
      const double b[3] = {capsule.b.x, capsule.b.y, capsule.b.z};
      double center[3], half[3], extent[4];
      for (int i = 0; i < 3; ++i) {
        center[i] = 0.5 * a[i] + 0.5 * b[i];
        half[i] = 0.5 * b[i] - 0.5 * a[i];
      }
      for (int axis = 0; axis < 4; ++axis) {
        extent[axis] = std::fabs(column_[0][axis] * half[0] + column_[1][axis] * half[1] +
                                 column_[2][axis] * half[2]) +
                       across_[axis] * r;
      }
      return around(center, extent, norm1(capsule.a) + norm1(capsule.b) + r);
    } else {
      const Ball ball = Ball::around(capsule, padding);
      const double center[3] = {ball.center.x, ball.center.y, ball.center.z};
      return aroundBall(center, ball.radius);
    }
  }

 private:
  static constexpr double kError = 64 * std::numeric_limits<double>::epsilon();

  FCL_FIBERS_ALWAYS_INLINE To aroundBall(const double (&center)[3], double radius) const {
    double extent[4];
    for (int axis = 0; axis < 4; ++axis) {
      extent[axis] = (std::is_same_v<To, Box> ? across_[axis] : most_scale_) * radius;
    }
    return around(center, extent, sumOfMagnitudes(center) + radius);
  }

  static double sumOfMagnitudes(const double (&v)[3]) {
    return std::fabs(v[0]) + std::fabs(v[1]) + std::fabs(v[2]);
  }

  /// @param extent  of the result along each axis; for a sphere the first is its radius
  /// @param reach   bounds the coordinates of the volume; infinite or NaN if one of them is
  FCL_FIBERS_ALWAYS_INLINE To around(const double (&center)[3], const double (&extent)[4],
                                     double reach) const {
    if (!(most_ * reach + most_shift_ < std::numeric_limits<double>::infinity())) {
      return To::unbounded();
    }
    const double padding = growth_ + error_ * reach;
    // Loops over four numbers are one operation each, where the machine has it.
    double moved[4];
    for (int axis = 0; axis < 4; ++axis) {
      moved[axis] = column_[0][axis] * center[0] + column_[1][axis] * center[1] +
                    column_[2][axis] * center[2] + shift_[axis];
    }
    if constexpr (std::is_same_v<To, Box>) {
      float low[4], minus_high[4];
      for (int axis = 0; axis < 4; ++axis) {
        const double half = extent[axis] + padding;
        low[axis] = roundedDown(moved[axis] - half);
        minus_high[axis] = roundedDown(-moved[axis] - half);
      }
      return {{low[0], low[1], low[2]}, {-minus_high[0], -minus_high[1], -minus_high[2]}};
    } else {
      return Sphere::around(
          Ball{{moved[0], moved[1], moved[2]}, (extent[0] + 2 * padding) * (1 + kError)});
    }
  }

  // The fourth numbers are 0.
  double column_[3][4] = {}, magnitude_[3][4] = {};
  double shift_[4] = {};
  double across_[4] = {};  ///< how far a unit ball reaches along each axis afterwards
  double growth_;          ///< on each axis, with the rounding of the shift
  double error_ = 0;       ///< of the result, for each unit of the reach
  // These bound all sums on the way, so nothing overflows if they are finite.
  double most_ = 0;        ///< of products with the map, for each unit of the reach
  double most_shift_ = 0;  ///< of the shift and the growth
  double least_scale_ = 0, most_scale_ = 0;
};

}  // namespace fcl_fibers::geometry
