// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/triangle_rows.h"

#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/triangle_rows.cpp"
#include <hwy/foreach_target.h>

#include "geometry/pair_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

/// a + x b
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Vec3Rows<Row> sum(const Vec3Rows<Row>& a, const Row& x,
                                           const Vec3Rows<Row>& b) {
  return {a.x + x * b.x, a.y + x * b.y, a.z + x * b.z};
}
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Vec3Rows<Row> choose(const typename Row::Truth& truth,
                                              const Vec3Rows<Row>& a, const Vec3Rows<Row>& b) {
  return {choose(truth, a.x, b.x), choose(truth, a.y, b.y), choose(truth, a.z, b.z)};
}
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Row quotientOrZero(const Row& x, const Row& y) {
  const Row zero = Row::all(0);
  return choose(zero < y, quotient(x, y), zero);
}

/// The nearest of a point on each edge, and of both ends of the axis above the inside of the
/// triangle. Where the axis crosses the triangle, none of them is closest.
///
/// A vector between two points carries the rounding of their coordinates. So it is not quite
/// perpendicular where closest points are, which leaves more open than the rounding does. Each
/// candidate has a correction that makes it so. If that is as small as the rounding, the corrected
/// vector is the one of a pair which is closest in a place that rounding cannot tell from this one.
/// @tparam Row  a number for each pair
template <class Row>
class ClosestInRows {
  using Vector = Vec3Rows<Row>;

 public:
  FCL_FIBERS_ALWAYS_INLINE explicit ClosestInRows(const TriangleRows& rows)
      : w_(load(rows.w)), u_(load(rows.u)), v1_(load(rows.v1)), v2_(load(rows.v2)) {
    const Row zero = Row::all(0), one = Row::all(1);
    squared_ = Row::all(std::numeric_limits<double>::infinity());
    tryEdge(w_, v1_, [&](const Row& t) HWY_ATTR { return ArcRows<Row>{t, zero}; });
    tryEdge(w_, v2_, [&](const Row& t) HWY_ATTR { return ArcRows<Row>{zero, t}; });
    tryEdge(w_ - v1_, v2_ - v1_, [&](const Row& t) HWY_ATTR { return ArcRows<Row>{one - t, t}; });
    const Vector normal = cross(v1_, v2_);
    const Row part = quotientOrZero(one, dot(normal, normal));
    tryEnd(zero, w_, normal, part);
    tryEnd(one, sum(w_, one, u_), normal, part);
  }

  FCL_FIBERS_ALWAYS_INLINE simd::LaneMask store(TriangleRows& rows) const {
    constexpr double kEps = std::numeric_limits<double>::epsilon();
    const auto all = [](double x) HWY_ATTR { return Row::all(x); };
    const Row zero = all(0), rounding = all(4 * kEps) * Row::load(rows.size);
    const auto is_rounding = dot(correction_, correction_) <= rounding * rounding;
    const Vector r = choose(is_rounding, sum(apart_, all(1), correction_), apart_);
    s_.storeAligned(rows.s);
    x_.storeAligned(rows.x);
    y_.storeAligned(rows.y);
    r.x.storeAligned(rows.apart[0]);
    r.y.storeAligned(rows.apart[1]);
    r.z.storeAligned(rows.apart[2]);

    // A convex function lies above its tangent plane, so half the squared distance is less than
    // here by at most the fall of the plane to a corner (Frank and Wolfe, 1956).
    const Row distance = squareRoot(dot(r, r));
    const Row along1 = dot(v1_, r), along2 = dot(v2_, r);
    const Row gap =
        fall(dot(u_, r), s_) + (max(max(along1, along2), zero) - along1 * x_ - along2 * y_);
    // Closer points need more digits, or rounding would show in the direction.
    constexpr double kNear = 0x1p-20;
    const auto is_far = all(kNear / (4 * kEps)) * rounding < distance;
    return (is_far & (gap <= all(2) * rounding * distance)).mask();
  }

 private:
  FCL_FIBERS_ALWAYS_INLINE static Vector load(const TriangleRows::Vectors& vectors) {
    return {Row::load(vectors[0]), Row::load(vectors[1]), Row::load(vectors[2])};
  }

  /// @param w      from the start of the edge to that of the axis
  /// @param place  tells x and y of a point of the edge
  template <class Place>
  FCL_FIBERS_ALWAYS_INLINE void tryEdge(const Vector& w, const Vector& v, Place&& place) {
    const Row zero = Row::all(0), one = Row::all(1);
    const auto [s, t] = closestByProjection(w, u_, v);
    const auto [x, y] = place(t);
    const Vector r = pointBetween(w, u_, v, s, t);
    // Along the axis, and along the edge where its point is none of its ends.
    const Row vv = dot(v, v);
    const auto is_inside = (zero < t) & (t < one);
    const Row share = choose(is_inside, quotientOrZero(dot(u_, v), vv), zero);
    const Vector across = sum(u_, zero - share, v);
    const Row more_s =
        min(max(quotientOrZero(zero - dot(r, across), dot(across, across)), zero - s), one - s);
    const Vector r1 = sum(r, more_s, u_);
    const Row more_t = min(max(quotientOrZero(dot(r1, v), vv), zero - t), one - t);
    const Vector none{zero, zero, zero};
    consider(s, x, y, r, pointBetween(none, u_, v, more_s, more_t));
  }

  /// @param p     the end of the axis at s
  /// @param part  1 / |normal|^2
  FCL_FIBERS_ALWAYS_INLINE void tryEnd(const Row& s, const Vector& p, const Vector& normal,
                                       const Row& part) {
    const Row zero = Row::all(0), one = Row::all(1);
    const Row x = dot(cross(p, v2_), normal) * part, y = dot(cross(v1_, p), normal) * part;
    const auto is_inside = (zero < x) & (zero < y) & (x + y < one);
    const Vector r = pointBetween(p, v1_, v2_, zero - x, y);
    const Vector above = sum({zero, zero, zero}, dot(normal, p) * part, normal);
    const Vector far = {Row::all(std::numeric_limits<double>::infinity()), zero, zero};
    consider(s, x, y, choose(is_inside, r, far), above - r);
  }

  FCL_FIBERS_ALWAYS_INLINE void consider(const Row& s, const Row& x, const Row& y,
                                         const Vector& apart, const Vector& correction) {
    const Row squared = dot(apart, apart);
    const auto is_nearer = squared < squared_;
    squared_ = choose(is_nearer, squared, squared_);
    s_ = choose(is_nearer, s, s_);
    x_ = choose(is_nearer, x, x_);
    y_ = choose(is_nearer, y, y_);
    apart_ = choose(is_nearer, apart, apart_);
    correction_ = choose(is_nearer, correction, correction_);
  }

  Vector w_, u_, v1_, v2_;
  Row squared_, s_, x_, y_;
  Vector apart_, correction_;
};

template <int N>
FCL_FIBERS_ALWAYS_INLINE simd::LaneMask findIn(TriangleRows& rows) {
  return ClosestInRows<simd::HWY_NAMESPACE::Lanes<N, double>>(rows).store(rows);
}

simd::LaneMask findClosestInRows(TriangleRows& rows, std::size_t count) {
  return count == 1 ? findIn<1>(rows) : findIn<TriangleRows::kLanes>(rows);
}
}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::geometry {

HWY_EXPORT(findClosestInRows);

simd::LaneMask findClosest(TriangleRows& rows, std::size_t count) {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(findClosestInRows)(rows, count);
}

}  // namespace fcl_fibers::geometry
#endif
