// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "contender.h"
#include "preflight.h"

namespace fcl_fibers::benchmarks {

/// Median seconds of each phase, NaN where it was not timed.
using Timing = std::array<double, kPhases>;

/// Times the contenders that are right, with Google Benchmark, which has to be initialised. Those
/// that report other pairs now than when they were checked are wrong from here on. Repetitions are
/// chosen by how long a phase takes, or left to --benchmark_repetitions.
std::vector<Timing> timeContenders(const std::vector<Contender>& contenders,
                                   std::vector<Preflight>& preflights, MovingFibers& fibers,
                                   bool choose_repetitions);

}  // namespace fcl_fibers::benchmarks
