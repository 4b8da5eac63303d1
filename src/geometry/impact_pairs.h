// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "geometry/capsule_test.h"
#include "geometry/moving_segment.h"
#include "simd/lanes.h"

namespace fcl_fibers::geometry {

/// The ends of a capsule or rounded cone at the start and at the end of a step.
using MovingCapsule = Moving<const CapsuleEnd*>;

/// A block of pairs of moving capsules or rounded cones.
class ImpactPairs : public PairsOf<MovingCapsule, MovingCapsule> {
 public:
  using PairsOf::PairsOf;
  /// As PairsOf::setMayTaper(), for the start and for the end of the step.
  void setMayTaper(Moving<bool> p, Moving<bool> q) { p_may_taper_ = p, q_may_taper_ = q; }
  const Moving<bool>& mayTaperP() const { return p_may_taper_; }
  const Moving<bool>& mayTaperQ() const { return q_may_taper_; }
  /// Returns a bit for each pair that does not touch during the step, and finds a time for each
  /// other pair before which it does not touch.
  std::uint64_t decide();
  double from(int i) const { return double{from_[static_cast<std::size_t>(i)]}; }
  Row& from() { return from_; }

 private:
  alignas(64) Row from_;
  Moving<bool> p_may_taper_{false, false}, q_may_taper_{false, false};
};

/// Pairs of moving capsules or rounded cones, side by side for a search in double.
struct ImpactRows {
  static constexpr int kLanes = 8, kNumbers = 12;

  /// The vectors w, u and v of class Pose, how near the axes touch at w, and the tapers, which are
  /// 0 unless `may_taper`.
  using Instant = double[kNumbers][kLanes];
  alignas(64) Instant start, end;
  alignas(64) double from[kLanes];     ///< as in findImpact(); then a time before which it is apart
  alignas(64) double arrival[kLanes];  ///< how far out of reach a pair may be that arrives
  alignas(64) double s[kLanes], t[kLanes];
  bool may_taper;
  simd::LaneMask apart, arrived;  ///< the others are undecided; those that arrived do so at `from`
};

/// Decides the pairs that a few steps of conservative advancement decide.
void advance(ImpactRows& rows);

}  // namespace fcl_fibers::geometry
