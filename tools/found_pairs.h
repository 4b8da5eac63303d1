// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/scenes/fiber_scene.h>

namespace fcl_fibers::tools {

/// The pairs that a tree reports of a scene.
struct FoundPairs {
  std::vector<SegmentPair> pairs;       ///< in ascending order
  std::vector<unsigned char> touching;  ///< by segment, fiber after fiber: 1 if it is of a pair
  std::size_t touching_segments = 0;
};

/// @param tree  built of the scene
FoundPairs findPairs(const FiberTree& tree, const scenes::FiberScene& scene);

}  // namespace fcl_fibers::tools
