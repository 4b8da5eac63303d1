// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "geometry/enclosing_sphere.h"
#include "measures/paper/chain_tree.h"

namespace fcl_fibers::benchmarks {

// Volumes enclose one capsule, or the volumes of two children. Fits and tests round to nearest.

struct AxisBox {
  std::array<double, 3> low, high;

  static AxisBox around(const Capsule& c) {
    AxisBox box;
    for (std::size_t k = 0; k < 3; ++k) {
      const double from = c.from[static_cast<int>(k)], to = c.to[static_cast<int>(k)];
      box.low[k] = std::min(from, to) - c.radius;
      box.high[k] = std::max(from, to) + c.radius;
    }
    return box;
  }
  static AxisBox around(const AxisBox& p, const AxisBox& q) {
    AxisBox box;
    for (std::size_t k = 0; k < 3; ++k) {
      box.low[k] = std::min(p.low[k], q.low[k]);
      box.high[k] = std::max(p.high[k], q.high[k]);
    }
    return box;
  }
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

}  // namespace fcl_fibers::benchmarks
