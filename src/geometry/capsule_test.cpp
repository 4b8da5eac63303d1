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
struct DistanceLanes {
  Float reach, error;       ///< radii and margin; and of all points
  Float nearest, farthest;  ///< bound the distance of the points found
  Float gap, slope_error;   ///< bound together by how much its square may exceed the least one
  Float::Truth in_range;    ///< otherwise nothing is known
};
FCL_FIBERS_ALWAYS_INLINE DistanceLanes distanceLanes(const CapsulePairs& pairs,
                                                     const RelativePairs& relative, int i) {
  Vec3Lanes w, u, v;
  const Float radii = relative.w.get(i, w);
  relative.u.get(i, u);
  relative.v.get(i, v);
  const Float reach = radii + Float::load(pairs.margin().data() + i);
  const Float error = Float::load(pairs.error().data() + i);
  const auto all = [](float x) HWY_ATTR { return Float::all(x); };

  const auto [s, t] = closestOfAxes(w, u, v);
  const Vec3Lanes r = pointBetween(w, u, v, s, t);
  const Float distance = squareRoot(dot(r, r));
  const Float gap = all(2) * (fall(dot(u, r), s) + fall(all(0) - dot(v, r), t));

  // With e = 2^-23, which bounds a rounding in any direction, let m = |w| + |u| + |v|, which is at
  // most sqrt(3 (|w|^2 + |u|^2 + |v|^2)). The vector r carries an error of 4 e m, including a
  // conversion to float. Its length carries another 4 e of itself, and a slope 4 e m |u| + 6 e |u|
  // |r|. Each bound below is wider by at least a fifth, which covers its own rounding.
  const Float squares = dot(w, w) + dot(u, u) + dot(v, v);
  const Float m = squareRoot(all(3) * squares);
  const Float r_error = all(5 * kEps) * m;
  const Float slope_error = m * (r_error + all(8 * kEps) * distance);

  const Float farthest = distance * all(1 + 6 * kEps) + r_error;
  const Float nearest = max(distance * all(1 - 6 * kEps) - r_error, all(0));
  return {reach, error, nearest, farthest, gap, all(2) * slope_error, isInRange(squares)};
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

std::uint64_t leastGaps(const CapsulePairs& pairs, float* gaps) {
  RelativePairs relative;
  const int end = pairs.filledSize();
  for (int i = 0; i < end; ++i) relative.set(i, pairs.p(i), pairs.q(i), pairs.unit());
  std::uint64_t known = 0;
  for (int i = 0; i < end; i += PairBlock::kGroup) {
    known |= std::uint64_t{storeGaps(distanceLanes(pairs, relative, i), gaps + i)} << i;
  }
  return known;
}

CapsulePairs::Verdict decide(const CapsulePairs& pairs) {
  // All loads come first: in between, they would wait with the divisions and roots.
  RelativePairs relative;
  const int end = pairs.filledSize();
  for (int i = 0; i < end; ++i) relative.set(i, pairs.p(i), pairs.q(i), pairs.unit());
  return verdictOfGroups(
      end, [&](int i) HWY_ATTR { return decideLanes(distanceLanes(pairs, relative, i)); });
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
