// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "simd/always_inline.h"
#include "tree/topology.h"

namespace fcl_fibers::tree {

/// Whether a traversal goes on.
enum class Visit { kContinue, kStop };

/// A child of a node, with its volume. Its slot is the arity times the node plus its lane.
template <class Tree>
struct Child {
  std::int32_t slot;
  Link link;
  typename Tree::Volume volume;

  FCL_FIBERS_ALWAYS_INLINE static Child of(const Tree& tree, std::int32_t node, int lane) {
    return {node * Tree::kArity + lane, tree.node(node).children[static_cast<std::size_t>(lane)],
            tree.pack(node).get(lane)};
  }
  FCL_FIBERS_ALWAYS_INLINE static Child of(const Tree& tree, std::int32_t slot) {
    return of(tree, slot / Tree::kArity, slot % Tree::kArity);
  }
};

template <class Tree>
FCL_FIBERS_ALWAYS_INLINE std::int32_t leafCount(const Tree& tree, Link link) {
  return link.isLeaf() ? 1 : tree.node(link.node()).leafCount();
}

/// A part of the traversal of one tree or two: the pairs below a node, or between the children in
/// two slots, whose volumes overlap.
struct TraversalTask {
  static constexpr std::int32_t kCross = -1, kAll = -2;

  std::int32_t node;            ///< the pairs below this node, kCross, or kAll
  std::int32_t a_slot, b_slot;  ///< if node is kCross
};

/// All pairs of one tree or of two.
constexpr TraversalTask kAllPairs = {TraversalTask::kAll, 0, 0};

}  // namespace fcl_fibers::tree
