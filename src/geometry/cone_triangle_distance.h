// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>

#include "geometry/cone_distance.h"
#include "geometry/triangle.h"

namespace fcl_fibers::geometry {

/// The distance of the ball at s from the point a + x (b - a) + y (c - a) of the triangle, which is
/// at least the distance of cone and triangle, and the gap along the line through that point and
/// the center of the ball, which is at most that.
template <typename T>
struct CertifiedOfCone {
  T s, x, y;
  T length;  ///< of the vector between the point and the center
  T distance;
  T gap;
};

/// The convex function f(s, x, y) = |w + s u - x v1 - y v2| - (radius + s taper) over the unit
/// interval and the triangle x, y >= 0, x + y <= 1. Its minimum is the distance of a rounded cone
/// and a triangle. It is negative if they overlap.
template <typename T>
class ConeTriangleDistance {
 public:
  ConeTriangleDistance(const Segment& p, const Triangle& t)
      : w_(difference<T>(p.a, t.a)),
        u_(difference<T>(p.b, p.a)),
        v1_(difference<T>(t.b, t.a)),
        v2_(difference<T>(t.c, t.a)),
        normal_(cross(v1_, v2_)),
        radius_(p.radiusAtA()),
        taper_(p.taper) {}

  /// Calls consider(candidate) for places of which one is closest, up to rounding: the ball nearest
  /// to each edge, and the ball nearest to the plane of the triangle. If the latter is not above
  /// the inside of the triangle, an edge is nearest, because f is convex.
  template <class Consider>
  void forCandidates(Consider&& consider) const {
    const Vec3<T> none{T(0), T(0), T(0)};
    consider(onEdge(none, v1_, [](const T& t) { return std::array<T, 2>{t, T(0)}; }));
    consider(onEdge(none, v2_, [](const T& t) { return std::array<T, 2>{T(0), t}; }));
    consider(onEdge(v1_, v2_ - v1_, [](const T& t) { return std::array<T, 2>{T(1) - t, t}; }));
    consider(above(nearestToPlane()));
  }
  /// The candidate of the least cost(candidate).
  template <class Cost>
  CertifiedOfCone<T> bestBy(Cost&& cost) const {
    CertifiedOfCone<T> best{};
    bool is_first = true;
    forCandidates([&](const CertifiedOfCone<T>& candidate) {
      if (is_first || cost(candidate) < cost(best)) best = candidate;
      is_first = false;
    });
    return best;
  }

  /// The vector from the triangle's point to the axis's.
  Vec3<T> between(const CertifiedOfCone<T>& c) const {
    return w_ + c.s * u_ - c.x * v1_ - c.y * v2_;
  }

 private:
  /// The edge from `start` along v is a cone of radius 0, so the slope along it vanishes where the
  /// vector between the points is across v. There the cone is that of its part across v.
  template <class Place>
  CertifiedOfCone<T> onEdge(const Vec3<T>& start, const Vec3<T>& v, Place&& place) const {
    const Vec3<T> w = start - w_;
    const T vv = squaredNorm(v), uv = dot(u_, v), vw = dot(v, w);
    const Vec3<T> across = u_ - quotientOrZero(uv, vv) * v;
    const Vec3<T> apart = w - quotientOrZero(vw, vv) * v;
    const T t = clampedToUnit(quotientOrZero(uv * bestOnCone(apart, across, taper_) - vw, vv));
    const auto [x, y] = place(t);
    return at(bestOnCone(w + t * v, u_, taper_), x, y);
  }

  /// On each side of the plane the height and the radius are linear in s.
  T nearestToPlane() const {
    const T climb = dot(normal_, u_);
    if (climb * climb < taper_ * taper_ * squaredNorm(normal_)) return T(taper_ > T(0) ? 1 : 0);
    return clampedToUnit(quotientOrZero(T(0) - dot(normal_, w_) * climb, climb * climb));
  }

  /// The point of the triangle under a point of the axis, moved into the triangle.
  CertifiedOfCone<T> above(const T& s) const {
    const Vec3<T> p = w_ + s * u_;
    const T nn = squaredNorm(normal_);
    const T x = clampedToUnit(quotientOrZero(dot(cross(p, v2_), normal_), nn));
    T y = clampedToUnit(quotientOrZero(dot(cross(v1_, p), normal_), nn));
    if (x + y > T(1)) y = T(1) - x;
    return at(s, x, y);
  }

  CertifiedOfCone<T> at(const T& s, const T& x, const T& y) const {
    CertifiedOfCone<T> c{s, x, y, T(0), T(0), T(0)};
    const Vec3<T> r = between(c);
    c.length = squareRoot(squaredNorm(r));
    // Where the axis meets the triangle, the vector 0 takes the place of the unit vector.
    const T scale = c.length > T(0) ? T(1) / c.length : T(0);
    const auto along = [&](const Vec3<T>& v) { return scale * dot(v, r); };
    const auto isLess = [](const T& p, const T& q) { return p < q; };
    c.distance = c.length - (radius_ + s * taper_);
    c.gap = along(w_) - radius_ + std::min(along(u_) - taper_, T(0), isLess) -
            std::max({along(v1_), along(v2_), T(0)}, isLess);
    return c;
  }

  Vec3<T> w_, u_, v1_, v2_, normal_;
  T radius_, taper_;
};

}  // namespace fcl_fibers::geometry
