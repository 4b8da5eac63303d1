// SPDX-License-Identifier: BSD-3-Clause
#if defined(FCL_FIBERS_GEOMETRY_RELATIVE_PAIRS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_GEOMETRY_RELATIVE_PAIRS_INL_H
#undef FCL_FIBERS_GEOMETRY_RELATIVE_PAIRS_INL_H
#else
#define FCL_FIBERS_GEOMETRY_RELATIVE_PAIRS_INL_H
#endif

#include "geometry/capsule_test.h"
#include "geometry/vec3_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

/// Pairs relative to one of their own points and in float.
struct RelativePairs {
  Quads w;  ///< from the second capsule's first end to the first one's; and the sum of the radii
  Quads u;  ///< along the first capsule
  Quads v;  ///< along the second capsule

  FCL_FIBERS_ALWAYS_INLINE void set(int pair, const CapsuleEnd* p, const CapsuleEnd* q,
                                    double unit) {
    const hn::CappedTag<double, 4> d;
    constexpr int kWidth = static_cast<int>(hn::MaxLanes(d));
    const auto scale = hn::Set(d, unit);
    for (int k = 0; k < 4; k += kWidth) {
      const auto p0 = hn::Load(d, p[0].numbers + k), p1 = hn::Load(d, p[1].numbers + k);
      const auto q0 = hn::Load(d, q[0].numbers + k), q1 = hn::Load(d, q[1].numbers + k);
      const auto is_point = hn::FirstN(d, static_cast<std::size_t>(k < 3 ? 3 - k : 0));
      w.set(d, pair, k, hn::IfThenElse(is_point, hn::Sub(p0, q0), hn::Add(p0, q0)), scale);
      u.set(d, pair, k, hn::Sub(p1, p0), scale);
      v.set(d, pair, k, hn::Sub(q1, q0), scale);
    }
  }
};

/// Two arc parameters.
template <class Row>
struct ArcRows {
  Row s, t;
};

/// Finds where |w + s u - t v| is least, up to rounding: the closest points of the lines, each
/// clamped in turn.
template <class Row>
FCL_FIBERS_ALWAYS_INLINE ArcRows<Row> closestOfAxes(const Vec3Rows<Row>& w, const Vec3Rows<Row>& u,
                                                    const Vec3Rows<Row>& v) {
  const Row uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
  const Row s = quotientInUnitInterval(uv * vw - uw * vv, uu * vv - uv * uv);
  const Row t = quotientInUnitInterval(uv * s + vw, vv);
  return {quotientInUnitInterval(uv * t - uw, uu), t};
}

/// w + s u - t v
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Vec3Rows<Row> pointBetween(const Vec3Rows<Row>& w, const Vec3Rows<Row>& u,
                                                    const Vec3Rows<Row>& v, const Row& s,
                                                    const Row& t) {
  return {w.x + s * u.x - t * v.x, w.y + s * u.y - t * v.y, w.z + s * u.z - t * v.z};
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
