// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>

namespace fcl_fibers::benchmarks {

/// Wall-clock seconds that `work()` takes.
template <typename Work>
double seconds(Work&& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

constexpr double kSecondsOfRun = 2e-3;  ///< of calls that take microseconds

/// The mean of as many calls as a run has.
template <typename Work>
double secondsOfCall(Work&& work) {
  for (int calls = 1;; calls *= 2) {
    const double taken = seconds([&] {
      for (int i = 0; i < calls; ++i) work();
    });
    if (taken >= kSecondsOfRun) return taken / calls;
  }
}

}  // namespace fcl_fibers::benchmarks
