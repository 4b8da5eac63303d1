// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "geometry/enclosing_sphere.h"
#include "measures/paper/chain_tree.h"

namespace fcl_fibers::benchmarks {

// A kind of volume encloses one capsule, and either the volumes of two children (kLayered) or all
// capsules below (wrapped, in the words of Sobottka, Varnik and Weber, 2005, section 2.3). size()
// only has to order volumes of the same kind.
//
// Fits and tests round to nearest. The measure thickens every capsule beforehand by more than all
// of these roundings, see thickened().

/// The capsules, thickened by 16,384 roundings of the largest coordinate. A volume is the last of
/// at most 64 layers, each of which moves its surface by less than 128 roundings, and a test of two
/// of them takes the rest. That is some 1e-8 of the radius of a hair on a head.
inline std::vector<Capsule> thickened(std::vector<Capsule> capsules) {
  double largest = 0;
  for (const Capsule& c : capsules) {
    const double reach = std::max(c.from.lpNorm<Eigen::Infinity>(), c.to.lpNorm<Eigen::Infinity>());
    largest = std::max(largest, reach + c.radius);
  }
  for (Capsule& c : capsules) c.radius += 16384 * std::numeric_limits<double>::epsilon() * largest;
  return capsules;
}

/// The directions of a polytope's slabs, each by its signs along the axes: the axes, then those to
/// the corners of a cube, then those to the midpoints of its edges.
template <bool kCorners, bool kEdges>
struct SlabDirections {
  static constexpr std::size_t kCount = 3 + (kCorners ? 4 : 0) + (kEdges ? 6 : 0);
  using Signs = std::array<double, 3>;

  static constexpr std::array<Signs, kCount> all() {
    constexpr std::array<Signs, 13> directions = {{{1, 0, 0},
                                                   {0, 1, 0},
                                                   {0, 0, 1},
                                                   {1, 1, 1},
                                                   {1, 1, -1},
                                                   {1, -1, 1},
                                                   {1, -1, -1},
                                                   {1, 1, 0},
                                                   {1, -1, 0},
                                                   {1, 0, 1},
                                                   {1, 0, -1},
                                                   {0, 1, 1},
                                                   {0, 1, -1}}};
    std::array<Signs, kCount> chosen{};
    for (std::size_t i = 0; i < kCount; ++i) {
      chosen[i] = directions[i < 3 || kCorners ? i : i + 4];
    }
    return chosen;
  }
};

/// A discrete orientation polytope (Klosowski, Held, Mitchell, Sowizral and Zikan, 1998) of two
/// directions per slab. The least one around two is also the least around all that is in them.
template <bool kCorners, bool kEdges>
struct SlabPolytope {
  using Directions = SlabDirections<kCorners, kEdges>;
  static constexpr bool kLayered = true;

  std::array<double, Directions::kCount> low, high;

  static SlabPolytope around(const Capsule& c) {
    constexpr auto kDirections = Directions::all();
    SlabPolytope polytope;
    for (std::size_t i = 0; i < kDirections.size(); ++i) {
      const auto& d = kDirections[i];
      const double from = d[0] * c.from.x() + d[1] * c.from.y() + d[2] * c.from.z();
      const double to = d[0] * c.to.x() + d[1] * c.to.y() + d[2] * c.to.z();
      // The directions are no unit vectors, so a ball reaches as far as its radius times the
      // length.
      const double reach = c.radius * std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      polytope.low[i] = std::min(from, to) - reach;
      polytope.high[i] = std::max(from, to) + reach;
    }
    return polytope;
  }
  static SlabPolytope around(const SlabPolytope& p, const SlabPolytope& q) {
    SlabPolytope polytope;
    for (std::size_t i = 0; i < p.low.size(); ++i) {
      polytope.low[i] = std::min(p.low[i], q.low[i]);
      polytope.high[i] = std::max(p.high[i], q.high[i]);
    }
    return polytope;
  }

  /// All polytopes have the same one as their boxes, so that they open the same nodes.
  double size() const { return (high[0] - low[0]) + (high[1] - low[1]) + (high[2] - low[2]); }

  friend bool overlaps(const SlabPolytope& p, const SlabPolytope& q) {
    for (std::size_t i = 0; i < p.low.size(); ++i) {
      if (p.low[i] > q.high[i] || q.low[i] > p.high[i]) return false;
    }
    return true;
  }
};

using AxisBox = SlabPolytope<false, false>;
using Polytope14 = SlabPolytope<true, false>;
using Polytope18 = SlabPolytope<false, true>;
using Polytope26 = SlabPolytope<true, true>;

/// A box of which a query opens the one of larger volume, as the paper does.
struct BoxByVolume : AxisBox {
  static BoxByVolume around(const Capsule& c) { return {AxisBox::around(c)}; }
  static BoxByVolume around(const BoxByVolume& p, const BoxByVolume& q) {
    return {AxisBox::around(p, q)};
  }
  double size() const { return (high[0] - low[0]) * (high[1] - low[1]) * (high[2] - low[2]); }
};

inline geometry::Vec3d asVec3(const fcl::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

inline geometry::Ball ballAround(const Capsule& c) {
  const fcl::Vector3d middle = 0.5 * (c.from + c.to);
  return {asVec3(middle), 0.5 * (c.to - c.from).norm() + c.radius};
}

struct BallVolume {
  geometry::Ball ball;

  double size() const { return ball.radius; }

  friend bool overlaps(const BallVolume& p, const BallVolume& q) {
    const double reach = p.ball.radius + q.ball.radius;
    return squaredNorm(q.ball.center - p.ball.center) <= reach * reach;
  }
};

/// The least ball around the balls of both children.
struct LayeredBall : BallVolume {
  static constexpr bool kLayered = true;

  static LayeredBall around(const Capsule& c) { return {{ballAround(c)}}; }
  static LayeredBall around(const LayeredBall& p, const LayeredBall& q) {
    const geometry::Vec3d between = q.ball.center - p.ball.center;
    const double distance = norm(between);
    if (distance + q.ball.radius <= p.ball.radius) return p;
    if (distance + p.ball.radius <= q.ball.radius) return q;
    const double radius = 0.5 * (distance + p.ball.radius + q.ball.radius);
    const double part = (radius - p.ball.radius) / distance;
    return {{{p.ball.center + part * between, radius}}};
  }
};

/// The least ball around all capsules below, which are the hulls of the balls at their ends.
struct WrappedBall : BallVolume {
  static constexpr bool kLayered = false;

  static WrappedBall around(const Capsule& c) { return {{ballAround(c)}}; }
  static WrappedBall around(CapsuleRange capsules) {
    std::vector<geometry::Ball> balls;
    balls.reserve(2 * capsules.size());
    for (const Capsule& c : capsules) {
      balls.push_back({asVec3(c.from), c.radius});
      balls.push_back({asVec3(c.to), c.radius});
    }
    return {{enclosingSphere(balls.data(), static_cast<int>(balls.size())).ball}};
  }
};

}  // namespace fcl_fibers::benchmarks
