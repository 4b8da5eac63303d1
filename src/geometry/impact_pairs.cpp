// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/impact_pairs.h"

#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/impact_pairs.cpp"
#include <hwy/foreach_target.h>

#include "geometry/pair_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

/// The three vectors of a pair at one time, as in RelativePairs, and how near the axes touch.
template <class Row>
struct PairRows {
  Vec3Rows<Row> w, u, v;
  Row reach;
};

/// The same of rounded cones: the reach is that of the first ends.
template <class Row>
struct ConeRows : PairRows<Row> {
  Row taper_u, taper_v;  ///< by how much it grows along u and along v
};

template <class Row>
FCL_FIBERS_ALWAYS_INLINE Row squares(const PairRows<Row>& pair) {
  return dot(pair.w, pair.w) + dot(pair.u, pair.u) + dot(pair.v, pair.v);
}

template <class Row>
FCL_FIBERS_ALWAYS_INLINE Row between(const Row& from, const Row& to, const Row& time) {
  return from + time * (to - from);
}
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Vec3Rows<Row> between(const Vec3Rows<Row>& from, const Vec3Rows<Row>& to,
                                               const Row& time) {
  return {between(from.x, to.x, time), between(from.y, to.y, time), between(from.z, to.z, time)};
}
template <class Row>
FCL_FIBERS_ALWAYS_INLINE PairRows<Row> between(const PairRows<Row>& from, const PairRows<Row>& to,
                                               const Row& time) {
  return {between(from.w, to.w, time), between(from.u, to.u, time), between(from.v, to.v, time),
          between(from.reach, to.reach, time)};
}

template <class Row>
FCL_FIBERS_ALWAYS_INLINE ConeRows<Row> between(const ConeRows<Row>& from, const ConeRows<Row>& to,
                                               const Row& time) {
  const PairRows<Row>&a = from, &b = to;
  return {between(a, b, time), between(from.taper_u, to.taper_u, time),
          between(from.taper_v, to.taper_v, time)};
}

/// How near the axes touch at s and t.
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Row reachAt(const PairRows<Row>& pair, const Row&, const Row&) {
  return pair.reach;
}
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Row reachAt(const ConeRows<Row>& pair, const Row& s, const Row& t) {
  return pair.reach + s * pair.taper_u + t * pair.taper_v;
}
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Row mostReach(const PairRows<Row>& pair) {
  return pair.reach;
}
template <class Row>
FCL_FIBERS_ALWAYS_INLINE Row mostReach(const ConeRows<Row>& pair) {
  const Row zero = Row::all(0);
  return pair.reach + max(pair.taper_u, zero - pair.taper_u) +
         max(pair.taper_v, zero - pair.taper_v);
}

/// How far each pair of ends is beyond the reach along a direction, times the direction's length.
template <class Row>
struct Gaps {
  Row gap[4];

