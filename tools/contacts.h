// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/scenes/fiber_scene.h>

namespace fcl_fibers::tools {

/// The pairs that a tree reports of a scene.
struct Contacts {
  std::vector<std::pair<FiberSegment, FiberSegment>> pairs;  ///< in ascending order
  std::vector<unsigned char> touching;  ///< by segment, fiber after fiber: 1 if it is of a pair
  std::size_t touching_segments = 0;
};

/// As the tree says, but that along a closed fiber the last segment is a neighbour of the first.
/// @param tree  built of the scene
Contacts findContacts(const FiberTree& tree, const scenes::FiberScene& scene);

}  // namespace fcl_fibers::tools
