// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>

#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::tools {

/// The least box around points; infinite the wrong way around if there is none.
struct Bounds {
  Point low, high;

  Bounds() {
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-low[0]);
  }

  void add(const Point& point) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], point[k]);
      high[k] = std::max(high[k], point[k]);
    }
  }
};

}  // namespace fcl_fibers::tools