  FCL_FIBERS_ALWAYS_INLINE Gaps(const PairRows<Row>& pair, const Vec3Rows<Row>& n,
                                const Row& length, const Row& error) {
    set(dot(n, pair.w) - (pair.reach * length + error), dot(n, pair.u), dot(n, pair.v));
  }
  FCL_FIBERS_ALWAYS_INLINE Gaps(const ConeRows<Row>& pair, const Vec3Rows<Row>& n,
                                const Row& length, const Row& error) {
    set(dot(n, pair.w) - (pair.reach * length + error), dot(n, pair.u) - pair.taper_u * length,
        dot(n, pair.v) + pair.taper_v * length);
  }
  FCL_FIBERS_ALWAYS_INLINE void set(const Row& w, const Row& u, const Row& v) {
    gap[0] = w;
    gap[1] = w + u;
    gap[2] = w - v;
    gap[3] = w + u - v;
  }
  FCL_FIBERS_ALWAYS_INLINE Row least() const {
    return min(min(gap[0], gap[1]), min(gap[2], gap[3]));
  }
};

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
/// @param closest   finds the arc parameters of the closest points
/// @tparam Rows     PairRows or ConeRows
template <class T, class Rows, class Row, class Closest>
FCL_FIBERS_ALWAYS_INLINE Arrivals<Row> advance(const Rows& start, const Rows& end,
                                               typename Row::Truth open, const Row& from,
                                               const Row& arrival, int most_steps,
                                               Closest&& closest) {
  constexpr T kEps = std::numeric_limits<T>::epsilon() / 2;
  const auto all = [](T x) HWY_ATTR { return Row::all(x); };
  const Row zero = all(0), one = all(1);
  // Let m be the sum of the lengths of w, u and v at both times, which is at most
  // sqrt(6 (|w|^2 + ...)). The vectors carry an error of 5 eps m, including their conversion to
  // float; a gap along n carries another 5 eps m |n|. The time of the next step carries 4 eps, in
  // which a gap changes by 4 eps (m + reach) |n|.
  const Row error = all(32 * kEps) * (squareRoot(all(6) * (squares(start) + squares(end))) +
                                      max(mostReach(start), mostReach(end)));
  const auto none = open & (one <= zero);
  Arrivals<Row> result{none, none, from, zero, zero};
  for (int step = 0; step < most_steps; ++step) {
    const Rows now = between(start, end, result.from);
    const auto [s, t] = closest(now);
    const Vec3Rows<Row> n = pointBetween(now.w, now.u, now.v, s, t);
    const Row length = squareRoot(dot(n, n));
    const auto arrives = open & (length - reachAt(now, s, t) <= arrival);
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

/// Where the distance of two cones is least, up to rounding. The best place on both lines is found
/// as ConeDistance::whereSlopesVanish() does, and then clamped in turn as in closestOfAxes(). If
/// the slopes vanish nowhere, the distance falls all the way towards one end.
template <class Row>
FCL_FIBERS_ALWAYS_INLINE ArcRows<Row> closestOfCones(const ConeRows<Row>& pair) {
  const Row zero = Row::all(0), one = Row::all(1);
  const Vec3Rows<Row>&w = pair.w, &u = pair.u, &v = pair.v;
  const Row uu = dot(u, u), vv = dot(v, v);
  const auto ratio = [&](const Row& x, const Row& y)
                         HWY_ATTR { return choose(y <= zero, zero, quotient(x, y)); };
  // Of the ball nearest to a point relative to the first end; see ConeDistance::bestOnCone().
  const auto bestOnCone = [&](const Vec3Rows<Row>& point, const Vec3Rows<Row>& axis,
                              const Row& squared, const Row& taper) HWY_ATTR {
    const Row rest = squared - taper * taper;
    const Row foot = ratio(dot(point, axis), squared);
    const Vec3Rows<Row> away = pointBetween(point, axis, axis, zero, foot);
    const Row at = foot + taper * squareRoot(ratio(dot(away, away), squared * rest));
    return choose(rest <= zero, choose(zero < taper, one, zero), min(max(at, zero), one));
  };
  const Row share = ratio(dot(u, v), vv);
  const Vec3Rows<Row> across = pointBetween(u, v, v, zero, share);
  const Vec3Rows<Row> apart = pointBetween(w, v, v, zero, ratio(dot(v, w), vv));
  const Row squared = dot(across, across);
  const Row n_across = pair.taper_u + share * pair.taper_v, w_across = dot(apart, across);
  const Row upright =
      one - (ratio(pair.taper_v * pair.taper_v, vv) + ratio(n_across * n_across, squared));
  const Vec3Rows<Row> of_lines =
      pointBetween(apart, across, across, zero, ratio(w_across, squared));
  const Row distance = squareRoot(ratio(dot(of_lines, of_lines), upright));
  const Row vanish = quotientInUnitInterval(distance * n_across - w_across, squared);
  Row s = choose(upright <= zero, choose(zero < n_across, one, zero), vanish);
  s = choose(uu <= pair.taper_u * pair.taper_u, choose(zero < pair.taper_u, one, zero), s);
  const Row t = bestOnCone(pointBetween(w, u, u, s, zero), v, vv, pair.taper_v);
  const Vec3Rows<Row> from_first =
      pointBetween({zero - w.x, zero - w.y, zero - w.z}, v, v, t, zero);
  return {bestOnCone(from_first, u, uu, pair.taper_u), t};
}

FCL_FIBERS_ALWAYS_INLINE PairRows<Float> load(const RelativePairs& relative, int i) {
  PairRows<Float> pair;
  pair.reach = relative.w.get(i, pair.w);
  relative.u.get(i, pair.u);
  relative.v.get(i, pair.v);
  return pair;
}
FCL_FIBERS_ALWAYS_INLINE ConeRows<Float> loadCones(const RelativePairs& relative, int i,
                                                   bool p_may_taper, bool q_may_taper) {
  ConeRows<Float> pair;
  pair.reach = relative.w.get(i, pair.w);
  pair.taper_u = relative.u.get(i, pair.u);
  pair.taper_v = relative.v.get(i, pair.v);
  // The second end of a capsule may have the radius of the next one.
  if (!p_may_taper) pair.taper_u = Float::all(0);
  if (!q_may_taper) pair.taper_v = Float::all(0);
  return pair;
}

/// @param start, end  of the group of pairs that begins at i; with radii only
template <class Rows, class Closest>
FCL_FIBERS_ALWAYS_INLINE std::uint64_t decideGroup(ImpactPairs& pairs, int i, Rows start, Rows end,
                                                   Closest&& closest) {
  constexpr float kRoundUp = 1 + 0x1p-21f;
  constexpr int kMostSteps = 4;
  const Float more = Float::load(pairs.margin().data() + i) + Float::load(pairs.error().data() + i);
  start.reach = (start.reach + more) * Float::all(kRoundUp);
  end.reach = (end.reach + more) * Float::all(kRoundUp);
  const Float lowest = Float::all(std::numeric_limits<float>::lowest());
  const Arrivals<Float> found = advance<float>(start, end, isInRange(squares(start) + squares(end)),
                                               Float::all(0), lowest, kMostSteps, closest);
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
  if (p.start || p.end || q.start || q.end) {
    for (int i = 0; i < count; i += PairBlock::kGroup) {
      apart |= decideGroup(pairs, i, loadCones(relative[0], i, p.start, q.start),
                           loadCones(relative[1], i, p.end, q.end),
                           [](const auto& pair) HWY_ATTR { return closestOfCones(pair); });
    }
    return apart;
  }
  for (int i = 0; i < count; i += PairBlock::kGroup) {
    apart |= decideGroup(pairs, i, load(relative[0], i), load(relative[1], i),
                         [](const auto& pair)
                             HWY_ATTR { return closestOfAxes(pair.w, pair.u, pair.v); });
  }
  return apart;
}

using Double = simd::HWY_NAMESPACE::Lanes<ImpactRows::kLanes, double>;

FCL_FIBERS_ALWAYS_INLINE PairRows<Double> load(const ImpactRows::Instant& instant) {
  const auto row = [&](int i) HWY_ATTR { return Double::load(instant[i]); };
  return {{row(0), row(1), row(2)}, {row(3), row(4), row(5)}, {row(6), row(7), row(8)}, row(9)};
}
FCL_FIBERS_ALWAYS_INLINE ConeRows<Double> loadCones(const ImpactRows::Instant& instant) {
  return {load(instant), Double::load(instant[10]), Double::load(instant[11])};
}

template <class Rows, class Closest>
FCL_FIBERS_ALWAYS_INLINE void advanceAs(ImpactRows& rows, const Rows& start, const Rows& end,
                                        Closest&& closest) {
  // Pairs that need more almost graze, and directions that turn serve them better.
  constexpr int kMostSteps = 8;
  const Double size = squares(start) + squares(end);
  const auto in_range = (Double::all(0x1p-300) <= size) & (size <= Double::all(0x1p300));
  const Arrivals<Double> found = advance<double>(start, end, in_range, Double::load(rows.from),
                                                 Double::load(rows.arrival), kMostSteps, closest);
  rows.apart = found.apart.mask();
  rows.arrived = found.arrived.mask();
  found.from.storeAligned(rows.from);
  found.s.storeAligned(rows.s);
  found.t.storeAligned(rows.t);
}

void advanceInDouble(ImpactRows& rows) {
  if (rows.may_taper) {
    advanceAs(rows, loadCones(rows.start), loadCones(rows.end),
              [](const auto& pair) HWY_ATTR { return closestOfCones(pair); });
  } else {
    advanceAs(rows, load(rows.start), load(rows.end), [](const auto& pair) HWY_ATTR {
      return closestByProjection(pair.w, pair.u, pair.v);
    });
  }
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
