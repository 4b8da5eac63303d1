// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace fcl_fibers::benchmarks {

/// Hands flags to Google Benchmark, which keeps the pointer to the program's name, and names the
/// machine and the compiler in the context of results. Throws std::invalid_argument if it does not
/// know one of the flags.
/// @param flags  that the program itself does not know
void initializeBenchmark(char* program, const std::vector<std::string>& flags);

}  // namespace fcl_fibers::benchmarks
