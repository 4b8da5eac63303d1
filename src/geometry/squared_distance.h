// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/least_distance.h"
#include "geometry/segment.h"

namespace fcl_fibers::geometry {

/// The squared distance at s and t, and how much it may exceed the least one.
template <typename T>
struct Certified {
  T s, t;
  T squared;
  T gap;
};

/// The convex function f(s, t) = |w + s u - t v|^2 over the unit square, whose minimum is the
/// squared distance of the segments.
template <typename T>
class SquaredDistance {
 public:
  SquaredDistance(const Segment& p, const Segment& q)
      : SquaredDistance(difference<T>(p.a, q.a), difference<T>(p.b, p.a), difference<T>(q.b, q.a)) {
  }
  SquaredDistance(const Vec3<T>& w, const Vec3<T>& u, const Vec3<T>& v)
      : w_(w),
        u_(u),
        v_(v),
        uu_(squaredNorm(u_)),
        vv_(squaredNorm(v_)),
        uv_(dot(u_, v_)),
        uw_(dot(u_, w_)),
        vw_(dot(v_, w_)) {}

  /// Ericson, Real-Time Collision Detection, 2005, section 5.1.9.
  Certified<T> atClosest() const {
    const T determinant = uu_ * vv_ - uv_ * uv_;
    const T s = determinant > T(0) ? clampedToUnit((uv_ * vw_ - uw_ * vv_) / determinant) : T(0);
    return atClosestOfSecond(s);
  }

  /// This uses the part of the first segment across the second in place of the determinant, which
  /// loses twice as many digits at small angles. An error of s then moves the points along two
  /// lines that are so nearly parallel that their distance hardly changes.
  Certified<T> atClosestByProjection() const {
    const T share = quotientOrZero(uv_, vv_);
    const Vec3<T> across = u_ - share * v_;
    const Vec3<T> apart = w_ - quotientOrZero(vw_, vv_) * v_;
    return atClosestOfSecond(
        clampedToUnit(quotientOrZero(T(-1) * dot(apart, across), squaredNorm(across))));
  }

  /// The best of atClosest() and the four end points. If the segments are nearly parallel, the
  /// determinant is noise, and f is so flat that one of the ends is as good as the minimum.
  Certified<T> atBestCandidate() const {
    Certified<T> best = atClosest();
    for (const Certified<T>& candidate :
         {atEndOfFirst(T(0)), atEndOfFirst(T(1)), atEndOfSecond(T(0)), atEndOfSecond(T(1))}) {
      if (candidate.squared - candidate.gap > best.squared - best.gap) best = candidate;
    }
    return best;
  }

  /// The vector from the second segment's point to the first's.
  Vec3<T> between(const T& s, const T& t) const { return w_ + s * u_ - t * v_; }

 private:
  Certified<T> atClosestOfSecond(const T& s) const {
    const T t = quotientOrZero(uv_ * s + vw_, vv_);
    if (t < T(0)) return atEndOfSecond(T(0));
    if (t > T(1)) return atEndOfSecond(T(1));
    return at(s, t);
  }
  Certified<T> atEndOfFirst(const T& s) const {
    return at(s, clampedToUnit(quotientOrZero(uv_ * s + vw_, vv_)));
  }
  Certified<T> atEndOfSecond(const T& t) const {
    return at(clampedToUnit(quotientOrZero(uv_ * t - uw_, uu_)), t);
  }

  /// A convex function lies above its tangent plane, so f in the square is less than f(s, t) by at
  /// most the fall of the plane (Frank and Wolfe, 1956). This holds whatever arithmetic found s and
  /// t.
  Certified<T> at(const T& s, const T& t) const {
    const Vec3<T> r = between(s, t);
    const T slope_s = T(2) * dot(u_, r);
    const T slope_t = T(-2) * dot(v_, r);
    return {s, t, squaredNorm(r), fall(slope_s, s) + fall(slope_t, t)};
  }
  static T fall(const T& slope, const T& x) {
    return slope > T(0) ? slope * x : -(slope * (T(1) - x));
  }

  Vec3<T> w_, u_, v_;
  T uu_, vv_, uv_, uw_, vw_;
};

}  // namespace fcl_fibers::geometry
