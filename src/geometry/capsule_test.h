// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include "geometry/pair_block.h"
#include "geometry/segment.h"
#include "simd/always_inline.h"

namespace fcl_fibers::geometry {

/// An end of a capsule. A capsule is two ends, one after the other, and the first one has its
/// radius. So a chain of capsules needs one end for each of its points. An end is loaded as one
/// vector. A box is two ends that it shares with none.
struct alignas(32) CapsuleEnd {
  /// x, y, z, and the radius of the capsule that begins here. At the first end of a box the latter
  /// is NaN, and at the second one it is Segment::radius.
  double numbers[4];
};

FCL_FIBERS_ALWAYS_INLINE CapsuleEnd firstEndOf(const Segment& s) {
  return {{s.a.x, s.a.y, s.a.z, s.isBox() ? std::numeric_limits<double>::quiet_NaN() : s.radius}};
}
FCL_FIBERS_ALWAYS_INLINE CapsuleEnd secondEndOf(const Segment& s) {
  return {{s.b.x, s.b.y, s.b.z, s.isBox() ? s.radius : 0}};
}
/// A capsule of size 0 at the origin.
constexpr CapsuleEnd kNoCapsule[2] = {};
FCL_FIBERS_ALWAYS_INLINE bool isBox(const CapsuleEnd* capsule) {
  return capsule->numbers[3] != capsule->numbers[3];
}
FCL_FIBERS_ALWAYS_INLINE Segment segmentOf(const CapsuleEnd* capsule) {
  const double *const a = capsule[0].numbers, *const b = capsule[1].numbers;
  return {{a[0], a[1], a[2]}, {b[0], b[1], b[2]}, isBox(capsule) ? b[3] : a[3]};
}

/// A block of pairs of capsules.
class CapsulePairs : public PairsOf<const CapsuleEnd*, const CapsuleEnd*> {
 public:
  using PairsOf::PairsOf;
  Verdict decide();
};

}  // namespace fcl_fibers::geometry
