// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>

namespace fcl_fibers::tools {

/// The pairs that a tree reports for a scene.
struct FoundPairs {
  std::vector<SegmentPair> pairs;       ///< in ascending order
  std::vector<unsigned char> touching;  ///< by segment, fiber after fiber: 1 if it is in a pair
  std::size_t touching_segments = 0;
};

/// @param tree  built from the scene
FoundPairs findPairs(const FiberTree& tree, const FiberPolylines& scene);

}  // namespace fcl_fibers::tools
