// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace fcl_fibers::benchmarks {

/// Hands flags to Google Benchmark, which keeps the pointer to the program's name. Throws
/// std::invalid_argument if it does not know one of them.
/// @param flags  that the program itself does not know
void initializeBenchmark(char* program, const std::vector<std::string>& flags);

/// `AMD EPYC, 2 cores`
std::string machine();

/// `g++ 12.2.0`
std::string compiler();

}  // namespace fcl_fibers::benchmarks
