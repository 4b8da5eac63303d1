// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>

#include "geometry/least_distance.h"
#include "geometry/segment.h"
#include "geometry/triangle.h"

namespace fcl_fibers::geometry {

/// The squared distance at s and at the point a + x (b - a) + y (c - a) of the triangle, and how
/// much it may exceed the least one.
template <typename T>
struct CertifiedOnTriangle {
  T s, x, y;
  T squared;
  T gap;
};

/// The convex function f(s, x, y) = |w + s u - x v1 - y v2|^2 over the unit interval and the
/// triangle x, y >= 0, x + y <= 1. Its minimum is the squared distance of axis and triangle.
template <typename T>
class SquaredTriangleDistance {
 public:
  SquaredTriangleDistance(const Segment& p, const Triangle& t)
      : SquaredTriangleDistance(difference<T>(p.a, t.a), difference<T>(p.b, p.a),
                                difference<T>(t.b, t.a), difference<T>(t.c, t.a)) {}
  SquaredTriangleDistance(const Vec3<T>& w, const Vec3<T>& u, const Vec3<T>& v1, const Vec3<T>& v2)
      : w_(w), u_(u), v1_(v1), v2_(v2), normal_(cross(v1_, v2_)) {}

  /// The best of a point on each edge, of both ends of the axis against the inside of the triangle,
  /// and of the place where the axis crosses its plane. If float noise hides one of them, another
  /// is as good.
  CertifiedOnTriangle<T> atClosest() const {
    return bestBy([](const CertifiedOnTriangle<T>& c) { return c.gap - c.squared; });
  }
  /// The candidate of the least squared distance. Where the shapes almost meet, it tells more than
  /// the gap does, which drowns in rounding first.
  CertifiedOnTriangle<T> atNearest() const {
    return bestBy([](const CertifiedOnTriangle<T>& c) { return c.squared; });
  }

  /// The vector from the triangle's point to the axis's.
  Vec3<T> between(const CertifiedOnTriangle<T>& c) const {
    return w_ + c.s * u_ - c.x * v1_ - c.y * v2_;
  }

 private:
  template <class Cost>
  CertifiedOnTriangle<T> bestBy(Cost&& cost) const {
    const Vec3<T> none{T(0), T(0), T(0)};
    CertifiedOnTriangle<T> best = onEdge(none, v1_, [](const T& t) {
      return std::array<T, 2>{t, T(0)};
    });
    const auto consider = [&](const CertifiedOnTriangle<T>& other) {
      if (cost(other) < cost(best)) best = other;
    };
    consider(onEdge(none, v2_, [](const T& t) { return std::array<T, 2>{T(0), t}; }));
    consider(onEdge(v1_, v2_ - v1_, [](const T& t) { return std::array<T, 2>{T(1) - t, t}; }));
    consider(above(T(0)));
    consider(above(T(1)));
    const T from = dot(normal_, w_), to = from + dot(normal_, u_);
    if ((from < T(0)) != (to < T(0))) consider(above(clampedToUnit(from / (from - to))));
    return best;
  }

  /// The closest points of the axis and the edge from `start` along v, each clamped in turn:
  /// Ericson, Real-Time Collision Detection, 2005, section 5.1.9. The part of the axis across the
  /// edge takes the place of the determinant, which loses more digits.
  template <class Place>
  CertifiedOnTriangle<T> onEdge(const Vec3<T>& start, const Vec3<T>& v, Place&& place) const {
    const Vec3<T> w = w_ - start;
    const T vv = squaredNorm(v), uu = squaredNorm(u_), uv = dot(u_, v);
    const Vec3<T> across = u_ - quotientOrZero(uv, vv) * v;
    const Vec3<T> apart = w - quotientOrZero(dot(v, w), vv) * v;
    T s = clampedToUnit(quotientOrZero(T(0) - dot(apart, across), squaredNorm(across)));
    const T t = clampedToUnit(quotientOrZero(uv * s + dot(v, w), vv));
    s = clampedToUnit(quotientOrZero(uv * t - dot(u_, w), uu));
    const auto [x, y] = place(t);
    return at(s, x, y);
  }

  /// The point of the triangle under a point of the axis, moved into the triangle.
  CertifiedOnTriangle<T> above(const T& s) const {
    const Vec3<T> p = w_ + s * u_;
    const T nn = squaredNorm(normal_);
    const T x = clampedToUnit(quotientOrZero(dot(cross(p, v2_), normal_), nn));
    T y = clampedToUnit(quotientOrZero(dot(cross(v1_, p), normal_), nn));
    if (x + y > T(1)) y = T(1) - x;
    return at(s, x, y);
  }

  /// A convex function lies above its tangent plane, so f is less than here by at most the fall of
  /// the plane to a corner (Frank and Wolfe, 1956). This holds whatever arithmetic found s, x, y.
  CertifiedOnTriangle<T> at(const T& s, const T& x, const T& y) const {
    CertifiedOnTriangle<T> c{s, x, y, T(0), T(0)};
    const Vec3<T> r = between(c);
    c.squared = squaredNorm(r);
    const T slope = T(2) * dot(u_, r), along1 = T(-2) * dot(v1_, r), along2 = T(-2) * dot(v2_, r);
    const T least = std::min({T(0), along1, along2}, [](const T& p, const T& q) { return p < q; });
    c.gap =
        (slope > T(0) ? slope * s : T(0) - slope * (T(1) - s)) + (along1 * x + along2 * y - least);
    return c;
  }

  Vec3<T> w_, u_, v1_, v2_, normal_;
};

}  // namespace fcl_fibers::geometry
