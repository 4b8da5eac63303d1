// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace fcl_fibers::test {

/// docs/numerics/times.csv, as measured now.
/// @param names  the rows whose names begin so
std::string rowTimesTable(const std::string& names);

}  // namespace fcl_fibers::test
