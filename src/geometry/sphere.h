// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>

#include "geometry/rounding.h"
#include "geometry/segment.h"
#include "simd/always_inline.h"

namespace fcl_fibers::geometry {

/// A ball in double, for the algorithms of enclosing spheres.
struct Ball {
  Vec3d center;
  double radius;

  friend bool operator==(const Ball& p, const Ball& q) {
    return p.center == q.center && p.radius == q.radius;
  }

  static Ball unbounded() { return {{0, 0, 0}, std::numeric_limits<double>::infinity()}; }

  /// The least ball around a capsule thickened by padding.
  static Ball around(const Segment& segment, double padding) {
    if (segment.isBox() && !isBounded(segment)) return unbounded();
    constexpr double kRoundUp = 1 + 16 * std::numeric_limits<double>::epsilon();
    const Vec3d center = midpoint(segment);
    // The distances are from the rounded centre, so both ends are inside whatever the rounding.
    const double half = std::max(norm(segment.a - center), norm(segment.b - center));
    return {center, (half + segment.thickness() + padding + endPointError(segment)) * kRoundUp};
  }
};

/// A closed ball in float. A negative radius makes the other sphere of a pair smaller.
struct Sphere {
  float center[3];
  float radius;

  template <int N>
  class Pack;

  /// Around everything.
  static Sphere unbounded() { return {{0, 0, 0}, std::numeric_limits<float>::infinity()}; }

  static Sphere around(const Ball& ball) {
    const float x = nearestFloat(ball.center.x);
    const float y = nearestFloat(ball.center.y);
    const float z = nearestFloat(ball.center.z);
    const Vec3d moved{ball.center.x - double{x}, ball.center.y - double{y},
                      ball.center.z - double{z}};
    return {{x, y, z}, roundedUp(ball.radius + norm(moved))};
  }
  static Sphere around(const Segment& segment, double padding) {
    return around(Ball::around(segment, padding));
  }

  FCL_FIBERS_ALWAYS_INLINE float size() const { return radius; }
};

/// N spheres:  x[0..N) y[0..N) z[0..N) radius[0..N)
template <int N>
class alignas(4 * N) Sphere::Pack {
 public:
  Pack() {
    for (int lane = 0; lane < N; ++lane) clear(lane);
  }

  void set(int lane, const Sphere& sphere) {
    for (int axis = 0; axis < 3; ++axis) center_[axis][lane] = sphere.center[axis];
    radius_[lane] = sphere.radius;
  }
  void clear(int lane) {
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    set(lane, {{kNone, kNone, kNone}, kNone});
  }
  FCL_FIBERS_ALWAYS_INLINE Sphere get(int lane) const {
    return {{center_[0][lane], center_[1][lane], center_[2][lane]}, radius_[lane]};
  }

  const float* center(int axis) const { return center_[axis]; }
  const float* radius() const { return radius_; }

 private:
  float center_[3][N];
  float radius_[N];
};

}  // namespace fcl_fibers::geometry
