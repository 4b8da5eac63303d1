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
#include "geometry/vec3.h"

namespace fcl_fibers::arrays {

/// Returns use(point, axis), the strides of FiberArrays or MeshArrays as numbers of scalars. Those
/// of packed points are constants at compile time.
template <template <typename> class Arrays, typename S, class Use>
auto withStrides(const Arrays<S>& arrays, Use&& use) {
  using Packed = std::integral_constant<std::ptrdiff_t, 3>;
  using One = std::integral_constant<std::ptrdiff_t, 1>;
  constexpr auto kSize = static_cast<std::ptrdiff_t>(sizeof(S));
  if (arrays.point_stride == 0) return use(Packed{}, One{});
  const std::ptrdiff_t axis = arrays.axis_stride;
  return use(arrays.point_stride / kSize, axis != 0 ? axis / kSize : 1);
}

/// Where x of a point is.
template <template <typename> class Arrays, typename S>
const S* addressOf(const Arrays<S>& arrays, std::size_t i) {
  return withStrides(arrays, [&](auto point, auto) {
    return arrays.points + static_cast<std::ptrdiff_t>(i) * point;
  });
}

template <template <typename> class Arrays, typename S>
geometry::Vec3d pointOf(const Arrays<S>& arrays, std::size_t i) {
  return withStrides(arrays, [&](auto point, auto axis) {
    const S* const p = arrays.points + static_cast<std::ptrdiff_t>(i) * point;
    return geometry::Vec3d{static_cast<double>(p[0]), static_cast<double>(p[axis]),
                           static_cast<double>(p[2 * axis])};
  });
}

/// Calls refuse(text), which throws, if points cannot be read where they are.
template <template <typename> class Arrays, typename S, class Refuse>
void checkStrides(const Arrays<S>& arrays, Refuse&& refuse) {
  constexpr auto kAlign = static_cast<std::ptrdiff_t>(alignof(S));
  const auto check = [&](const char* name, std::ptrdiff_t bytes) {
    if (bytes % kAlign == 0) return;
    refuse(std::string(name) + " is " + std::to_string(bytes) +
           " bytes; give a multiple of the alignment of a coordinate, " + std::to_string(kAlign));
  };
  check("point_stride", arrays.point_stride);
  check("axis_stride", arrays.axis_stride);
  if (arrays.axis_stride != 0 && arrays.point_stride == 0) {
    refuse("axis_stride is given without point_stride; give both");
  }
  if (reinterpret_cast<std::uintptr_t>(arrays.points) % alignof(S) != 0) {
    refuse("points are not aligned; their address has to be a multiple of " +
           std::to_string(kAlign));
  }
}

/// Returns the largest magnitude of numbers `step` apart; it is not finite if any of them is not.
/// The bits of magnitudes have the order of the numbers, and NaN comes last. They are compared
/// without a branch.
template <typename S, class Step>
double largestMagnitude(const S* numbers, std::size_t count, Step step) {
  using Bits = std::conditional_t<sizeof(S) == 8, std::uint64_t, std::uint32_t>;
  constexpr Bits kMagnitude = ~Bits{0} >> 1;
  constexpr std::size_t kLanes = 8;
  Bits largest[kLanes] = {};
  const auto take = [&](std::size_t i, std::size_t lane) {
    Bits bits;
    std::memcpy(&bits, numbers + static_cast<std::ptrdiff_t>(i) * step, sizeof(bits));
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

/// Returns the largest magnitude of the coordinates of the points [begin, end). It is not finite if
/// one of them is not.
template <template <typename> class Arrays, typename S>
double largestCoordinate(const Arrays<S>& arrays, std::size_t begin, std::size_t end) {
  if (begin >= end) return 0;  // the points may be null
  return withStrides(arrays, [&](auto point, auto axis) {
    const S* const first = arrays.points + static_cast<std::ptrdiff_t>(begin) * point;
    const std::size_t count = end - begin;
    if (point == 3 * axis) return largestMagnitude(first, 3 * count, axis);
    double most = 0;
    for (int k = 0; k < 3 && std::isfinite(most); ++k) {
      const double magnitude = largestMagnitude(first + k * axis, count, point);
      if (!(magnitude <= most)) most = magnitude;
    }
    return most;
  });
}

/// Throws std::invalid_argument if a coordinate of the points [begin, end) is NaN or infinite.
template <template <typename> class Arrays, typename S>
void requireFinite(const char* call, const Arrays<S>& arrays, std::size_t begin, std::size_t end) {
  if (std::isfinite(largestCoordinate(arrays, begin, end))) return;
  const auto isFinite = [](const geometry::Vec3d& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
  };
  while (isFinite(pointOf(arrays, begin))) ++begin;
  fibers::throwInvalidArgument(
      call, "point " + std::to_string(begin) + " is NaN or infinite; give it finite coordinates");
}

/// Returns what largestCoordinate() does, after requireFinite().
template <template <typename> class Arrays, typename S>
double largestCoordinate(const char* call, const Arrays<S>& arrays, std::size_t begin,
                         std::size_t end) {
  const double largest = largestCoordinate(arrays, begin, end);
  if (!std::isfinite(largest)) requireFinite(call, arrays, begin, end);
  return largest;
}

}  // namespace fcl_fibers::arrays
