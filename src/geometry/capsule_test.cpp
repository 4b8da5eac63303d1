// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/capsule_test.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/capsule_test.cpp"
#include <hwy/foreach_target.h>

#include "geometry/pair_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

constexpr float kEps = 0x1p-23f;

/// The squared distance of two points of the axes, f(s, t) = |w + s u - t v|^2, is convex over the
/// unit square. So f at any point is an upper bound of its minimum, and f minus the fall of the
/// tangent plane is a lower bound (Frank and Wolfe, 1956). Hence s and t need not be exact; only
/// the rounding of f and of its slopes has to be bounded.
///
/// Of cones, the distance of two balls less their radii is convex. Seen along the line through the
/// balls at s and t, which are `length` apart, it has a fall F / length. So the distance of the
/// cones is at least length - F / length - radii, hence at least sqrt(length^2 - 2 F) - radii, and
/// what follows for capsules holds with the fall F and with the radii at s and t.
struct DistanceLanes {
  Float reach, error;       ///< radii and margin; and of all points
  Float nearest, farthest;  ///< bound the distance of the points found
  Float gap, slope_error;   ///< bound together by how much its square may exceed the least one
  Float::Truth in_range;    ///< otherwise nothing is known
};
template <bool kMayTaper>
FCL_FIBERS_ALWAYS_INLINE DistanceLanes distanceLanes(const CapsulePairs& pairs,
                                                     const RelativePairs& relative, int i) {
  auto pair = load<kMayTaper>(relative, i, pairs.mayTaperP(), pairs.mayTaperQ());
  pair.reach = pair.reach + Float::load(pairs.margin().data() + i);
  const Float error = Float::load(pairs.error().data() + i);
  const auto all = [](float x) HWY_ATTR { return Float::all(x); };

  const auto [s, t] = closestOfAxes(pair, pair.reach);
  const Vec3Lanes r = pointBetween(pair.w, pair.u, pair.v, s, t);
  const Float distance = squareRoot(dot(r, r));
  const auto [along_u, along_v] = pair.slopes(r, distance);
  const Float gap = all(2) * (fall(along_u, s) + fall(all(0) - along_v, t));

  // With e = 2^-23, which bounds a rounding in any direction, let m = |w| + |u| + |v|, which is at
  // most sqrt(3 (|w|^2 + |u|^2 + |v|^2)). The vector r carries an error of 4 e m, including a
  // conversion to float. Its length carries another 4 e of itself, and a slope 4 e m |u| + 6 e |u|
  // |r|. Each bound below is wider by at least a tenth, which covers its own rounding.
  //
  // Of cones, let T be the sum of the sizes of the tapers. The radii at s and t carry up to 7 e T
  // more than those of capsules. Any direction gives a lower bound, so r's error does not count in
  // a slope, which carries 7 e |u| |r| and 9 e |T| |r|. A part of it keeps bounds of 0 apart.
  const Float squares = pair.squares();
  Float m = squareRoot(all(3) * squares);
  if constexpr (kMayTaper) {
    m = m + all(2) * (max(pair.taper_u, all(0) - pair.taper_u) +
                      max(pair.taper_v, all(0) - pair.taper_v));
  }
  const Float r_error = all(5 * kEps) * m;
  const Float slope_error =
      m * (all(kMayTaper ? 8 * kEps : 1) * r_error + all(8 * kEps) * distance);

  const Float farthest = distance * all(1 + 6 * kEps) + r_error;
  const Float nearest = max(distance * all(1 - 6 * kEps) - r_error, all(0));
  return {pair.reachAt(s, t), error, nearest, farthest, gap, all(2) * slope_error,
          isInRange(squares)};
}

FCL_FIBERS_ALWAYS_INLINE Float reachUp(const DistanceLanes& d) {
  const Float outward = Float::all(1 + 8 * kEps);
  return d.reach * outward + d.error * outward;
}

FCL_FIBERS_ALWAYS_INLINE VerdictLanes decideLanes(const DistanceLanes& d) {
  const auto all = [](float x) HWY_ATTR { return Float::all(x); };
  const Float reach_up = reachUp(d);
  const Float least = d.nearest * d.nearest * all(1 - 8 * kEps);
  const Float enough = (reach_up * reach_up + d.gap + d.slope_error) * all(1 + 16 * kEps);
  return {(d.farthest <= d.reach * all(1 - 8 * kEps)) & d.in_range, (enough <= least) & d.in_range};
}

/// Stores the bounds of a group, and returns which of them tell something.
FCL_FIBERS_ALWAYS_INLINE std::uint64_t storeGaps(const DistanceLanes& d, float* gaps) {
  const auto all = [](float x) HWY_ATTR { return Float::all(x); };
  const Float squared =
      d.nearest * d.nearest * all(1 - 8 * kEps) - (d.gap + d.slope_error) * all(1 + 16 * kEps);
  const Float least = squareRoot(max(squared, all(0))) * all(1 - 8 * kEps) - reachUp(d);
  (least * all(1 - 8 * kEps)).storeAligned(gaps);
  const auto is_tight = (d.farthest - d.reach) * all(31.0f / 32) <= least;
  return (is_tight & (all(0) <= least) & d.in_range).mask();
}

/// Calls take(i, lanes) for the groups of pairs that begin at i.
template <class Take>
FCL_FIBERS_ALWAYS_INLINE void forGroups(const CapsulePairs& pairs, Take&& take) {
  // All loads come first: in between, they would wait with the divisions and roots.
  RelativePairs relative;
  const int end = pairs.filledSize();
  for (int i = 0; i < end; ++i) relative.set(i, pairs.p(i), pairs.q(i), pairs.unit());
  const bool may_taper = pairs.mayTaperP() || pairs.mayTaperQ();
  for (int i = 0; i < end; i += PairBlock::kGroup) {
    take(i, may_taper ? distanceLanes<true>(pairs, relative, i)
                      : distanceLanes<false>(pairs, relative, i));
  }
}

std::uint64_t leastGaps(const CapsulePairs& pairs, float* gaps) {
  std::uint64_t known = 0;
  forGroups(pairs, [&](int i, const DistanceLanes& lanes)
                       HWY_ATTR { known |= storeGaps(lanes, gaps + i) << i; });
  return known;
}

CapsulePairs::Verdict decide(const CapsulePairs& pairs) {
  CapsulePairs::Verdict verdict;
  forGroups(pairs, [&](int i, const DistanceLanes& lanes)
                       HWY_ATTR { add(decideLanes(lanes), i, verdict); });
  return verdict;
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::geometry {

HWY_EXPORT(decide);
HWY_EXPORT(leastGaps);

CapsulePairs::Verdict CapsulePairs::decide() {
  fill(kNoCapsule, kNoCapsule);
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(decide)(*this);
}

std::uint64_t CapsulePairs::leastGaps(Row& gaps) {
  fill(kNoCapsule, kNoCapsule);
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(leastGaps)(*this, gaps.data());
}

}  // namespace fcl_fibers::geometry
#endif
