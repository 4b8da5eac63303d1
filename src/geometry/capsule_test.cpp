// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/capsule_test.h"

#include <limits>
#include <utility>

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
  Float least_reach;        ///< radii and margin, of cones the least radii
  Float reach, error;       ///< the same with the largest radii; and the error of all points
  Float nearest, farthest;  ///< bound the distance of the points found
  Float gap, slope_error;   ///< bound together by how much its square may exceed the least one
  Float::Truth in_range;    ///< otherwise nothing is known
};
FCL_FIBERS_ALWAYS_INLINE DistanceLanes distanceLanes(const CapsulePairs& pairs,
                                                     const RelativePairs& relative, int i) {
  Vec3Lanes w, u, v;
  const Float radii = relative.w.get(i, w);
  const Float taper_p = relative.u.get(i, u), taper_q = relative.v.get(i, v);
  Float reach = radii + Float::load(pairs.margin().data() + i), least_reach = reach;
  for (const auto& [may_taper, taper] :
       {std::pair{pairs.mayTaperP(), taper_p}, std::pair{pairs.mayTaperQ(), taper_q}}) {
    if (!may_taper) continue;
    reach = reach + max(taper, Float::all(0));
    least_reach = least_reach + min(taper, Float::all(0));
  }
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
  return {least_reach,       reach, error, nearest, farthest, gap, all(2) * slope_error,
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
  return {(d.farthest <= d.least_reach * all(1 - 8 * kEps)) & d.in_range,
          (enough <= least) & d.in_range};
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

/// Bounds of the distances of rounded cones, as ConeDistance finds them. Where the points found are
/// near the closest ones, both are tight. They hold for any points, so only their rounding counts.
struct ConeLanes {
  Float farthest, least;     ///< the distances are between these
  Float least_reach, reach;  ///< bounds of the margin; the latter with the error of the points
  Float::Truth in_range;
};

class ConesInLanes {
 public:
  FCL_FIBERS_ALWAYS_INLINE ConesInLanes(const CapsulePairs& pairs, const RelativePairs& relative,
                                        int i) {
    const Float zero = Float::all(0);
    radii_ = relative.w.get(i, w_);
    taper_p_ = relative.u.get(i, u_);
    taper_q_ = relative.v.get(i, v_);
    // The second end of a capsule may have the radius of the next one.
    if (!pairs.mayTaperP()) taper_p_ = zero;
    if (!pairs.mayTaperQ()) taper_q_ = zero;
    uu_ = dot(u_, u_);
    vv_ = dot(v_, v_);
    farthest_ = Float::all(std::numeric_limits<float>::infinity());
    least_ = zero - farthest_;
  }

  FCL_FIBERS_ALWAYS_INLINE ConeLanes bounds(const CapsulePairs& pairs, int i) {
    const auto all = [](float x) HWY_ATTR { return Float::all(x); };
    const Float zero = all(0), one = all(1);
    const Float t = bestOfSecond(whereSlopesVanish());
    tryAt(bestOfFirst(t), t);
    tryAt(zero, bestOfSecond(zero));
    tryAt(one, bestOfSecond(one));
    tryAt(bestOfFirst(zero), zero);
    tryAt(bestOfFirst(one), one);
    // With e = 2^-23, which bounds a rounding in any direction, let m = |w| + |u| + |v| and r be
    // the radii and tapers together. The vector between two points carries an error of 4 e m,
    // including a conversion to float; its length another 4 e m, and the radii 6 e r. The unit
    // vector is longer than 1 by at most 5 e, and its products carry another 4 e m. The bound is
    // wider by a fifth, which covers its own rounding.
    const Float squares = dot(w_, w_) + uu_ + vv_;
    const Float m = squareRoot(all(3) * squares);
    const Float r = radii_ + max(taper_p_, zero - taper_p_) + max(taper_q_, zero - taper_q_);
    const Float rounding = all(20 * kEps) * (m + r);
    const Float margin = Float::load(pairs.margin().data() + i);
    const Float of_margin = all(8 * kEps) * max(margin, zero - margin);
    const Float error = Float::load(pairs.error().data() + i) * all(1 + 8 * kEps);
    return {farthest_ + rounding, least_ - rounding, margin - of_margin,
            (margin + of_margin) + error, isInRange(squares)};
  }

 private:
  FCL_FIBERS_ALWAYS_INLINE Float whereSlopesVanish() const {
    const Float zero = Float::all(0), one = Float::all(1), tiny = Float::all(0x1p-80f);
    const Float share = quotient(dot(u_, v_), max(vv_, tiny));
    const Vec3Lanes across = pointBetween(u_, v_, v_, zero, share);
    const Vec3Lanes apart = pointBetween(w_, v_, v_, zero, quotient(dot(v_, w_), max(vv_, tiny)));
    const Float squared = max(dot(across, across), tiny);
    const Float n_across = taper_p_ + share * taper_q_;
    const Float w_across = dot(apart, across);
    const Float in_plane =
        quotient(taper_q_ * taper_q_, max(vv_, tiny)) + quotient(n_across * n_across, squared);
    const Vec3Lanes of_lines =
        pointBetween(apart, across, across, zero, quotient(w_across, squared));
    // If the slopes vanish nowhere, any place will do.
    const Float distance =
        squareRoot(quotient(dot(of_lines, of_lines), max(one - in_plane, Float::all(0x1p-20f))));
    return quotientInUnitInterval(distance * n_across - w_across, squared);
  }

  FCL_FIBERS_ALWAYS_INLINE Float bestOfSecond(const Float& s) const {
    return bestOnCone(pointBetween(w_, u_, u_, s, Float::all(0)), v_, vv_, taper_q_);
  }
  FCL_FIBERS_ALWAYS_INLINE Float bestOfFirst(const Float& t) const {
    const Float zero = Float::all(0);
    return bestOnCone(pointBetween({zero - w_.x, zero - w_.y, zero - w_.z}, v_, v_, t, zero), u_,
                      uu_, taper_p_);
  }

  FCL_FIBERS_ALWAYS_INLINE void tryAt(const Float& s, const Float& t) {
    const Float zero = Float::all(0);
    const Vec3Lanes r = pointBetween(w_, u_, v_, s, t);
    const Float length = squareRoot(dot(r, r));
    // Where the axes meet, the unit vector becomes 0, which is right, too.
    const Float scale = quotient(Float::all(1), max(length, Float::all(0x1p-60f)));
    farthest_ = min(farthest_, length - (radii_ + s * taper_p_ + t * taper_q_));
    const Float along_u = scale * dot(u_, r) - taper_p_, along_v = scale * dot(v_, r) + taper_q_;
    least_ = max(least_, scale * dot(w_, r) - radii_ + min(along_u, zero) - max(along_v, zero));
  }

  Vec3Lanes w_, u_, v_;
  Float radii_, taper_p_, taper_q_, uu_, vv_;
  Float farthest_, least_;
};

FCL_FIBERS_ALWAYS_INLINE VerdictLanes decideLanes(const ConeLanes& d) {
  return {(d.farthest <= d.least_reach) & d.in_range, (d.reach <= d.least) & d.in_range};
}

FCL_FIBERS_ALWAYS_INLINE std::uint64_t storeGaps(const ConeLanes& d, float* gaps) {
  const auto all = [](float x) HWY_ATTR { return Float::all(x); };
  const Float least = (d.least - d.reach) * all(1 - 8 * kEps);
  least.storeAligned(gaps);
  const auto is_tight = (d.farthest - d.least_reach) * all(31.0f / 32) <= least;
  return (is_tight & (all(0) <= least) & d.in_range).mask();
}

/// Calls take(i, relative) for the groups of pairs that begin at i.
template <class Take>
FCL_FIBERS_ALWAYS_INLINE void forGroups(const CapsulePairs& pairs, Take&& take) {
  // All loads come first: in between, they would wait with the divisions and roots.
  RelativePairs relative;
  const int end = pairs.filledSize();
  for (int i = 0; i < end; ++i) relative.set(i, pairs.p(i), pairs.q(i), pairs.unit());
  for (int i = 0; i < end; i += PairBlock::kGroup) take(i, relative);
}

std::uint64_t leastGaps(const CapsulePairs& pairs, float* gaps) {
  std::uint64_t known = 0;
  const bool are_cones = pairs.mayTaperP() || pairs.mayTaperQ();
  forGroups(pairs, [&](int i, const RelativePairs& relative) HWY_ATTR {
    const std::uint64_t are_known =
        are_cones ? storeGaps(ConesInLanes(pairs, relative, i).bounds(pairs, i), gaps + i)
                  : storeGaps(distanceLanes(pairs, relative, i), gaps + i);
    known |= are_known << i;
  });
  return known;
}

CapsulePairs::Verdict decide(const CapsulePairs& pairs) {
  CapsulePairs::Verdict verdict;
  forGroups(pairs, [&](int i, const RelativePairs& relative) HWY_ATTR {
    add(decideLanes(distanceLanes(pairs, relative, i)), i, verdict);
  });
  return verdict;
}

CapsulePairs::Verdict decideCones(const CapsulePairs& pairs) {
  CapsulePairs::Verdict verdict;
  forGroups(pairs, [&](int i, const RelativePairs& relative) HWY_ATTR {
    add(decideLanes(ConesInLanes(pairs, relative, i).bounds(pairs, i)), i, verdict);
  });
  return verdict;
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::geometry {

HWY_EXPORT(decide);
HWY_EXPORT(decideCones);
HWY_EXPORT(leastGaps);

CapsulePairs::Verdict CapsulePairs::decide() {
  fill(kNoCapsule, kNoCapsule);
  simd::readEnvironment();
  Verdict verdict = HWY_DYNAMIC_DISPATCH(decide)(*this);
  const auto decideCones = [](const CapsulePairs& left) {
    return HWY_DYNAMIC_DISPATCH(decideCones)(left);
  };
  decideOpen(CapsulePairs(unit()), kNoCapsule, kNoCapsule, decideCones, verdict);
  return verdict;
}

std::uint64_t CapsulePairs::leastGaps(Row& gaps) {
  fill(kNoCapsule, kNoCapsule);
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(leastGaps)(*this, gaps.data());
}

}  // namespace fcl_fibers::geometry
#endif
