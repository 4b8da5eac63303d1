// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/impact_test.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/impact_test.cpp"
#include <hwy/foreach_target.h>

#include "geometry/relative_pairs-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

/// The three vectors of a pair at one time, as in RelativePairs, and how near the axes touch.
struct PairLanes {
  Vec3Lanes w, u, v;
  Float reach;
};

FCL_FIBERS_ALWAYS_INLINE PairLanes load(const RelativePairs& relative, int i) {
  PairLanes pair;
  pair.reach = relative.w.get(i, pair.w);
  relative.u.get(i, pair.u);
  relative.v.get(i, pair.v);
  return pair;
}

FCL_FIBERS_ALWAYS_INLINE Float squares(const PairLanes& pair) {
  return dot(pair.w, pair.w) + dot(pair.u, pair.u) + dot(pair.v, pair.v);
}

FCL_FIBERS_ALWAYS_INLINE Float between(const Float& from, const Float& to, const Float& time) {
  return from + time * (to - from);
}
FCL_FIBERS_ALWAYS_INLINE Vec3Lanes between(const Vec3Lanes& from, const Vec3Lanes& to,
                                           const Float& time) {
  return {between(from.x, to.x, time), between(from.y, to.y, time), between(from.z, to.z, time)};
}
FCL_FIBERS_ALWAYS_INLINE PairLanes between(const PairLanes& from, const PairLanes& to,
                                           const Float& time) {
  return {between(from.w, to.w, time), between(from.u, to.u, time), between(from.v, to.v, time),
          between(from.reach, to.reach, time)};
}

/// How far each pair of ends is beyond the reach along a direction, times the direction's length.
struct Gaps {
  Float gap[4];

  FCL_FIBERS_ALWAYS_INLINE Gaps(const PairLanes& pair, const Vec3Lanes& n, const Float& length,
                                const Float& error) {
    const Float w = dot(n, pair.w) - (pair.reach * length + error);
    const Float u = dot(n, pair.u), v = dot(n, pair.v);
    gap[0] = w;
    gap[1] = w + u;
    gap[2] = w - v;
    gap[3] = w + u - v;
  }
  FCL_FIBERS_ALWAYS_INLINE Float least() const {
    return min(min(gap[0], gap[1]), min(gap[2], gap[3]));
  }
};

struct ImpactLanes {
  Float::Truth apart;
  Float from;
};

/// Conservative advancement along separating directions, as in findImpact(). The gap of each pair
/// of ends along a fixed direction is linear in time. So if all are positive now, the capsules are
/// apart until the first of them vanishes. That holds for any direction, so the closest points need
/// not be exact; only the rounding of the gaps has to be bounded.
FCL_FIBERS_ALWAYS_INLINE ImpactLanes decideLanes(const ImpactPairs& pairs,
                                                 const RelativePairs (&relative)[2], int i) {
  constexpr float kEps = 0x1p-24f;
  constexpr int kMostSteps = 8;
  const auto all = [](float x) HWY_ATTR { return Float::all(x); };
  const Float zero = all(0), one = all(1);
  PairLanes start = load(relative[0], i), end = load(relative[1], i);
  const Float more = Float::load(pairs.margin().data() + i) + Float::load(pairs.error().data() + i);
  start.reach = (start.reach + more) * all(1 + 8 * kEps);
  end.reach = (end.reach + more) * all(1 + 8 * kEps);

  // With e = 2^-24, let m be the sum of the lengths of w, u and v at both times, which is at most
  // sqrt(6 (|w|^2 + ...)). The vectors carry an error of 5 e m, including their conversion to
  // float; a gap along n carries another 5 e m |n|. The time of the next step carries 4 e, in which
  // a gap changes by 4 e (m + reach) |n|.
  const Float size = squares(start) + squares(end);
  const Float error = all(32 * kEps) * (squareRoot(all(6) * size) + max(start.reach, end.reach));
  auto open = isInRange(size);
  ImpactLanes result{open & (one <= zero), zero};
  for (int step = 0; step < kMostSteps; ++step) {
    const PairLanes now = between(start, end, result.from);
    const auto [s, t] = closestOfAxes(now.w, now.u, now.v);
    const Vec3Lanes n = pointBetween(now.w, now.u, now.v, s, t);
    const Float length = squareRoot(dot(n, n));
    const Gaps gaps(now, n, length, error * length), last(end, n, length, error * length);
    open = open & (error <= length) & (zero <= gaps.least());
    const auto stays_apart = open & (zero <= last.least());
    result.apart = either(result.apart, stays_apart);
    open = open & (last.least() <= zero);
    if (open.mask() == 0) break;
    Float share = one;
    for (int k = 0; k < 4; ++k) {
      share = min(share, choose(zero <= last.gap[k], one,
                                quotientInUnitInterval(gaps.gap[k], gaps.gap[k] - last.gap[k])));
    }
    const Float next = result.from + (one - result.from) * share * all(1 - 8 * kEps);
    result.from = choose(open, min(next, one), result.from);
  }
  return result;
}

std::uint64_t decide(ImpactPairs& pairs) {
  RelativePairs relative[2];
  const int end = (pairs.size() + PairBlock::kGroup - 1) / PairBlock::kGroup * PairBlock::kGroup;
  for (int i = 0; i < end; ++i) {
    relative[0].set(i, pairs.p(i).start, pairs.q(i).start, pairs.unit());
    relative[1].set(i, pairs.p(i).end, pairs.q(i).end, pairs.unit());
  }
  std::uint64_t apart = 0;
  for (int i = 0; i < end; i += PairBlock::kGroup) {
    const ImpactLanes lanes = decideLanes(pairs, relative, i);
    apart |= std::uint64_t{lanes.apart.mask()} << i;
    lanes.from.storeAligned(pairs.from().data() + i);
  }
  return apart;
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::geometry {

HWY_EXPORT(decide);

std::uint64_t ImpactPairs::decide() {
  static constexpr CapsuleEnd kNowhere[2] = {};
  for (std::size_t i = index(); i % kGroup != 0; ++i) {
    p_[i] = q_[i] = {kNowhere, kNowhere};
    margin_[i] = error_[i] = 0;
  }
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(decide)(*this);
}

}  // namespace fcl_fibers::geometry
#endif
