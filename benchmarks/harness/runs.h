// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <string>

namespace fcl_fibers::benchmarks {

/// What a result has besides its time, by the counter's name.
using Numbers = std::map<std::string, double>;

/// Registers a benchmark with so many runs in random order. A run returns the seconds that it took
/// and adds numbers. What it throws as std::runtime_error is an error of the benchmark.
/// @param ours  an error of a peer is written, but fails nothing
void registerRuns(const std::string& name, int runs, std::function<double(Numbers&)> run,
                  bool ours = true);

/// Registers numbers without a time, and a label.
void registerNumbers(const std::string& name, const Numbers& numbers,
                     const std::string& label = "");

/// Runs what is registered, and shows the progress. Results go to --benchmark_out only: reports are
/// made of that file. Returns whether no run of ours has ended in an error.
bool runRegistered();

}  // namespace fcl_fibers::benchmarks
