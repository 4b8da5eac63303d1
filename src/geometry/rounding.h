// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "simd/always_inline.h"

namespace fcl_fibers::geometry {

// Bounds are floats, whatever the scalar of the scene. Before rounding they are moved outward by
// one ulp of float, which makes one to two ulp in all. They are also moved by the smallest normal
// float, so that nothing depends on how the machine treats subnormals.

inline float nearestFloat(double x) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  return static_cast<float>(std::min(std::max(x, -kLargest), kLargest));
}

/// A float not above x; -infinity if x is below the range of float.
FCL_FIBERS_ALWAYS_INLINE float roundedDown(double x) {
  constexpr double kUlp = std::numeric_limits<float>::epsilon();
  constexpr double kLeast = std::numeric_limits<float>::min();
  constexpr double kLargest = std::numeric_limits<float>::max();
  const double below = x - (std::fabs(x) * kUlp + kLeast);
  return static_cast<float>(below < kLargest ? below : kLargest);  // also if x is infinite
}

/// A float not below x; infinity if x is above the range of float.
inline float roundedUp(double x) { return -roundedDown(-x); }

}  // namespace fcl_fibers::geometry
