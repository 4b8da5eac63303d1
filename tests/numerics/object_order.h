// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "numerics/order_hash.h"

namespace fcl_fibers::test {

/// Of each recorded scene in float and double, as FCL's objects in the managers.
std::vector<OrderHash> objectOrderHashes(int threads);

}  // namespace fcl_fibers::test
