// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include <hwy/highway.h>

namespace fcl_fibers::simd {

/// Makes HWY_DYNAMIC_DISPATCH choose the instruction set (Highway's "target") that the environment
/// variable FCL_FIBERS_SIMD names, or else the best one that both this machine and the compiler
/// know. It must be called before each dispatch, but reads the variable once per process. Throws
/// std::invalid_argument if the name is unknown or the target is not available.
void readEnvironment();

/// The targets that are available here, the best first.
std::vector<std::int64_t> availableTargets();

/// The name of a target in FCL_FIBERS_SIMD: scalar, sse4, avx2, avx512 or neon.
const char* targetName(std::int64_t target);

}  // namespace fcl_fibers::simd
