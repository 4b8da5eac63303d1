// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/capsule_test.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/capsule_test.cpp"
#include <hwy/foreach_target.h>

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

/// The squared distance of two points of the axes, f(s, t) = |w + s u - t v|^2, is convex over the
/// unit square. So f at any point is an upper bound of its minimum, and f minus the fall of the
/// tangent plane is a lower bound (Frank and Wolfe, 1956). Hence s and t need not be exact; only
/// the rounding of f and of its slopes has to be bounded.
FCL_FIBERS_ALWAYS_INLINE VerdictLanes decideLanes(const CapsulePairs& pairs,
                                                  const RelativePairs& relative, int i) {
  Vec3Lanes w, u, v;
  const Float radii = relative.w.get(i, w);
  relative.u.get(i, u);
  relative.v.get(i, v);
  const Float reach = radii + Float::load(pairs.margin().data() + i);
  const Float error = Float::load(pairs.error().data() + i);
  const auto all = [](float x) HWY_ATTR { return Float::all(x); };

  // The closest points of the lines, each clamped in turn.
  const Float uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
  Float s = quotientInUnitInterval(uv * vw - uw * vv, uu * vv - uv * uv);
  const Float t = quotientInUnitInterval(uv * s + vw, vv);
  s = quotientInUnitInterval(uv * t - uw, uu);

  const Vec3Lanes r{w.x + s * u.x - t * v.x, w.y + s * u.y - t * v.y, w.z + s * u.z - t * v.z};
  const Float distance = squareRoot(dot(r, r));
  const Float gap = all(2) * (fall(dot(u, r), s) + fall(all(0) - dot(v, r), t));

  // With e = 2^-24, let m = |w| + |u| + |v|, which is at most sqrt(3 (|w|^2 + |u|^2 + |v|^2)). The
  // vector r carries an error of 4 e m, including a conversion to float. Its length carries another
  // 4 e of itself, and a slope 4 e m |u| + 6 e |u| |r|. Each bound below is wider by at least a
  // fifth, which covers its own rounding.
  constexpr float kEps = 0x1p-24f;
  const Float squares = dot(w, w) + uu + vv;
  const Float m = squareRoot(all(3) * squares);
  const Float r_error = all(5 * kEps) * m;
  const Float slope_error = m * (r_error + all(8 * kEps) * distance);

  const Float farthest = distance * all(1 + 6 * kEps) + r_error;
  const Float nearest = max(distance * all(1 - 6 * kEps) - r_error, all(0));
  const Float reach_up = reach * all(1 + 8 * kEps) + error * all(1 + 8 * kEps);
  const Float least = nearest * nearest * all(1 - 8 * kEps);
  const Float enough = (reach_up * reach_up + gap + all(2) * slope_error) * all(1 + 16 * kEps);

  const auto in_range = isInRange(squares);
  return {(farthest <= reach * all(1 - 8 * kEps)) & in_range, (enough <= least) & in_range};
}

CapsulePairs::Verdict decide(const CapsulePairs& pairs) {
  // All loads come first: in between, they would wait with the divisions and roots.
  RelativePairs relative;
  const int end = (pairs.size() + PairBlock::kGroup - 1) / PairBlock::kGroup * PairBlock::kGroup;
  for (int i = 0; i < end; ++i) relative.set(i, pairs.p(i), pairs.q(i), pairs.unit());
  return verdictOfGroups(end, [&](int i) HWY_ATTR { return decideLanes(pairs, relative, i); });
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::geometry {

HWY_EXPORT(decide);

CapsulePairs::Verdict CapsulePairs::decide() {
  static constexpr CapsuleEnd kNowhere[2] = {};
  for (std::size_t i = index(); i % kGroup != 0; ++i) {
    p_[i] = q_[i] = kNowhere;
    margin_[i] = error_[i] = 0;
  }
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(decide)(*this);
}

}  // namespace fcl_fibers::geometry
#endif
