// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "geometry/box.h"
#include "geometry/sphere.h"
#include "tree/bvh.h"
#include "tree/traversal_task.h"

namespace fcl_fibers::tree {

namespace internal {

template <class Tree, class F>
void visitVolumesBelow(const Tree& tree, std::int32_t index, int depth, F&& visit) {
  std::int32_t leaf = tree.node(index).leaf_begin;
  for (int lane = 0; lane < tree.node(index).child_count; ++lane) {
    const Link child = tree.node(index).children[static_cast<std::size_t>(lane)];
    const std::int32_t end = leaf + leafCount(tree, child);
    if (child.isLeaf() || depth == 1) {
      visit(tree.pack(index).get(lane), leaf, end);
    } else {
      visitVolumesBelow(tree, child.node(), depth - 1, visit);
    }
    leaf = end;
  }
}

}  // namespace internal

/// Calls visit(volume, leaf_begin, leaf_end) for the volumes `depth` levels below the root of a
/// Bvh, and for leaves that are less deep. Their ranges of leaves() follow each other and cover
/// all.
template <class Tree, class F>
void visitVolumes(const Tree& tree, int depth, F&& visit) {
  if (tree.empty()) return;
  if (depth == 0) {
    visit(tree.nodeVolume(0), tree.node(0).leaf_begin, tree.node(0).leaf_end);
  } else {
    internal::visitVolumesBelow(tree, 0, depth, visit);
  }
}

/// The size of nodes divided by the size of leaves, from a sample. It tells how far a Bvh is from
/// one whose nodes hold segments that are close together. It grows when fibers move apart, but not
/// when everything grows.
template <class Tree>
double looseness(const Tree& tree) {
  constexpr std::size_t kSamples = 1024, kAhead = 8;
  double nodes = 0, leaves = 0;
  const std::size_t count = tree.nodes().size(), step = count / kSamples + 1;
  for (std::size_t i = 0; i < count; i += step) {
    const std::size_t next = std::min(i + kAhead * step, count - 1);
    tree.prefetch(static_cast<std::int32_t>(next));
    const auto& node = tree.nodes()[i];
    for (int lane = 0; lane < node.child_count; ++lane) {
      const auto size = static_cast<double>(node.pack.get(lane).size());
      if (!std::isfinite(size)) continue;
      const bool leaf = node.children[static_cast<std::size_t>(lane)].isLeaf();
      (leaf ? leaves : nodes) += size;
    }
  }
  return leaves > 0 && std::isfinite(nodes / leaves) ? nodes / leaves : 0;
}

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
