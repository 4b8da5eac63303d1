// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>

#include "geometry/segment.h"

namespace fcl_fibers::arrays {

inline geometry::Segment toSegment(const CapsuleShape& capsule) {
  const auto& [start, end, radius] = capsule;
  return {{start[0], start[1], start[2]}, {end[0], end[1], end[2]}, radius};
}

struct LocatedSegment {
  geometry::Segment segment;
  FiberSegment place;
};

/// Returns the capsule that starts at point `id`. Throws std::invalid_argument if there is none, or
/// if fibers::contactProblem() refuses it.
template <typename S>
LocatedSegment locate(const char* call, const FiberArrays<S>& fibers, std::int32_t id);

}  // namespace fcl_fibers::arrays
