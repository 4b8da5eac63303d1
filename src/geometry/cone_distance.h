// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <limits>

#include "geometry/double_double.h"
#include "geometry/least_distance.h"
#include "geometry/segment.h"

namespace fcl_fibers::geometry {

/// The arc parameter of the ball of a cone nearest to a point. It lies beyond the foot of the point
/// towards the larger balls, where the way to the point is across the cone's surface.
/// @param point  relative to the first end of the cone's axis
template <typename T>
T bestOnCone(const Vec3<T>& point, const Vec3<T>& axis, const T& taper) {
  const T squared = squaredNorm(axis), rest = squared - taper * taper;
  if (!(rest > T(0))) return taper > T(0) ? T(1) : T(0);
  const T foot = dot(point, axis) / squared;
  const Vec3<T> away = point - foot * axis;
  return clampedToUnit(foot + taper * squareRoot(squaredNorm(away) / (squared * rest)));
}

/// The distance of the balls at s and t, which is at least the distance of the cones, and the gap
/// along the line through the balls, which is at most that.
template <typename T>
struct CertifiedOfCones {
  T s, t;
  T distance;
  T gap;
};

/// The convex function f(s, t) = |w + s u - t v| - (radii + s taper_p + t taper_q) over the unit
/// square. Its minimum is the distance of two rounded cones, whose balls have these radii together.
/// It is negative if they overlap. No axis is longer than a taper if one ball holds all others.
template <typename T>
class ConeDistance {
 public:
  ConeDistance(const Segment& p, const Segment& q)
      : ConeDistance(difference<T>(p.a, q.a), difference<T>(p.b, p.a), difference<T>(q.b, q.a),
                     T(p.radiusAtA()) + T(q.radiusAtA()), T(p.taper), T(q.taper)) {}
  ConeDistance(const Vec3<T>& w, const Vec3<T>& u, const Vec3<T>& v, const T& radii,
               const T& taper_p, const T& taper_q)
      : w_(w), u_(u), v_(v), radii_(radii), taper_p_(taper_p), taper_q_(taper_q) {}

  /// Calls consider(candidate) for places of which one is closest, up to rounding: where the slopes
  /// vanish, and the best place on each side of the square.
  template <class Consider>
  void forCandidates(Consider&& consider) const {
    const T s = whereSlopesVanish();
    const T t = bestOfSecond(s);
    consider(at(bestOfFirst(t), t));
    for (const T& end : {T(0), T(1)}) {
      consider(at(end, bestOfSecond(end)));
      consider(at(bestOfFirst(end), end));
    }
  }
  /// The candidate of the least distance.
  CertifiedOfCones<T> atNearest() const {
    CertifiedOfCones<T> best{};
    bool is_first = true;
    forCandidates([&](const CertifiedOfCones<T>& candidate) {
      if (is_first || candidate.distance < best.distance) best = candidate;
      is_first = false;
    });
    return best;
  }

  /// The vector from the second cone's point to the first's.
  Vec3<T> between(const T& s, const T& t) const { return w_ + s * u_ - t * v_; }

  /// Let n be the unit vector between the points of f's minimum. The slopes vanish if n.u is the
  /// first taper and n.v minus the second one. That gives n in the plane of u and v; and across the
  /// plane the points have the distance of the lines. As in
  /// SquaredDistance::atClosestByProjection() the part of u across v takes the place of the
  /// determinant.
  /// @return s, or 0 if the slopes vanish nowhere
  T whereSlopesVanish() const {
    const T vv = squaredNorm(v_), share = quotientOrZero(dot(u_, v_), vv);
    const Vec3<T> across = u_ - share * v_;
    const T squared = squaredNorm(across);
    if (!(squared > T(0))) return T(0);
    const T n_across = taper_p_ + share * taper_q_;  // times the length of `across`
    const T in_plane = quotientOrZero(taper_q_ * taper_q_, vv) + n_across * n_across / squared;
    if (!(in_plane < T(1))) return T(0);
    const Vec3<T> apart = w_ - quotientOrZero(dot(v_, w_), vv) * v_;
    const T w_across = dot(apart, across);
    const Vec3<T> of_lines = apart - (w_across / squared) * across;
    const T distance = squareRoot(squaredNorm(of_lines) / (T(1) - in_plane));
    return clampedToUnit((distance * n_across - w_across) / squared);
  }

  CertifiedOfCones<T> at(const T& s, const T& t) const {
    const Vec3<T> r = between(s, t);
    const T length = squareRoot(squaredNorm(r));
    // Where the axes meet, the vector 0 takes the place of the unit vector.
    const T scale = length > T(0) ? T(1) / length : T(0);
    const auto slope = [&](const Vec3<T>& along, const T& taper) {
      const T x = scale * dot(along, r) - taper;
      return x < T(0) ? x : T(0);
    };
    return {s, t, length - (radii_ + s * taper_p_ + t * taper_q_),
            scale * dot(w_, r) - radii_ + slope(u_, taper_p_) + slope(T(-1) * v_, taper_q_)};
  }

 private:
  T bestOfSecond(const T& s) const { return bestOnCone(w_ + s * u_, v_, taper_q_); }
  T bestOfFirst(const T& t) const { return bestOnCone(t * v_ - w_, u_, taper_p_); }

  Vec3<T> w_, u_, v_;
  T radii_, taper_p_, taper_q_;
};

}  // namespace fcl_fibers::geometry
