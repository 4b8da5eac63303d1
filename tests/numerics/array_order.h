// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "numerics/order_hash.h"

namespace fcl_fibers::test {

/// Of each recorded scene in float and double, and of one with a turned mesh, in a FiberTree. Sizes
/// make several pieces of work, which threads share. Needs neither FCL nor Eigen.
std::vector<OrderHash> arrayOrderHashes(int threads);

}  // namespace fcl_fibers::test
