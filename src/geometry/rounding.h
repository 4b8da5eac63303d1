// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace fcl_fibers::geometry {

// Bounds are kept as floats, whatever the scene's scalar: half the memory, twice the lanes. They
// are rounded outward by one to two ulp. The smallest normal float is added so that nothing depends
// on how the machine treats subnormals; clamping keeps infinity from turning into NaN.

inline float nearestFloat(double x) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  return static_cast<float>(std::min(std::max(x, -kLargest), kLargest));
}

inline float outwardStep(float x) {
  return std::fabs(x) * std::numeric_limits<float>::epsilon() + std::numeric_limits<float>::min();
}

/// A float not above x, -infinity below the range of float.
inline float roundedDown(double x) {
  const float nearest = nearestFloat(x);
  return nearest - outwardStep(nearest);
}

/// A float not below x, infinity above the range of float.
inline float roundedUp(double x) {
  const float nearest = nearestFloat(x);
  return nearest + outwardStep(nearest);
}

}  // namespace fcl_fibers::geometry
