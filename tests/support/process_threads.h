// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sched.h>

#include <cstddef>
#include <filesystem>
#include <iterator>

namespace fcl_fibers::test {

inline std::size_t threadsOfThisProcess() {
  const std::filesystem::directory_iterator tasks("/proc/self/task");
  return static_cast<std::size_t>(std::distance(begin(tasks), end(tasks)));
}

/// How many processors the process may use. std::thread may count those that it may not use too.
inline int processorsOfThisProcess() {
  cpu_set_t processors;
  CPU_ZERO(&processors);
  sched_getaffinity(0, sizeof(processors), &processors);
  return CPU_COUNT(&processors);
}

}  // namespace fcl_fibers::test
