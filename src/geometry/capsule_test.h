// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "geometry/segment.h"
#include "simd/always_inline.h"

namespace fcl_fibers::geometry {

/// An end of a capsule. A capsule is two ends, one after the other, and the first one has its
/// radius; a rounded cone has a radius at each. So a chain of either needs one end for each of its
/// points. An end is loaded as one vector. A box is two ends that it shares with none.
struct alignas(32) CapsuleEnd {
  /// x, y, z, and the radius: of the capsule that begins here or, of rounded cones, at this end. At
  /// the first end of a box it is NaN, and at the second one it is Segment::radius.
  double numbers[4];
};

FCL_FIBERS_ALWAYS_INLINE CapsuleEnd firstEndOf(const Segment& s) {
  const double radius = s.isBox() ? std::numeric_limits<double>::quiet_NaN() : s.radiusAtA();
  return {{s.a.x, s.a.y, s.a.z, radius}};
}
FCL_FIBERS_ALWAYS_INLINE CapsuleEnd secondEndOf(const Segment& s) {
  return {{s.b.x, s.b.y, s.b.z, s.radiusAtB()}};
}
/// A capsule of size 0 at the origin.
constexpr CapsuleEnd kNoCapsule[2] = {};
FCL_FIBERS_ALWAYS_INLINE bool isBox(const CapsuleEnd* capsule) {
  return capsule->numbers[3] != capsule->numbers[3];
}
/// @param may_taper  whether the two ends are those of a rounded cone
FCL_FIBERS_ALWAYS_INLINE Segment segmentOf(const CapsuleEnd* capsule, bool may_taper) {
  const double *const a = capsule[0].numbers, *const b = capsule[1].numbers;
  Segment segment{{a[0], a[1], a[2]}, {b[0], b[1], b[2]}, isBox(capsule) ? b[3] : a[3]};
  if (may_taper && !isBox(capsule)) {
    segment.radius = std::max(a[3], b[3]);
    segment.taper = b[3] - a[3];
  }
  return segment;
}

/// A block of pairs, many of which are tested at a time in float. The coordinates of each pair are
/// relative to one of its own points, so no digits are lost far from the origin.
class PairBlock {
 public:
  static constexpr int kCapacity = 64;
  static constexpr int kGroup = 16;  ///< the tests take this many pairs at a time

  /// Tells whether each pair touches, is apart, or is too close to decide in float. A decision is
  /// the one that touch() makes, and the same on every instruction set.
  struct Verdict {
    std::uint64_t touching = 0, apart = 0;  ///< a bit for each pair
  };

  /// The unit for pairs whose usual segment has this size.
  static double unitFor(double size) {
    return std::isfinite(size) && size > 0 ? std::ldexp(1.0, -std::ilogb(size)) : 1;
  }

  /// Whether one bound of this size, in the unit, serves for the errors of all pairs: float's own
  /// rounding is larger.
  static bool isSmall(double error) { return error <= 0x1p-26; }

  int size() const { return size_; }
  void clear() { size_ = 0; }

  double unit() const { return unit_; }

 protected:
  /// @param unit  a power of two that brings the usual pair to a size of about one; pairs that are
  ///              2^20 times larger or smaller stay undecided
  explicit PairBlock(double unit) : unit_(unit) {}

  std::size_t index() const { return static_cast<std::size_t>(size_); }
  /// Infinity beyond float's range. A margin that large makes the pair touch, as it should.
  float toFloat(double x) const { return static_cast<float>(unit_ * x); }

  double unit_;
  int size_ = 0;
};

/// A block of pairs of a P and a Q, which are handles of what the pairs borrow.
template <class P, class Q>
class PairsOf : public PairBlock {
 public:
  explicit PairsOf(double unit) : PairBlock(unit) {}

  /// @pre size() < kCapacity
  /// @param p, q    what they lead to is borrowed until decide() has been called; a box leaves the
  ///                pair undecided
  /// @param margin  pairs this close count as touching
  /// @param error   bounds the error of all points of the pair together, at any time
  FCL_FIBERS_ALWAYS_INLINE void add(const P& p, const Q& q, double margin, double error) {
    p_[index()] = p;
    q_[index()] = q;
    margin_[index()] = toFloat(margin);
    error_[index()] = toFloat(error);
    ++size_;
  }

  using Row = std::array<float, kCapacity>;
  const P& p(int i) const { return p_[static_cast<std::size_t>(i)]; }
  const Q& q(int i) const { return q_[static_cast<std::size_t>(i)]; }
  const Row& margin() const { return margin_; }
  const Row& error() const { return error_; }
  /// Whether the segments P and Q may be tapered, so that both ends of each have a radius. It is
  /// false unless it has been set.
  ///@{
  bool mayTaperP() const { return may_taper_p_; }
  bool mayTaperQ() const { return may_taper_q_; }
  void setMayTaper(bool p, bool q) {
    may_taper_p_ = p;
    may_taper_q_ = q;
  }
  ///@}
  /// The number of pairs with those that fill the last group.
  int filledSize() const { return (size_ + kGroup - 1) / kGroup * kGroup; }

 protected:
  /// Fills the last group with a pair.
  void fill(const P& p, const Q& q) {
    for (std::size_t i = index(); i % kGroup != 0; ++i) {
      p_[i] = p;
      q_[i] = q;
      margin_[i] = error_[i] = 0;
    }
  }

 private:
  std::array<P, kCapacity> p_;
  std::array<Q, kCapacity> q_;
  alignas(64) Row margin_;
  alignas(64) Row error_;
  bool may_taper_p_ = false, may_taper_q_ = false;
};

/// A block of pairs of capsules or rounded cones.
class CapsulePairs : public PairsOf<const CapsuleEnd*, const CapsuleEnd*> {
 public:
  using PairsOf::PairsOf;
  Verdict decide();

  /// Writes how much further apart pairs are than the margin and the error, in the unit: a lower
  /// bound, which is at most a thirty-second of the gap below it.
  /// @param gaps  on a boundary of 64 bytes
  /// @return a bit for each pair of which float can tell it, and which is apart
  std::uint64_t leastGaps(Row& gaps);
};

}  // namespace fcl_fibers::geometry
