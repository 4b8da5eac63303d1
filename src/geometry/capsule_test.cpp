// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/capsule_test.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/capsule_test.cpp"
#include <hwy/foreach_target.h>

#include "simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

using simd::LaneMask;
using Float8 = simd::HWY_NAMESPACE::Lanes<8>;

struct Vec3Lanes {
  Float8 x, y, z;

  FCL_FIBERS_ALWAYS_INLINE static Vec3Lanes load(const CapsulePairs::Row& x,
                                                 const CapsulePairs::Row& y,
                                                 const CapsulePairs::Row& z, int i) {
    return {Float8::load(x.data() + i), Float8::load(y.data() + i), Float8::load(z.data() + i)};
  }
};
FCL_FIBERS_ALWAYS_INLINE Float8 dot(const Vec3Lanes& a, const Vec3Lanes& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// How far the tangent plane of a convex function falls from x to the end of [0, 1] that is
/// downhill.
FCL_FIBERS_ALWAYS_INLINE Float8 fall(const Float8& slope, const Float8& x) {
  return max(slope * x, slope * (x - Float8::all(1)));
}

struct Verdict8 {
  LaneMask touching, apart;
};

/// The squared distance of two points of the axes, f(s, t) = |w + s u - t v|^2, is convex over the
/// unit square. So f at any point is an upper bound of its minimum, and f minus the fall of the
/// tangent plane is a lower bound (Frank and Wolfe, 1956). Hence s and t need not be exact; only
/// the rounding of f and of its slopes has to be bounded.
FCL_FIBERS_ALWAYS_INLINE Verdict8 decide8(const CapsulePairs& pairs, int i) {
  const auto w = Vec3Lanes::load(pairs.w(0), pairs.w(1), pairs.w(2), i);
  const auto u = Vec3Lanes::load(pairs.u(0), pairs.u(1), pairs.u(2), i);
  const auto v = Vec3Lanes::load(pairs.v(0), pairs.v(1), pairs.v(2), i);
  const Float8 reach = Float8::load(pairs.reach().data() + i);
  const Float8 error = Float8::load(pairs.error().data() + i);
  const auto all = [](float x) HWY_ATTR { return Float8::all(x); };

  // The closest points of the lines, each clamped in turn.
  const Float8 uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
  Float8 s = quotientInUnitInterval(uv * vw - uw * vv, uu * vv - uv * uv);
  const Float8 t = quotientInUnitInterval(uv * s + vw, vv);
  s = quotientInUnitInterval(uv * t - uw, uu);

  const Vec3Lanes r{w.x + s * u.x - t * v.x, w.y + s * u.y - t * v.y, w.z + s * u.z - t * v.z};
  const Float8 distance = squareRoot(dot(r, r));
  const Float8 gap = all(2) * (fall(dot(u, r), s) + fall(all(0) - dot(v, r), t));

  // With e = 2^-24, let m = |w| + |u| + |v|, which is at most sqrt(3 (|w|^2 + |u|^2 + |v|^2)). The
  // vector r carries an error of 4 e m, including a conversion to float. Its length carries another
  // 4 e of itself, and a slope 4 e m |u| + 6 e |u| |r|. Each bound below is wider by at least a
  // fifth, which covers its own rounding.
  constexpr float kEps = 0x1p-24f;
  const Float8 squares = dot(w, w) + uu + vv;
  const Float8 m = squareRoot(all(3) * squares);
  const Float8 r_error = all(5 * kEps) * m;
  const Float8 slope_error = m * (r_error + all(8 * kEps) * distance);

  const Float8 farthest = distance * all(1 + 6 * kEps) + r_error;
  const Float8 nearest = max(distance * all(1 - 6 * kEps) - r_error, all(0));
  const Float8 reach_up = reach * all(1 + 8 * kEps) + error * all(1 + 8 * kEps);
  const Float8 least = nearest * nearest * all(1 - 8 * kEps);
  const Float8 enough = (reach_up * reach_up + gap + all(2) * slope_error) * all(1 + 16 * kEps);

  // The bounds do not hold if products overflow or vanish.
  const auto in_range = (all(0x1p-40f) <= squares) & (squares <= all(0x1p40f));
  const auto touching = (farthest <= reach * all(1 - 8 * kEps)) & in_range;
  const auto apart = (enough <= least) & in_range;
  return {touching.mask(), apart.mask()};
}

CapsulePairs::Verdict decide(const CapsulePairs& pairs) {
  CapsulePairs::Verdict verdict;
  for (int i = 0; i < pairs.size(); i += 8) {
    const Verdict8 eight = decide8(pairs, i);
    verdict.touching[static_cast<std::size_t>(i / 8)] = static_cast<std::uint8_t>(eight.touching);
    verdict.apart[static_cast<std::size_t>(i / 8)] = static_cast<std::uint8_t>(eight.apart);
  }
  return verdict;
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::geometry {

HWY_EXPORT(decide);

CapsulePairs::Verdict CapsulePairs::decide() {
  // The last eight may be incomplete.
  for (std::size_t i = index(); i % 8 != 0; ++i) {
    for (Row* rows : {w_, u_, v_}) {
      for (int axis = 0; axis < 3; ++axis) rows[axis][i] = 0;
    }
    reach_[i] = error_[i] = 0;
  }
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(decide)(*this);
}

}  // namespace fcl_fibers::geometry
#endif
