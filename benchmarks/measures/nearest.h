// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>

#include <fcl/narrowphase/distance.h>

#include "contenders/moving_fibers.h"

namespace fcl_fibers::benchmarks {

/// The nearest pair so far.
struct Nearest {
  /// Segments of each fiber, whose neighbours are left out because they always touch; 0: all count.
  std::size_t fiber_segments = 0;
  /// One for all pairs, as in FCL's own callback: its search of meshes ends at what is known.
  fcl::DistanceResultd result = {};

  double distance() const { return result.min_distance; }

  bool leavesOut(const Object* a, const Object* b) const {
    if (fiber_segments == 0) return false;
    const auto [i, j] = std::minmax({MovingFibers::index(a), MovingFibers::index(b)});
    return j - i == 1 && j % fiber_segments != 0;
  }

  static bool callback(Object* a, Object* b, void* data, double& distance) {
    auto& nearest = *static_cast<Nearest*>(data);
    if (!nearest.leavesOut(a, b)) fcl::distance(a, b, fcl::DistanceRequestd(), nearest.result);
    distance = nearest.distance();
    return distance <= 0;
  }
};

}  // namespace fcl_fibers::benchmarks
