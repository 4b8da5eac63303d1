// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
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
FCL_FIBERS_ALWAYS_INLINE bool isBox(const CapsuleEnd* capsule) {
  return capsule->numbers[3] != capsule->numbers[3];
}
FCL_FIBERS_ALWAYS_INLINE Segment segmentOf(const CapsuleEnd* capsule) {
  const double *const a = capsule[0].numbers, *const b = capsule[1].numbers;
  return {{a[0], a[1], a[2]}, {b[0], b[1], b[2]}, isBox(capsule) ? b[3] : a[3]};
}

/// A block of pairs of capsules.
class CapsulePairs : public PairBlock {
 public:
  explicit CapsulePairs(double unit) : PairBlock(unit) {}

  /// @pre size() < kCapacity
  /// @param p, q    borrowed until decide() has been called; a box leaves the pair undecided
  /// @param margin  pairs this close count as touching
  /// @param error   bounds the error of all four end points together
  FCL_FIBERS_ALWAYS_INLINE void add(const CapsuleEnd* p, const CapsuleEnd* q, double margin,
                                    double error) {
    p_[index()] = p;
    q_[index()] = q;
    margin_[index()] = toFloat(margin);
    error_[index()] = toFloat(error);
    ++size_;
  }

  Verdict decide();

  using Row = std::array<float, kCapacity>;
  const CapsuleEnd* p(int i) const { return p_[static_cast<std::size_t>(i)]; }
  const CapsuleEnd* q(int i) const { return q_[static_cast<std::size_t>(i)]; }
  const Row& margin() const { return margin_; }
  const Row& error() const { return error_; }

 private:
  std::array<const CapsuleEnd*, kCapacity> p_, q_;
  alignas(64) Row margin_;
  alignas(64) Row error_;
};

}  // namespace fcl_fibers::geometry
