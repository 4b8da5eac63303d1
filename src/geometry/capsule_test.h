// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "geometry/always_inline.h"
#include "geometry/segment.h"

namespace fcl_fibers::geometry {

/// A block of pairs of capsules, to be tested many at a time in float. Each pair is kept relative
/// to itself, so that nothing is lost far from the origin.
class CapsulePairs {
 public:
  static constexpr int kCapacity = 64;

  /// @param unit  a power of two that brings the scene's usual segment to a size of the order of
  ///              one; pairs 2^20 times larger or smaller are left undecided
  explicit CapsulePairs(double unit) : unit_(unit) {}

  int size() const { return size_; }
  void clear() { size_ = 0; }

  /// @pre size() < kCapacity
  /// @param margin  pairs this close count as touching
  /// @param error   how far the four end points together may lie from where they should
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
    // A box is no capsule: NaN lets no comparison hold.
    const bool boxed = p.isBox() || q.isBox();
    reach_[index()] = boxed ? __builtin_nanf("") : toFloat(p.radius + q.radius + margin);
    error_[index()] = toFloat(error);
    ++size_;
  }

  /// For each pair whether it touches, does not, or is too close to call in float: as touch() would
  /// say with its double arithmetic. The same on every instruction set.
  struct Verdict {
    std::array<std::uint8_t, kCapacity / 8> touching;  ///< one bit a pair
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
  /// Out of float's range the conversion gives infinity, which no comparison lets pass.
  float toFloat(double x) const { return static_cast<float>(unit_ * x); }

  double unit_;
  int size_ = 0;
  alignas(64) Row w_[3];  ///< from the second capsule's first end to the first's
  alignas(64) Row u_[3];  ///< along the first
  alignas(64) Row v_[3];  ///< along the second
  alignas(64) Row reach_;
  alignas(64) Row error_;
};

}  // namespace fcl_fibers::geometry
