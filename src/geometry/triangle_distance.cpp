// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/triangle_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "geometry/double_double.h"
#include "geometry/least_distance.h"

namespace fcl_fibers::geometry {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();

/// The squared distance at s and at the point a + x (b - a) + y (c - a) of the triangle, and how
/// much it may exceed the least one.
template <typename T>
struct Certified {
  T s, x, y;
  T squared;
  T gap;
};

/// The convex function f(s, x, y) = |w + s u - x v1 - y v2|^2 over the unit interval and the
/// triangle x, y >= 0, x + y <= 1. Its minimum is the squared distance of axis and triangle.
template <typename T>
class SquaredDistance {
 public:
  SquaredDistance(const Segment& p, const Triangle& t)
      : w_(difference<T>(p.a, t.a)),
        u_(difference<T>(p.b, p.a)),
        v1_(difference<T>(t.b, t.a)),
        v2_(difference<T>(t.c, t.a)),
        normal_(cross(v1_, v2_)) {}

  /// The best of a point on each edge, of both ends of the axis against the inside of the triangle,
  /// and of the place where the axis crosses its plane. If float noise hides one of them, another
  /// is as good.
  Certified<T> atClosest() const {
    const Vec3<T> none{T(0), T(0), T(0)};
    Certified<T> best = onEdge(none, v1_, [](const T& t) { return std::array<T, 2>{t, T(0)}; });
    const auto consider = [&](const Certified<T>& other) {
      if (other.squared - other.gap > best.squared - best.gap) best = other;
    };
    consider(onEdge(none, v2_, [](const T& t) { return std::array<T, 2>{T(0), t}; }));
    consider(onEdge(v1_, v2_ - v1_, [](const T& t) { return std::array<T, 2>{T(1) - t, t}; }));
    consider(above(T(0)));
    consider(above(T(1)));
    const T from = dot(normal_, w_), to = from + dot(normal_, u_);
    if ((from < T(0)) != (to < T(0))) consider(above(clampedToUnit(from / (from - to))));
    return best;
  }

  /// The vector from the triangle's point to the axis's.
  Vec3<T> between(const Certified<T>& c) const { return w_ + c.s * u_ - c.x * v1_ - c.y * v2_; }

