// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>

#include "geometry/box.h"
#include "geometry/sphere.h"
#include "tree/topology.h"
#include "tree/traversal_task.h"

namespace fcl_fibers::tree {

inline geometry::Box boxOf(const geometry::Box& box) { return box; }
inline geometry::Box boxOf(const geometry::Sphere& sphere) {
  geometry::Box box;
  for (int axis = 0; axis < 3; ++axis) {
    const double center{sphere.center[axis]}, radius{sphere.radius};
    box.low[axis] = geometry::roundedDown(center - radius);
    box.high[axis] = geometry::roundedUp(center + radius);
  }
  return box;
}

/// Visits the leaves below a node whose volumes are near something that is asked about seldom, such
/// as a plane. See SegmentIndex::visitNear().
/// @param start, end  trees of one topology
template <class Tree, class Near, class F>
Visit visitNear(const Tree& start, const Tree& end, std::int32_t node, const Near& near, F& visit) {
  for (int lane = 0; lane < end.node(node).child_count; ++lane) {
    const auto child = Child<Tree>::of(end, node, lane);
    geometry::Box box = boxOf(child.volume);
    if (&start != &end) {
      const geometry::Box before = boxOf(start.pack(node).get(lane));
      for (int axis = 0; axis < 3; ++axis) {
        box.low[axis] = std::min(box.low[axis], before.low[axis]);
        box.high[axis] = std::max(box.high[axis], before.high[axis]);
      }
    }
    if (!near(box)) continue;
    const Visit visited = child.link.isLeaf()
                              ? visit(child.link.segment())
                              : visitNear(start, end, child.link.node(), near, visit);
    if (visited == Visit::kStop) return visited;
  }
  return Visit::kContinue;
}

}  // namespace fcl_fibers::tree
