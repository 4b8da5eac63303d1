// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "simd/always_inline.h"
#include "tree/topology.h"

namespace fcl_fibers::tree {

/// A node of a Bvh: a node of its topology, and the volumes of the children as one pack, so that
/// one test answers for all of them. A node of eight children begins with a cache line of links,
/// and its pack fills the lines after it.
template <class P, int Arity>
struct alignas(Arity == 8 ? 64 : alignof(P)) BvhNode : Topology<Arity>::Node {
  using Pack = P;

  explicit BvhNode(const typename Topology<Arity>::Node& node) : Topology<Arity>::Node(node) {}

  Pack pack;
};

/// Calls visit(lane, leaf) for the leaves among a node's children, where `leaf` is the position in
/// Topology::leaves.
template <class Node, class F>
FCL_FIBERS_ALWAYS_INLINE void forEachLeafOf(const Node* nodes, const Node& node, F&& visit) {
  std::int32_t leaf = node.leaf_begin;
  for (int lane = 0; lane < node.child_count; ++lane) {
    const Link child = node.children[static_cast<std::size_t>(lane)];
    if (child.isLeaf()) {
      visit(lane, leaf++);
    } else {
      leaf = nodes[child.node()].leaf_end;
    }
  }
}

/// The position in Topology::leaves of the leaf in a lane of a node.
template <class Node>
std::int32_t leafAt(const Node* nodes, const Node& node, int lane) {
  if (node.hasOnlyLeaves()) return node.leaf_begin + lane;
  std::int32_t found = 0;
  forEachLeafOf(nodes, node, [&](int other, std::int32_t leaf) {
    if (other == lane) found = leaf;
  });
  return found;
}

}  // namespace fcl_fibers::tree
