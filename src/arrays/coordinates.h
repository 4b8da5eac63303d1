// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>

#include "fibers/options.h"

namespace fcl_fibers::arrays {

/// Returns the largest magnitude of some numbers; it is not finite if any of them is not. The bits
/// of magnitudes have the order of the numbers, and NaN comes last. They are compared without a
/// branch.
template <typename S>
double largestMagnitude(const S* numbers, std::size_t count) {
  using Bits = std::conditional_t<sizeof(S) == 8, std::uint64_t, std::uint32_t>;
  constexpr Bits kMagnitude = ~Bits{0} >> 1;
  constexpr std::size_t kLanes = 8;
  Bits largest[kLanes] = {};
  const auto take = [&](std::size_t i, std::size_t lane) {
    Bits bits;
    std::memcpy(&bits, numbers + i, sizeof(bits));
    largest[lane] = std::max(largest[lane], bits & kMagnitude);
  };
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) take(i + lane, lane);
  }
  for (; i < count; ++i) take(i, 0);
  const Bits bits = *std::max_element(largest, largest + kLanes);
  S result;
  std::memcpy(&result, &bits, sizeof(result));
  return static_cast<double>(result);
}

/// Returns the largest magnitude of the coordinates of `count` points. Throws std::invalid_argument
/// if one of them is NaN or infinite.
template <typename S>
double largestCoordinate(const char* call, const S* points, std::size_t count) {
  const double largest = largestMagnitude(points, 3 * count);
  if (std::isfinite(largest)) return largest;
  const S* const bad =
      std::find_if(points, points + 3 * count, [](S x) { return !std::isfinite(x); });
  fibers::throwInvalidArgument(call, "point " + std::to_string((bad - points) / 3) +
                                         " is NaN or infinite; give it finite coordinates");
}

}  // namespace fcl_fibers::arrays
