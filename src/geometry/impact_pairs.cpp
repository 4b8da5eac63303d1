// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/impact_pairs.h"

#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/impact_pairs.cpp"
#include <hwy/foreach_target.h>

#include "geometry/pair_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

template <class Row>
FCL_FIBERS_ALWAYS_INLINE Row between(const Row& from, const Row& to, const Row& time) {
  return from + time * (to - from);
}
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Vec3Rows<Row> between(const Vec3Rows<Row>& from, const Vec3Rows<Row>& to,
                                               const Row& time) {
  return {between(from.x, to.x, time), between(from.y, to.y, time), between(from.z, to.z, time)};
}
using Double = simd::HWY_NAMESPACE::Lanes<ImpactRows::kLanes, double>;

template <class Row, bool kMayTaper>
FCL_FIBERS_ALWAYS_INLINE PairRows<Row, kMayTaper> between(const PairRows<Row, kMayTaper>& from,
                                                          const PairRows<Row, kMayTaper>& to,
                                                          const Row& time) {
  return {between(from.w, to.w, time),
          between(from.u, to.u, time),
          between(from.v, to.v, time),
          between(from.reach, to.reach, time),
          between(from.taper_u, to.taper_u, time),
          between(from.taper_v, to.taper_v, time)};
}

/// How far each pair of ends is beyond the reach along a direction, times the direction's length.
template <class Row>
struct Gaps {
  Row gap[4];

  template <bool kMayTaper>
  FCL_FIBERS_ALWAYS_INLINE Gaps(const PairRows<Row, kMayTaper>& pair, const Vec3Rows<Row>& n,
                                const Row& length, const Row& error) {
    const Row w = dot(n, pair.w) - (pair.reach * length + error);
    const auto [u, v] = pair.slopes(n, length);
    gap[0] = w;
    gap[1] = w + u;
    gap[2] = w - v;
    gap[3] = w + u - v;
  }
  FCL_FIBERS_ALWAYS_INLINE Row least() const {
    return min(min(gap[0], gap[1]), min(gap[2], gap[3]));
  }
};

/// An arrival needs them to many digits, of capsules even where axes nearly parallel cross.
template <bool kMayTaper>
FCL_FIBERS_ALWAYS_INLINE ArcRows<Double> closest(const PairRows<Double, kMayTaper>& pair,
                                                 const Double& distance) {
  if constexpr (kMayTaper) return closestOfAxes(pair, distance);
  return closestByProjection(pair.w, pair.u, pair.v);
}
template <bool kMayTaper>
FCL_FIBERS_ALWAYS_INLINE ArcRows<Float> closest(const PairRows<Float, kMayTaper>& pair,
                                                const Float& distance) {
  return closestOfAxes(pair, distance);
}

template <class Row>
struct Arrivals {
  typename Row::Truth apart;    ///< during the whole step
  typename Row::Truth arrived;  ///< at time `from`, if they were told how near that is
  Row from;                     ///< apart before
  Row s, t;                     ///< the closest points at that time
};

/// Conservative advancement along separating directions, as in findImpact(). The gap of each pair
/// of ends along a fixed direction is linear in time. So if all are positive now, the capsules are
/// apart until the first of them vanishes. That holds for any direction, so the closest points need
/// not be exact; only the rounding of the gaps has to be bounded.
/// @param open      lanes that are looked at; their products neither overflow nor vanish
/// @param arrival   capsules that are no farther out of reach than this have arrived; negative to
///                  go on as long as rounding allows
template <class T, class Row, bool kMayTaper>
FCL_FIBERS_ALWAYS_INLINE Arrivals<Row> advance(const PairRows<Row, kMayTaper>& start,
                                               const PairRows<Row, kMayTaper>& end,
                                               typename Row::Truth open, const Row& from,
                                               const Row& arrival, int most_steps) {
  constexpr T kEps = std::numeric_limits<T>::epsilon() / 2;
  const auto all = [](T x) HWY_ATTR { return Row::all(x); };
  const Row zero = all(0), one = all(1);
  // Let m be the sum of the lengths of w, u and v at both times, which is at most
  // sqrt(6 (|w|^2 + ...)), and of cones that of the sizes of the tapers, too. The vectors carry an
  // error of 5 eps m, including their conversion to float; a gap along n carries another 5 eps m
  // |n|. The time of the next step carries 4 eps, in which a gap changes by 4 eps (m + reach) |n|.
  const Row error =
      all(32 * kEps) * (squareRoot(all(kMayTaper ? 10 : 6) * (start.squares() + end.squares())) +
                        max(start.reach, end.reach));
  const auto none = open & (one <= zero);
  Arrivals<Row> result{none, none, from, zero, zero};
  // Of cones, the closest points matter most where they touch, and that far apart they are sought.
  Row reach = start.reach;
  for (int step = 0; step < most_steps; ++step) {
    const auto now = between(start, end, result.from);
    const auto [s, t] = closest(now, reach);
    const Vec3Rows<Row> n = pointBetween(now.w, now.u, now.v, s, t);
    const Row length = squareRoot(dot(n, n));
    reach = now.reachAt(s, t);
    const auto arrives = open & (length - reach <= arrival);
    result.arrived = either(result.arrived, arrives);
    result.s = choose(open, s, result.s);
    result.t = choose(open, t, result.t);
    const Gaps<Row> gaps(now, n, length, error * length), last(end, n, length, error * length);
    open = without(open, arrives) & (error <= length) & (zero <= gaps.least());
    const auto stays_apart = open & (zero <= last.least());
    result.apart = either(result.apart, stays_apart);
    open = open & (last.least() <= zero);
    if (open.mask() == 0) break;
    Row share = one;
    for (int k = 0; k < 4; ++k) {
      share = min(share, choose(zero <= last.gap[k], one,
                                quotientInUnitInterval(gaps.gap[k], gaps.gap[k] - last.gap[k])));
    }
    const Row next = result.from + (one - result.from) * share * all(1 - 8 * kEps);
    result.from = choose(open, min(next, one), result.from);
  }
  return result;
}

