// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "geometry/affine_map.h"
#include "geometry/rigid_fit.h"
#include "live/block_tree.h"

namespace fcl_fibers::live {

/// Returns the rigid motion of most of the points, or none if they have no common one.
geometry::AffineMap commonMotion(const std::vector<geometry::MovedPoint>& points);

/// One or two sets of segments and their anchors, or segments and the triangles of a mesh. If there
/// is one set, it is also the second.
struct Sides {
  int count;
  const BlockTree* anchors[2];
  bool is_mesh;     ///< whether the second is a mesh
  bool have_boxes;  ///< whether a segment may be a box
  /// Writes the nodes of the leaves of a block of one side.
  std::function<void(int side, std::int32_t block, BlockTree::BlockNodes& nodes)> writeNodes;
};

/// Calls take(p, q) for the pairs of leaves, one of each side, that are not covered: that have come
/// nearer by more than a length, and by as much of the gap between their anchors as is beyond the
/// margin. This is asked of
/// pairs of nodes, from the root down to pairs of leaves. Returns false if it takes too long.
/// @param covered  how much nearer they may come
/// @param margin   within which segments touch
/// @param left     how many nodes may still be compared, each with up to eight others; falls
bool visitUncovered(const Sides& sides, double covered, double margin, std::int64_t& left,
                    const std::function<void(Leaf p, Leaf q)>& take);

/// Bounds how much nearer any two segments have come.
double mostApproach(const Sides& sides);

/// By how much segments that are near each other have usually come nearer, or a mesh and segments
/// within a distance.
double usualApproach(const Sides& sides, double distance);

}  // namespace fcl_fibers::live
