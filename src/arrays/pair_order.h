// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include <fcl_fibers/fiber_questions.h>

#include "fibers/fiber_table.h"

namespace fcl_fibers::arrays {

// Sorts what was found. Fibers ascend with their segments.

/// @param a, b  the tables of both segments
/// @param order  kSegments or kFibers
void sortFound(Order order, const fibers::FiberTable& a, const fibers::FiberTable& b,
               std::vector<SegmentPair>& found);
void sortFound(std::vector<TrianglePair>& found);
void sortFound(std::vector<std::int32_t>& found);

}  // namespace fcl_fibers::arrays
