// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/capsule_test.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/capsule_test.cpp"
#include <hwy/foreach_target.h>

#include "simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using simd::LaneMask;
constexpr int kCapacity = CapsulePairs::kCapacity;
/// With AVX2 these are two vectors: one computes while the other waits.
constexpr int kLanes = CapsulePairs::kGroup;
using Float = simd::HWY_NAMESPACE::Lanes<kLanes>;

struct Vec3Lanes {
  Float x, y, z;
};
FCL_FIBERS_ALWAYS_INLINE Float dot(const Vec3Lanes& a, const Vec3Lanes& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// Four numbers for each pair: a vector and something else.
class Quads {
 public:
  /// @return the fourth
  FCL_FIBERS_ALWAYS_INLINE Float get(int first, Vec3Lanes& vector) const {
    Float fourth;
    Float::loadInterleaved(numbers_ + 4 * first, vector.x, vector.y, vector.z, fourth);
    return fourth;
  }
  FCL_FIBERS_ALWAYS_INLINE float* at(int pair) { return numbers_ + 4 * pair; }

 private:
  alignas(64) float numbers_[4 * kCapacity];
};

/// Pairs relative to one of their own points and in float.
struct RelativePairs {
  Quads w;  ///< from the second capsule's first end to the first one's; and the sum of the radii
  Quads u;  ///< along the first capsule
  Quads v;  ///< along the second capsule

  /// Beyond float's range the conversion gives infinity or the largest float. Its square is out of
  /// the range that decideLanes() asks for.
  FCL_FIBERS_ALWAYS_INLINE void set(int pair, const CapsuleEnd* p, const CapsuleEnd* q,
                                    double unit) {
    const hn::CappedTag<double, 4> d;
    constexpr int kWidth = static_cast<int>(hn::MaxLanes(d));
    const auto scale = hn::Set(d, unit);
    const auto store = [&](const auto& numbers, float* out) HWY_ATTR {
      const hn::Rebind<float, decltype(d)> f;
      hn::StoreU(hn::DemoteTo(f, hn::Mul(numbers, scale)), f, out);
    };
    for (int k = 0; k < 4; k += kWidth) {
      const auto p0 = hn::Load(d, p[0].numbers + k), p1 = hn::Load(d, p[1].numbers + k);
      const auto q0 = hn::Load(d, q[0].numbers + k), q1 = hn::Load(d, q[1].numbers + k);
      const auto is_point = hn::FirstN(d, static_cast<std::size_t>(k < 3 ? 3 - k : 0));
      store(hn::IfThenElse(is_point, hn::Sub(p0, q0), hn::Add(p0, q0)), w.at(pair) + k);
      store(hn::Sub(p1, p0), u.at(pair) + k);
      store(hn::Sub(q1, q0), v.at(pair) + k);
    }
  }
};

/// By how much the tangent plane of a convex function falls from x to the end of [0, 1] that lies
/// downhill.
FCL_FIBERS_ALWAYS_INLINE Float fall(const Float& slope, const Float& x) {
  return max(slope * x, slope * (x - Float::all(1)));
}

struct VerdictLanes {
  LaneMask touching, apart;
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

  // The bounds do not hold if products overflow or vanish.
  const auto in_range = (all(0x1p-40f) <= squares) & (squares <= all(0x1p40f));
  const auto touching = (farthest <= reach * all(1 - 8 * kEps)) & in_range;
  const auto apart = (enough <= least) & in_range;
  return {touching.mask(), apart.mask()};
}

CapsulePairs::Verdict decide(const CapsulePairs& pairs) {
  // All loads come first: in between, they would wait with the divisions and roots.
  RelativePairs relative;
  const int end = (pairs.size() + kLanes - 1) / kLanes * kLanes;
  for (int i = 0; i < end; ++i) relative.set(i, pairs.p(i), pairs.q(i), pairs.unit());
  CapsulePairs::Verdict verdict;
  for (int i = 0; i < end; i += kLanes) {
    const VerdictLanes lanes = decideLanes(pairs, relative, i);
    verdict.touching |= std::uint64_t{lanes.touching} << i;
    verdict.apart |= std::uint64_t{lanes.apart} << i;
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
