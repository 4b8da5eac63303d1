// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <benchmark/benchmark.h>

#include <functional>
#include <map>
#include <string>

#include "tools/seconds.h"

namespace fcl_fibers::benchmarks {

constexpr double kSecondsOfRun = 2e-3;  ///< of calls that take microseconds

/// The mean of as many calls as a run has.
template <typename Work>
double secondsOfCall(Work&& work) {
  for (int calls = 1;; calls *= 2) {
    const double taken = tools::seconds([&] {
      for (int i = 0; i < calls; ++i) work();
    });
    if (taken >= kSecondsOfRun) return taken / calls;
  }
}

/// What a result has besides its time, by the counter's name.
using Numbers = std::map<std::string, double>;

/// The counter that tells when a run ended, in seconds. A machine that is shared is slow for
/// seconds at a time, so reports compare runs that ended at about the same time. A run that is told
/// later has to set it itself, to tools::secondsNow().
constexpr const char* kEnd = "end";

/// How many runs a contender has where a peer has so many. Ours has more, for one of them to be
/// near each run of a peer.
constexpr int runsOf(bool ours, int runs) { return ours ? 3 * runs : runs; }

/// Registers a benchmark with so many runs in random order. A run returns the seconds that it took
/// and adds numbers. What it throws is an error of the benchmark.
/// @param ours  an error of a peer is written, but fails nothing
void registerRuns(const std::string& name, int runs, std::function<double(Numbers&)> run,
                  bool ours = true);

/// Registers numbers without a time, and a label.
void registerNumbers(const std::string& name, const Numbers& numbers,
                     const std::string& label = "");

/// The error of a run, or nothing.
std::string errorOf(const benchmark::BenchmarkReporter::Run& run);

/// Tells on stderr what is wrong, and returns false.
bool tellWrong(const std::string& what);

/// Runs what is registered, and shows the progress. Results go to --benchmark_out, of which reports
/// are made, and errors to stderr. Returns whether no run of ours has ended in an error.
bool runRegistered();

/// Runs what is registered and hands the results to this reporter, or if there is none to Google
/// Benchmark's own. Returns as above.
bool runRegistered(benchmark::BenchmarkReporter* reporter);

}  // namespace fcl_fibers::benchmarks
