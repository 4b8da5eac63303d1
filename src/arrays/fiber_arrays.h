// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstddef>
#include <string>

#include <fcl_fibers/fiber_tree.h>

#include "arrays/coordinates.h"
#include "fibers/fiber_of.h"
#include "geometry/segment.h"
#include "parallel/executor.h"

namespace fcl_fibers::arrays {

/// The fiber that owns a point.
inline std::size_t fiberOf(const std::size_t* point_begin, std::size_t fiber_count,
                           std::size_t point) {
  return fibers::fiberOf(point_begin, fiber_count, point_begin[fiber_count], point);
}

/// One past the last point of a fiber.
template <typename S>
std::size_t pointEnd(const FiberArrays<S>& fibers, std::size_t fiber) {
  return fibers.point_end != nullptr ? fibers.point_end[fiber] : fibers.point_begin[fiber + 1];
}

/// The radius at point `id` of fiber `fiber`, of the capsule that starts there.
template <typename S>
double radiusOf(const FiberArrays<S>& fibers, std::size_t id, std::size_t fiber) {
  switch (fibers.radii_are) {
    case FiberArrays<S>::Radii::kPerFiber:
      return static_cast<double>(fibers.radii[fiber]);
    case FiberArrays<S>::Radii::kPerFirstPoint:
    case FiberArrays<S>::Radii::kPerPoint:
      return static_cast<double>(fibers.radii[id]);
    default:
      return static_cast<double>(fibers.radii[0]);
  }
}

template <typename S>
std::size_t radiusCount(const FiberArrays<S>& fibers) {
  switch (fibers.radii_are) {
    case FiberArrays<S>::Radii::kPerFiber:
      return fibers.fiber_count;
    case FiberArrays<S>::Radii::kPerFirstPoint:
    case FiberArrays<S>::Radii::kPerPoint:
      return fibers.point_count;
    default:
      return fibers.point_count > 0 ? 1 : 0;
  }
}

/// Whether is(i) is true for all i in [0, count).
/// @param executor  null for one thread
template <class Is>
bool areAll(parallel::Executor* executor, std::size_t count, const Is& is) {
  constexpr std::size_t kRange = 4096;
  std::atomic<bool> are{true};
  parallel::forRanges(executor, count, kRange, [&](std::size_t begin, std::size_t end) {
    bool are_here = true;
    for (std::size_t i = begin; i < end; ++i) are_here &= is(i);
    if (!are_here) are.store(false, std::memory_order_relaxed);
  });
  return are;
}

/// Calls refuse(text), which throws, if an array is null or the ends of point_begin do not fit.
template <typename S, class Refuse>
void checkEnds(const FiberArrays<S>& fibers, Refuse&& refuse) {
  constexpr std::size_t kMost = std::size_t{1} << 27;
  if (fibers.point_count > kMost)
    return refuse(std::to_string(fibers.point_count) +
                  " points are more than 2^27; use several trees");
  // A converted negative number would read before the array.
  if (fibers.fiber_count > kMost)
    return refuse(std::to_string(fibers.fiber_count) +
                  " fibers are more than 2^27; use several trees");
  if (fibers.point_begin == nullptr) {
    return refuse("point_begin is null; give fiber_count + 1 numbers");
  }
  const std::size_t begin = fibers.point_begin[0], end = fibers.point_begin[fibers.fiber_count];
  if ((begin != 0 && fibers.point_end == nullptr) || end != fibers.point_count) {
    return refuse("point_begin runs from " + std::to_string(begin) + " to " + std::to_string(end) +
                  "; it has to run from 0 to " + std::to_string(fibers.point_count) +
                  ", the number of points");
  }
  if (fibers.points == nullptr && fibers.point_count > 0) {
    return refuse("points are null; give x, y, z of " + std::to_string(fibers.point_count) +
                  " points");
  }
  if (const std::size_t radii = radiusCount(fibers); fibers.radii == nullptr && radii > 0) {
    return refuse("radii are null; give " + std::to_string(radii) + " numbers");
  }
  checkStrides(fibers, refuse);
}

}  // namespace fcl_fibers::arrays
