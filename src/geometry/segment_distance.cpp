// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/segment_distance.h"

#include <algorithm>

#include "geometry/double_double.h"
#include "geometry/least_distance.h"

namespace fcl_fibers::geometry {
namespace {

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
      : w_(difference<T>(p.a, q.a)),
        u_(difference<T>(p.b, p.a)),
        v_(difference<T>(q.b, q.a)),
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

/// The sum of the 1-norms of w, u and v, by which rounding is bounded.
double sizeOf(const Segment& p, const Segment& q) {
  return norm1(p.a - q.a) + norm1(p.b - p.a) + norm1(q.b - q.a);
}

/// Bounds the rounding of `squared - gap` in double for a pair of size m. The vector r carries an
/// error of 3 eps m, its square 9 eps m^2, and each slope 13 eps m^2.
double roundingFor(double m) { return 64 * std::numeric_limits<double>::epsilon() * m * m; }

/// Whether products of four lengths of this size neither overflow nor vanish.
bool isWellScaled(double m) { return m > 0x1p-200 && m < 0x1p200; }

double scaleFor(const Segment& p, const Segment& q, double m) {
  return scaleForSize(m, std::max({maxNorm(p.a), maxNorm(p.b), maxNorm(q.a), maxNorm(q.b)}));
}

Segment scaled(const Segment& s, double scale) { return {scale * s.a, scale * s.b, s.radius}; }

/// Whether all of p lies more than `reach` beyond all of q along the line through their midpoints,
/// which takes no division and settles most pairs that are apart.
bool isApartAlongMidpoints(const Segment& p, const Segment& q, double rounding, double reach) {
  const Vec3d twice = (p.a - q.a) + (p.b - q.b);
  const double squared = squaredNorm(twice);
  const double apart =
      squared - std::fabs(dot(p.b - p.a, twice)) - std::fabs(dot(q.b - q.a, twice)) - 4 * rounding;
  return apart > 0 && apart * apart > 4 * reach * reach * squared * (1 + 0x1p-40);
}

bool wellScaledAxesWithin(const Segment& p, const Segment& q, double m, double reach) {
  if (isApartAlongMidpoints(p, q, roundingFor(m), reach)) return false;
  const double reach_squared = reach * reach;
  const Certified<double> rough = SquaredDistance<double>(p, q).atClosest();
  if (rough.squared <= reach_squared) return true;
  const double rounding = roundingFor(m);
  if (rough.squared - rough.gap - rounding > reach_squared) return false;

  // The pair is near the boundary, or nearly parallel. DoubleDouble rounds to 2^-104, double to
  // 2^-52.
  const Certified<DoubleDouble> fine = SquaredDistance<DoubleDouble>(p, q).atBestCandidate();
  return fine.squared - fine.gap <=
         DoubleDouble(reach) * DoubleDouble(reach) + DoubleDouble(0x1p-52 * rounding);
}

ClosestPoints wellScaledClosestPoints(const Segment& p, const Segment& q, double m) {
  const SquaredDistance<double> rough(p, q);
  const Certified<double> best = rough.atClosestByProjection();
  // Closer points need more digits, or rounding would show in the direction.
  constexpr double kNear = 0x1p-20;
  if (best.squared > kNear * kNear * m * m) {
    return {best.s, best.t, -1.0 * rough.between(best.s, best.t)};
  }
  const SquaredDistance<DoubleDouble> fine(p, q);
  const Certified<DoubleDouble> finest = fine.atBestCandidate();
  const Vec3<DoubleDouble> r = fine.between(finest.s, finest.t);
  return {double(finest.s), double(finest.t), {-double(r.x), -double(r.y), -double(r.z)}};
}

}  // namespace

bool axesWithin(const Segment& p, const Segment& q, double reach) {
  const double m = sizeOf(p, q);
  if (isWellScaled(m)) return wellScaledAxesWithin(p, q, m, reach);
  if (m == 0) return true;  // both segments are one point
  if (!std::isfinite(m)) return true;
  const double scale = scaleFor(p, q, m);
  // The scaled reach must not overflow either.
  return axesWithin(scaled(p, scale), scaled(q, scale), std::min(scale * reach, 0x1p200));
}

ClosestPoints closestPoints(const Segment& p, const Segment& q) {
  const double m = sizeOf(p, q);
  if (isWellScaled(m)) return wellScaledClosestPoints(p, q, m);
  if (m == 0) return {0, 0, {0, 0, 0}};
  const double scale = scaleFor(p, q, m);
  ClosestPoints closest = closestPoints(scaled(p, scale), scaled(q, scale));
  closest.apart = (1 / scale) * closest.apart;
  return closest;
}

}  // namespace fcl_fibers::geometry
