// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include <fcl_fibers/fiber_tree.h>

#include "geometry/segment.h"
#include "tree/fiber_of.h"

namespace fcl_fibers::arrays {

/// The fiber that owns a point.
inline std::size_t fiberOf(const std::size_t* point_begin, std::size_t fiber_count,
                           std::size_t point) {
  return tree::fiberOf(point_begin, fiber_count, point_begin[fiber_count], point);
}

template <typename S>
geometry::Vec3d pointOf(const FiberArrays<S>& fibers, std::size_t i) {
  const S* p = fibers.points + 3 * i;
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

/// Of the capsule of fiber `fiber` that starts at point `id`.
template <typename S>
double radiusOf(const FiberArrays<S>& fibers, std::size_t id, std::size_t fiber) {
  switch (fibers.radii_are) {
    case FiberArrays<S>::Radii::kPerFiber:
      return static_cast<double>(fibers.radii[fiber]);
    case FiberArrays<S>::Radii::kPerSegment:
      return static_cast<double>(fibers.radii[id]);
    default:
      return static_cast<double>(fibers.radii[0]);
  }
}

}  // namespace fcl_fibers::arrays
