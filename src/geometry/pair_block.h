// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace fcl_fibers::geometry {

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

}  // namespace fcl_fibers::geometry
