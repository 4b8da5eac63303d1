// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "geometry/segment.h"
#include "simd/always_inline.h"

namespace fcl_fibers::geometry {

/// A block of pairs of capsules, which are tested many at a time in float. Each pair is kept
/// relative to one of its own points, so nothing is lost far from the origin.
class CapsulePairs {
 public:
  static constexpr int kCapacity = 64;

  /// @param unit  a power of two that brings the usual segment to a size of about one; pairs that
  ///              are 2^20 times larger or smaller stay undecided
  explicit CapsulePairs(double unit) : unit_(unit) {}

  int size() const { return size_; }
  void clear() { size_ = 0; }

  /// @pre size() < kCapacity
  /// @param margin  pairs this close count as touching
  /// @param error   bounds the error of all four end points together
  FCL_FIBERS_ALWAYS_INLINE void add(const Segment& p, const Segment& q, double margin,
                                    double error) {
    const auto put = [&](std::array<float, kCapacity>* row, const Vec3d& v) {
      row[0][index()] = toFloat(v.x);
      row[1][index()] = toFloat(v.y);
      row[2][index()] = toFloat(v.z);
    };
    put(w_, p.a - q.a);
    put(u_, p.b - p.a);
    put(v_, q.b - q.a);
    // A box is not a capsule: with NaN no comparison holds, so the pair stays undecided.
    const bool boxed = p.isBox() || q.isBox();
    reach_[index()] = boxed ? __builtin_nanf("") : toFloat(p.radius + q.radius + margin);
    error_[index()] = toFloat(error);
    ++size_;
  }

  /// Whether each pair touches, is apart, or is too close to decide in float. A decision is that of
  /// touch(), and the same on every instruction set.
  struct Verdict {
    std::array<std::uint8_t, kCapacity / 8> touching;  ///< one bit per pair
    std::array<std::uint8_t, kCapacity / 8> apart;
  };
  Verdict decide();

  // For the kernel.
  using Row = std::array<float, kCapacity>;
  const Row& w(int axis) const { return w_[axis]; }
  const Row& u(int axis) const { return u_[axis]; }
  const Row& v(int axis) const { return v_[axis]; }
  const Row& reach() const { return reach_; }
  const Row& error() const { return error_; }

 private:
  std::size_t index() const { return static_cast<std::size_t>(size_); }
  /// Beyond float's range the conversion gives infinity, with which no comparison holds.
  float toFloat(double x) const { return static_cast<float>(unit_ * x); }

  double unit_;
  int size_ = 0;
  alignas(64) Row w_[3];  ///< from the second capsule's first end to the first capsule's
  alignas(64) Row u_[3];  ///< along the first capsule
  alignas(64) Row v_[3];  ///< along the second capsule
  alignas(64) Row reach_;
  alignas(64) Row error_;
};

}  // namespace fcl_fibers::geometry
