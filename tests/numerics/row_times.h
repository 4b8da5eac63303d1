// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace fcl_fibers::test {

/// The table of docs/numerics.md under "Time at the extremes", as measured now.
std::string rowTimesTable();

}  // namespace fcl_fibers::test
