// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace fcl_fibers::geometry {

// Bounds are kept as floats, whatever the scene's scalar: half the memory, twice the lanes. They
// are moved outward by one ulp of float before they are rounded, so by one to two in all, and by
// the smallest normal float, so that nothing depends on how the machine treats subnormals.

inline float nearestFloat(double x) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  return static_cast<float>(std::min(std::max(x, -kLargest), kLargest));
}

/// A float not above x, -infinity below the range of float.
inline float roundedDown(double x) {
  constexpr double kUlp = std::numeric_limits<float>::epsilon();
  constexpr double kLeast = std::numeric_limits<float>::min();
  constexpr double kLargest = std::numeric_limits<float>::max();
  const double below = x - (std::fabs(x) * kUlp + kLeast);
  return static_cast<float>(below < kLargest ? below : kLargest);  // also where x is infinite
}

/// A float not below x, infinity above the range of float.
inline float roundedUp(double x) { return -roundedDown(-x); }

}  // namespace fcl_fibers::geometry
