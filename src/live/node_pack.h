// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "geometry/box.h"
#include "simd/lanes.h"

namespace fcl_fibers::live {

/// Bounds a few leaves.
struct Node {
  geometry::Box where;  ///< around the anchors and radii
  geometry::Box moved;  ///< around the displacements
  float growth;         ///< bounds by how much a radius has grown
};

/// Eight nodes. Some may be missing, and their numbers mean nothing; see BlockTree::lanes().
struct NodePack {
  static constexpr int kSize = 8;

  Node get(int lane) const { return {where.get(lane), moved.get(lane), growth[lane]}; }
  void set(int lane, const Node& node) {
    where.set(lane, node.where);
    moved.set(lane, node.moved);
    growth[lane] = node.growth;
  }

  geometry::Box::Pack<kSize> where, moved;
  alignas(4 * kSize) float growth[kSize] = {};
};

/// Two nodes are covered if none of their segments have come nearer than `most`, or if the gap
/// between their anchors is larger than `stretch` times what they have come nearer and `margin`.
struct Cover {
  float most, margin, stretch;
};

/// Sets columns[i], for each of the first nodes in `rows`, to the second nodes with which it is not
/// covered. What a missing node is covered with is unspecified.
void findUncovered(const NodePack& first, simd::LaneMask rows, const NodePack& second,
                   const Cover& cover, simd::LaneMask* columns);

}  // namespace fcl_fibers::live
