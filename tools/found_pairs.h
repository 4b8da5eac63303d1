// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>

namespace fcl_fibers::tools {

/// Pairs after which a search ends, because a radius that is far too large would fill the memory.
constexpr std::size_t kPairLimit = 10'000'000;

/// Pairs that a tree reports.
struct FoundPairs {
  std::vector<SegmentPair> pairs;       ///< in ascending order
  std::vector<unsigned char> touching;  ///< by segment, fiber after fiber: 1 if it is in a pair
  std::size_t touching_segments = 0;
  std::size_t touching_fibers = 0;
  bool complete = true;  ///< else the search ended at the limit
};

/// @param tree  built from the scene
FoundPairs findPairs(const FiberTree& tree, const FiberPolylines& scene,
                     std::size_t limit = kPairLimit);

/// The pairs of this scene with another one. What touches is counted of this scene.
FoundPairs findPairsBetween(const FiberTree& tree, const FiberPolylines& scene,
                            const FiberTree& other, std::size_t limit);

/// Tells on stderr that a search ended at its limit, or that there are so many pairs that the
/// radius may be wrong.
void warnOfMany(const FoundPairs& found, const FiberTree& tree, const std::string& scene);

}  // namespace fcl_fibers::tools
