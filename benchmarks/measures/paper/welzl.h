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

/// The least sphere around balls of equal radii by the algorithm of Welzl, Smallest enclosing disks
/// (balls and ellipsoids), 1991, for the centres. It is wrong for balls of other radii (Fischer and
/// Gaertner, 2003).
class Welzl {
 public:
  /// The order in which balls are taken: a random one, which makes the expected time linear; that
  /// in which they are given; or that one at first, in which a ball that stands out moves to the
  /// front, as Welzl suggests.
  enum class Order { kRandom, kGiven, kToFront };

  Welzl(Order order, std::uint64_t seed) : kind_(order), random_(seed) {}

  geometry::EnclosingSphere around(const geometry::Ball* balls, int count) {
    balls_ = balls;
    order_.resize(static_cast<std::size_t>(count));
    std::iota(order_.begin(), order_.end(), 0);
    if (kind_ == Order::kRandom) std::shuffle(order_.begin(), order_.end(), random_);
    sphere_ = {{balls[order_[0]].center, 0}, {}};
    grow(order_.size(), 0);
    return enclosing(count);
  }

  std::size_t tests = 0;  ///< of a ball against a sphere

 private:
  /// The least sphere around the first `end` balls with the `depth` balls of the basis on it.
  void grow(std::size_t end, int depth) {
    if (depth > 0 && !passThroughBasis(depth)) return;
    if (depth == 4) return;
    for (std::size_t i = 0; i < end; ++i) {
      const int next = order_[i];
      if (isInside(balls_[next])) continue;
      basis_[static_cast<std::size_t>(depth)] = next;
      grow(i, depth + 1);
      if (kind_ == Order::kToFront) {
        const auto at = order_.begin() + static_cast<std::ptrdiff_t>(i);
        std::rotate(order_.begin(), at, at + 1);
      }
    }
  }

  /// Rounding may leave none, among centres that are nearly on a line. Then the sphere stays.
  bool passThroughBasis(int depth) {
    const geometry::Ball* members[4] = {};
    for (std::size_t i = 0; i < static_cast<std::size_t>(depth); ++i) {
      members[i] = balls_ + basis_[i];
    }
    const auto support = geometry::supportSphere(members, depth);
    if (!support) return false;
    sphere_ = {support->ball, {basis_, depth}};
    return true;
  }

  bool isInside(const geometry::Ball& ball) {
    ++tests;
    const double slack = sphere_.ball.radius * (1 + kTolerance) - ball.radius;
    return slack >= 0 && squaredNorm(ball.center - sphere_.ball.center) <= slack * slack;
  }

  /// Rounding may leave balls out, so the sphere grows to them.
  geometry::EnclosingSphere enclosing(int count) const {
    geometry::EnclosingSphere result = sphere_;
    for (int i = 0; i < count; ++i) {
      const double reach = norm(balls_[i].center - sphere_.ball.center) + balls_[i].radius;
      result.ball.radius = std::max(result.ball.radius, reach);
    }
    return result;
  }

  static constexpr double kTolerance = 1e-12;
  Order kind_;
  std::mt19937_64 random_;
  const geometry::Ball* balls_ = nullptr;
  std::vector<int> order_;
  std::array<int, 4> basis_{};
  geometry::EnclosingSphere sphere_{};
};

}  // namespace fcl_fibers::benchmarks
