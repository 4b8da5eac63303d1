// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

namespace fcl_fibers::benchmarks {

/// Runs of a query in motion, and of a slow one.
constexpr int kRuns = 5, kSlowRuns = 3;

using Pairs = std::vector<std::pair<std::int32_t, std::int32_t>>;

inline FiberTreeOptions capsules(int threads = 1, double margin = 0) {
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = 1;
  options.threads = threads;
  options.margin = margin;
  return options;
}

}  // namespace fcl_fibers::benchmarks
