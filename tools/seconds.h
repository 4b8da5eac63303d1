// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>

namespace fcl_fibers::tools {

/// Wall-clock seconds that `work()` takes.
template <typename Work>
double seconds(Work&& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace fcl_fibers::tools
