// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contender.h"

namespace fcl_fibers::benchmarks {

/// Prints the largest strand that SaP and SSaP finish in 60 s: set-up, one update, one
/// self-collision. The number of fibers doubles from try to try.
void printLargest(const std::vector<Contender>& contenders, int segments, unsigned long long seed);

}  // namespace fcl_fibers::benchmarks
