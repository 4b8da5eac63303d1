// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <random>
#include <vector>

#include "geometry/enclosing_sphere.h"

namespace fcl_fibers::benchmarks {

/// Finds the least sphere around balls of equal radii, which is that around their centres, by the
/// algorithm of Welzl, Smallest enclosing disks (balls and ellipsoids), 1991. For balls of other
/// radii the algorithm is wrong (Fischer and Gaertner, 2003).
class Welzl {
 public:
  /// The order in which balls are taken: a random one, which makes the expected time linear; or
  /// that in which they are given, where a ball that stands out moves to the front, as Welzl
  /// suggests.
  enum class Order { kRandom, kToFront };

  Welzl(Order order, std::uint64_t seed) : order_(order), random_(seed) {}

  geometry::EnclosingSphere around(const geometry::Ball* balls, int count) {
    balls_ = balls;
    sequence_.resize(static_cast<std::size_t>(count));
    std::iota(sequence_.begin(), sequence_.end(), 0);
    if (order_ == Order::kRandom) std::shuffle(sequence_.begin(), sequence_.end(), random_);
    sphere_ = {{balls[sequence_[0]].center, 0}, {}};
    is_exact_ = true;
    grow(sequence_.size(), 0);
    if (!is_exact_) return enclosing(count);
    sphere_.ball.radius *= 1 + 2 * kTolerance;
    return sphere_;
  }

  std::size_t tests = 0;  ///< of a ball against a sphere

 private:
  /// The least sphere around the first `end` balls with the `depth` balls of the basis on it.
  void grow(std::size_t end, int depth) {
    if (depth > 0 && !passThroughBasis(depth)) return;
    if (depth == 4) return;
    for (std::size_t i = 0; i < end; ++i) {
      const int next = sequence_[i];
      if (isInside(balls_[next])) continue;
      basis_[static_cast<std::size_t>(depth)] = next;
      grow(i, depth + 1);
      if (order_ == Order::kToFront) {
        const auto at = sequence_.begin() + static_cast<std::ptrdiff_t>(i);
        std::rotate(sequence_.begin(), at, at + 1);
      }
    }
  }

  /// Rounding may leave no sphere through centres that are nearly on a line. Then the sphere stays.
  bool passThroughBasis(int depth) {
    const geometry::Ball* members[4] = {};
    for (std::size_t i = 0; i < static_cast<std::size_t>(depth); ++i) {
      members[i] = balls_ + basis_[i];
    }
    const auto support = geometry::supportSphere(members, depth);
    if (!support) return is_exact_ = false;
    sphere_ = {support->ball, {basis_, depth}};
    return true;
  }

  bool isInside(const geometry::Ball& ball) {
    ++tests;
    const double slack = sphere_.ball.radius * (1 + kTolerance) - ball.radius;
    return slack >= 0 && squaredNorm(ball.center - sphere_.ball.center) <= slack * slack;
  }

  /// Makes the sphere larger, if rounding has left balls out.
  geometry::EnclosingSphere enclosing(int count) const {
    geometry::EnclosingSphere result = sphere_;
    for (int i = 0; i < count; ++i) {
      const double reach = norm(balls_[i].center - sphere_.ball.center) + balls_[i].radius;
      result.ball.radius = std::max(result.ball.radius, reach);
    }
    return result;
  }

  static constexpr double kTolerance = 1e-12;
  Order order_;
  std::mt19937_64 random_;
  const geometry::Ball* balls_ = nullptr;
  std::vector<int> sequence_;
  std::array<int, 4> basis_{};
  bool is_exact_ = true;
  geometry::EnclosingSphere sphere_{};
};

}  // namespace fcl_fibers::benchmarks
