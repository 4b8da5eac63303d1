// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>

namespace fcl_fibers::tools {

/// Seconds of a clock that all processes of a machine share and that never goes back.
inline double secondsNow() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Wall-clock seconds that `work()` takes.
template <typename Work>
double seconds(Work&& work) {
  const double begin = secondsNow();
  work();
  return secondsNow() - begin;
}

}  // namespace fcl_fibers::tools