template <bool kMayTaper>
FCL_FIBERS_ALWAYS_INLINE std::uint64_t decideGroup(ImpactPairs& pairs,
                                                   const RelativePairs (&relative)[2], int i) {
  constexpr float kRoundUp = 1 + 0x1p-21f;
  constexpr int kMostSteps = 4;
  const auto &p = pairs.mayTaperP(), &q = pairs.mayTaperQ();
  auto start = load<kMayTaper>(relative[0], i, p.start, q.start);
  auto end = load<kMayTaper>(relative[1], i, p.end, q.end);
  const Float more = Float::load(pairs.margin().data() + i) + Float::load(pairs.error().data() + i);
  start.reach = (start.reach + more) * Float::all(kRoundUp);
  end.reach = (end.reach + more) * Float::all(kRoundUp);
  const Float lowest = Float::all(std::numeric_limits<float>::lowest());
  const auto found = advance<float>(start, end, isInRange(start.squares() + end.squares()),
                                    Float::all(0), lowest, kMostSteps);
  found.from.storeAligned(pairs.from().data() + i);
  return std::uint64_t{found.apart.mask()} << i;
}

std::uint64_t decide(ImpactPairs& pairs) {
  RelativePairs relative[2];
  const int count = pairs.filledSize();
  for (int i = 0; i < count; ++i) {
    relative[0].set(i, pairs.p(i).start, pairs.q(i).start, pairs.unit());
    relative[1].set(i, pairs.p(i).end, pairs.q(i).end, pairs.unit());
  }
  std::uint64_t apart = 0;
  const auto &p = pairs.mayTaperP(), &q = pairs.mayTaperQ();
  const bool may_taper = p.start || p.end || q.start || q.end;
  for (int i = 0; i < count; i += PairBlock::kGroup) {
    apart |=
        may_taper ? decideGroup<true>(pairs, relative, i) : decideGroup<false>(pairs, relative, i);
  }
  return apart;
}

template <bool kMayTaper>
FCL_FIBERS_ALWAYS_INLINE PairRows<Double, kMayTaper> load(const ImpactRows::Instant& instant) {
  const auto row = [&](int i) HWY_ATTR { return Double::load(instant[i]); };
  return {{row(0), row(1), row(2)},
          {row(3), row(4), row(5)},
          {row(6), row(7), row(8)},
          row(9),
          row(10),
          row(11)};
}

template <bool kMayTaper>
FCL_FIBERS_ALWAYS_INLINE void advanceAs(ImpactRows& rows) {
  // Pairs that need more almost graze, and directions that turn serve them better.
  constexpr int kMostSteps = 8;
  const auto start = load<kMayTaper>(rows.start), end = load<kMayTaper>(rows.end);
  const Double size = start.squares() + end.squares();
  const auto in_range = (Double::all(0x1p-300) <= size) & (size <= Double::all(0x1p300));
  const auto found = advance<double>(start, end, in_range, Double::load(rows.from),
                                     Double::load(rows.arrival), kMostSteps);
  rows.apart = found.apart.mask();
  rows.arrived = found.arrived.mask();
  found.from.storeAligned(rows.from);
  found.s.storeAligned(rows.s);
  found.t.storeAligned(rows.t);
}

void advanceInDouble(ImpactRows& rows) {
  rows.may_taper ? advanceAs<true>(rows) : advanceAs<false>(rows);
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::geometry {

HWY_EXPORT(decide);
HWY_EXPORT(advanceInDouble);

std::uint64_t ImpactPairs::decide() {
  fill({kNoCapsule, kNoCapsule}, {kNoCapsule, kNoCapsule});
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(decide)(*this);
}

void advance(ImpactRows& rows) {
  simd::readEnvironment();
  HWY_DYNAMIC_DISPATCH(advanceInDouble)(rows);
}

}  // namespace fcl_fibers::geometry
#endif
