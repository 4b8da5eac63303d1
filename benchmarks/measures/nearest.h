// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>

#include <fcl/narrowphase/distance.h>

#include "contenders/moving_fibers.h"

namespace fcl_fibers::benchmarks {

/// The nearest pair so far.
struct Nearest {
  /// Segments of each fiber, whose neighbours are left out because they always touch; 0: all count.
  std::size_t fiber_segments = 0;
  double distance = std::numeric_limits<double>::infinity();

  bool leavesOut(const Object* a, const Object* b) const {
    if (fiber_segments == 0) return false;
    const auto [i, j] = std::minmax({MovingFibers::index(a), MovingFibers::index(b)});
    return j - i == 1 && j % fiber_segments != 0;
  }

  static bool callback(Object* a, Object* b, void* data, double& distance) {
    auto& nearest = *static_cast<Nearest*>(data);
    if (!nearest.leavesOut(a, b)) {
      fcl::DistanceResultd result;
      nearest.distance =
          std::min(nearest.distance, fcl::distance(a, b, fcl::DistanceRequestd(), result));
    }
    distance = nearest.distance;
    return distance <= 0;
  }
};

}  // namespace fcl_fibers::benchmarks
