// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include <fcl_fibers/fiber_questions.h>

#include "fibers/fiber_table.h"

namespace fcl_fibers::arrays {

// Sorts `count` that were found. Fibers ascend with their segments.

/// @param a, b  the tables of both segments
/// @param order  kSegments or kFibers
void sortFound(Order order, const fibers::FiberTable& a, const fibers::FiberTable& b,
               SegmentPair* found, std::size_t count);
void sortFound(TrianglePair* found, std::size_t count);
void sortFound(std::int32_t* found, std::size_t count);

}  // namespace fcl_fibers::arrays