 private:
  /// The closest points of the axis and the edge from `start` along v, each clamped in turn:
  /// Ericson, Real-Time Collision Detection, 2005, section 5.1.9. The part of the axis across the
  /// edge takes the place of the determinant, which loses more digits.
  template <class Place>
  Certified<T> onEdge(const Vec3<T>& start, const Vec3<T>& v, Place&& place) const {
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
  Certified<T> above(const T& s) const {
    const Vec3<T> p = w_ + s * u_;
    const T nn = squaredNorm(normal_);
    const T x = clampedToUnit(quotientOrZero(dot(cross(p, v2_), normal_), nn));
    T y = clampedToUnit(quotientOrZero(dot(cross(v1_, p), normal_), nn));
    if (x + y > T(1)) y = T(1) - x;
    return at(s, x, y);
  }

  /// A convex function lies above its tangent plane, so f is less than here by at most the fall of
  /// the plane to a corner (Frank and Wolfe, 1956). This holds whatever arithmetic found s, x, y.
  Certified<T> at(const T& s, const T& x, const T& y) const {
    Certified<T> c{s, x, y, T(0), T(0)};
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

/// The sum of the 1-norms of the differences, by which rounding is bounded.
double sizeOf(const Segment& p, const Triangle& t) {
  return norm1(p.a - t.a) + norm1(p.b - p.a) + norm1(t.b - t.a) + norm1(t.c - t.a);
}

/// Bounds the rounding of `squared - gap` in double for a pair of size m. The vector r carries an
/// error of 5 eps m, its square 12 eps m^2, and each slope 16 eps m^2.
double roundingFor(double m) { return 128 * kEps * m * m; }

/// Whether products of six lengths of this size neither overflow nor vanish.
bool isWellScaled(double m) { return m > 0x1p-150 && m < 0x1p150; }

double largestOf(const Segment& p, const Triangle& t) {
  return std::max({maxNorm(p.a), maxNorm(p.b), maxNorm(t.a), maxNorm(t.b), maxNorm(t.c)});
}

Segment scaled(const Segment& s, double scale) { return {scale * s.a, scale * s.b, s.radius}; }
Triangle scaled(const Triangle& t, double scale) { return {scale * t.a, scale * t.b, scale * t.c}; }

/// Whether all of the axis lies more than `reach` beyond all of the triangle along the line between
/// their middles, which takes no division and settles most pairs that are apart.
bool isApartAlongMiddles(const Segment& p, const Triangle& t, double rounding, double reach) {
  // Six times the vector between the middles, and its products with six times the half extents.
  const Vec3d apart = 3.0 * (p.a - t.a + p.b - t.a) - 2.0 * (t.b - t.a + t.c - t.a);
  const double squared = squaredNorm(apart);
  const double axis = 3 * std::fabs(dot(p.b - p.a, apart));
  const double b = dot(t.b - t.a, apart), c = dot(t.c - t.a, apart);
  const double most = 6 * std::max({0.0, b, c}) - 2 * (b + c);
  const double gap = squared - axis - most - 72 * rounding;
  return gap > 0 && gap * gap > 36 * reach * reach * squared * (1 + 0x1p-40);
}

bool wellScaledWithin(const Segment& p, const Triangle& t, double m, double reach) {
  const double rounding = roundingFor(m);
  if (isApartAlongMiddles(p, t, rounding, reach)) return false;
  const double reach_squared = reach * reach;
  const Certified<double> rough = SquaredDistance<double>(p, t).atClosest();
  if (rough.squared <= reach_squared) return true;
  if (rough.squared - rough.gap - rounding > reach_squared) return false;
  const Certified<DoubleDouble> fine = SquaredDistance<DoubleDouble>(p, t).atClosest();
  return fine.squared - fine.gap <=
         DoubleDouble(reach) * DoubleDouble(reach) + DoubleDouble(0x1p-52 * rounding);
}

/// Finds the closest points of most contacts in a few operations: where an end of the axis is above
/// the inside of a triangle that is no needle, or where the axis crosses it at no small angle. Then
/// no error grows to more than a few times that of a coordinate.
/// @return whether it is such a pair for certain
bool findInside(const Segment& capsule, const Triangle& t, double m, ClosestOnTriangle& closest) {
  const Vec3d w = capsule.a - t.a, u = capsule.b - capsule.a, v1 = t.b - t.a, v2 = t.c - t.a;
  const Vec3d normal = cross(v1, v2);
  const double nn = squaredNorm(normal);
  const double height = dot(normal, w), climb = dot(normal, u);
  constexpr double kLeastSine = 0x1p-4, kLeastSize = 0x1p-20;  // squared
  const double vv1 = squaredNorm(v1), vv2 = squaredNorm(v2);
  const bool is_wide = nn >= kLeastSine * vv1 * vv2 && std::min(vv1, vv2) >= kLeastSize * m * m;
  if (!is_wide) return false;
  // The error of a height and of the climb, in units of the normal.
  const double rounding = 64 * kEps * std::sqrt(nn) * m;
  const double end = height + climb;
  if (std::min({std::fabs(height), std::fabs(end), std::fabs(climb)}) <= rounding) return false;
  const bool crosses = (height > 0) != (end > 0);
  const bool is_steep = climb * climb >= kLeastSine * nn * squaredNorm(u);
  if (crosses && !is_steep) return false;
  const double s = crosses ? height / (height - end) : (height > 0) == (climb > 0) ? 0 : 1;
  const Vec3d p = w + s * u;
  const double x = dot(cross(p, v2), normal) / nn, y = dot(cross(v1, p), normal) / nn;
  constexpr double kInside = 0x1p-30;
  if (std::min({x, y, 1 - x - y}) <= kInside) return false;
  const Vec3d apart = crosses ? Vec3d{0, 0, 0} : ((s == 0 ? -height : -end) / nn) * normal;
  closest = {s, {1 - x - y, x, y}, apart};
  return true;
}

}  // namespace

bool axisWithin(const Segment& capsule, const Triangle& triangle, double reach) {
  const double m = sizeOf(capsule, triangle);
  if (isWellScaled(m)) return wellScaledWithin(capsule, triangle, m, reach);
  if (m == 0 || !std::isfinite(m)) return true;
  const double scale = scaleForSize(m, largestOf(capsule, triangle));
  // The scaled reach must not overflow either.
  return axisWithin(scaled(capsule, scale), scaled(triangle, scale),
                    std::min(scale * reach, 0x1p150));
}

bool touch(const Segment& capsule, const Triangle& triangle, double margin, double error) {
  const double reach = std::max(capsule.radius + margin, 0.0);
  return axisWithin(capsule, triangle, reach * (1 + 4 * kEps) + error);
}

ClosestOnTriangle closestPoints(const Segment& capsule, const Triangle& triangle) {
  const double m = sizeOf(capsule, triangle);
  if (m == 0) return {0, {1, 0, 0}, {0, 0, 0}};
  if (!isWellScaled(m)) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    // No scale makes these finite.
    if (std::isnan(m) || !std::isfinite(largestOf(capsule, triangle))) {
      return {0, {1, 0, 0}, {kInfinity, kInfinity, kInfinity}};
    }
    const double scale = scaleForSize(m, largestOf(capsule, triangle));
    ClosestOnTriangle closest = closestPoints(scaled(capsule, scale), scaled(triangle, scale));
    closest.apart = (1 / scale) * closest.apart;
    return closest;
  }
  const auto closestOf = [](const auto& distance, const auto& best) -> ClosestOnTriangle {
    const auto r = distance.between(best);
    const double x = double(best.x), y = double(best.y);
    return {double(best.s),
            {std::max(1 - x - y, 0.0), x, y},
            {-double(r.x), -double(r.y), -double(r.z)}};
  };
  ClosestOnTriangle inside;
  if (findInside(capsule, triangle, m, inside)) return inside;
  const SquaredDistance<double> rough(capsule, triangle);
  const Certified<double> best = rough.atClosest();
  // Closer points need more digits, or rounding would show in the direction.
  constexpr double kNear = 0x1p-20;
  const double distance = std::sqrt(best.squared);
  if (distance > kNear * m && best.gap <= 32 * kEps * m * distance) return closestOf(rough, best);
  const SquaredDistance<DoubleDouble> fine(capsule, triangle);
  return closestOf(fine, fine.atClosest());
}

}  // namespace fcl_fibers::geometry
