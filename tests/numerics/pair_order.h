// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "numerics/specimen.h"

namespace fcl_fibers::test {

/// Hashes of a scene and of what all kinds of trees report of it.
struct OrderHash {
  std::string scene;
  std::uint64_t capsules;  ///< as they were given; if these differ, the pairs may
  std::uint64_t pairs;     ///< in the order of the report
};

/// Of random scenes of every kind but hair, float and double, as arrays and as objects, and of
/// fibers with a turned mesh. Sizes make several pieces of work, which threads share.
std::vector<OrderHash> orderHashes(int threads);

}  // namespace fcl_fibers::test
