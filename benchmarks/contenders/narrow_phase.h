// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "contenders/contender.h"

namespace fcl_fibers::benchmarks {

/// Pairs of a self-collision query, or blocks of them that are evenly spread.
struct PairSample {
  std::vector<std::pair<Object*, Object*>> pairs;
  std::size_t of = 0;  ///< that the query reports
};

/// About `size` of the `reported` pairs, or all. Blocks, for the objects of pairs that follow each
/// other are in the cache.
PairSample samplePairs(const Manager& manager, std::size_t reported, std::size_t size);

struct NarrowPhase {
  double seconds = 0;
  double touching = 0;
};

/// Calls fcl::collide on the sample, and scales to all pairs.
NarrowPhase collide(const PairSample& sample);

/// Self-collision with a callback that counts capsulesTouch(), as a careful user writes it.
template <typename S>
std::size_t countTouching(const BasicManager<S>& manager);

}  // namespace fcl_fibers::benchmarks
