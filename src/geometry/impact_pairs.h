// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "geometry/capsule_test.h"
#include "geometry/moving_segment.h"
#include "simd/lanes.h"

namespace fcl_fibers::geometry {

/// The ends of a capsule at the start and at the end of a step.
using MovingCapsule = Moving<const CapsuleEnd*>;

/// A block of pairs of moving capsules.
class ImpactPairs : public PairsOf<MovingCapsule, MovingCapsule> {
 public:
  using PairsOf::PairsOf;
  /// Returns a bit for each pair that does not touch during the step, and finds a time for each
  /// other pair before which it does not touch.
  std::uint64_t decide();
  double from(int i) const { return double{from_[static_cast<std::size_t>(i)]}; }
  Row& from() { return from_; }

 private:
  alignas(64) Row from_;
};

/// Pairs of moving capsules, side by side for a search in double.
struct ImpactRows {
  static constexpr int kLanes = 8;

  /// The vectors w, u and v of class Pose, and how near the axes touch.
  using Instant = double[10][kLanes];
  alignas(64) Instant start, end;
  alignas(64) double from[kLanes];     ///< as in findImpact(); then a time before which it is apart
  alignas(64) double arrival[kLanes];  ///< how far out of reach a pair may be that arrives
  alignas(64) double s[kLanes], t[kLanes];
  simd::LaneMask apart, arrived;  ///< the others are undecided; those that arrived do so at `from`
};

/// Decides the pairs that a few steps of conservative advancement decide.
void advance(ImpactRows& rows);

}  // namespace fcl_fibers::geometry
