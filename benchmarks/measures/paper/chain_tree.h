// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include <fcl_fibers/benchmark/judge.h>
#include "measures/paper/plain_self_query.h"
#include "tree/topology.h"

namespace fcl_fibers::benchmarks {

/// A binary tree without volumes. Its leaves are numbered depth first, as in Topology::leaves.
/// Children come after their parent, so one backward sweep goes from the leaves to the root.
class BinaryTree {
 public:
  struct Node {
    std::int32_t right;       ///< the second child; the first one comes right after its parent
    std::int32_t begin, end;  ///< the leaves below

    bool isLeaf() const { return end - begin == 1; }
  };

  /// The children of a wide node are halved in their order until two are left, which keeps blocks
  /// of a bundle together as its build has split them.
  /// @pre there is a segment
  template <int Arity>
  explicit BinaryTree(const tree::Topology<Arity>& topology) {
    nodes_.reserve(2 * topology.leaves.size());
    addChildren(topology, topology.nodes[0], 0, topology.nodes[0].child_count);
  }

  std::size_t size() const { return nodes_.size(); }
  const Node& operator[](std::int32_t i) const { return nodes_[static_cast<std::size_t>(i)]; }

 private:
  template <int Arity>
  static std::int32_t leavesBelow(const tree::Topology<Arity>& topology, tree::Link link) {
    return link.isLeaf() ? 1 : topology.nodes[static_cast<std::size_t>(link.node())].leafCount();
  }

  /// Adds the subtree over the children first, ..., last - 1 of a node.
  template <int Arity>
  void addChildren(const tree::Topology<Arity>& topology,
                   const typename tree::Topology<Arity>::Node& node, int first, int last) {
    const auto child = [&](int lane) { return node.children[static_cast<std::size_t>(lane)]; };
    if (last - first == 1) {
      if (child(first).isLeaf()) {
        nodes_.push_back({0, leaf_count_, leaf_count_ + 1});
        ++leaf_count_;
      } else {
        const auto& below = topology.nodes[static_cast<std::size_t>(child(first).node())];
        addChildren(topology, below, 0, below.child_count);
      }
      return;
    }
    std::int32_t all = 0;
    for (int lane = first; lane < last; ++lane) all += leavesBelow(topology, child(lane));
    int split = first + 1;
    std::int32_t before = leavesBelow(topology, child(first));
    for (; split + 1 < last; ++split) {
      const std::int32_t longer = before + leavesBelow(topology, child(split));
      if (std::abs(2 * longer - all) >= std::abs(2 * before - all)) break;
      before = longer;
    }
    const std::size_t index = nodes_.size();
    nodes_.push_back({0, leaf_count_, leaf_count_ + all});
    addChildren(topology, node, first, split);
    nodes_[index].right = static_cast<std::int32_t>(nodes_.size());
    addChildren(topology, node, split, last);
  }

  std::vector<Node> nodes_;
  std::int32_t leaf_count_ = 0;
};

/// The larger of two nodes is opened (Sobottka, Varnik and Weber, 2005, section 2).
template <class Volume>
struct VolumeNodes {
  using Id = std::int32_t;
  const BinaryTree& tree;
  const std::vector<Volume>& volumes;

  const Volume& of(Id node) const { return volumes[static_cast<std::size_t>(node)]; }
  bool isLeaf(Id node) const { return tree[node].isLeaf(); }
  Id child(Id node, int which) const { return which == 0 ? node + 1 : tree[node].right; }
  bool overlap(Id a, Id b) const { return overlaps(of(a), of(b)); }
  bool opensFirst(Id a, Id b) const { return of(a).size() >= of(b).size(); }
};

/// Calls visit(leaf, leaf) for the pairs of leaves whose volumes overlap. Returns the number of
/// volume tests.
template <class Volume, class F>
std::size_t queryItself(const BinaryTree& tree, const std::vector<Volume>& volumes, F&& visit) {
  const auto visitLeaves = [&](std::int32_t a, std::int32_t b) {
    visit(tree[a].begin, tree[b].begin);
  };
  return PlainSelfQuery(VolumeNodes<Volume>{tree, volumes}, 0, visitLeaves).volumeTests();
}

}  // namespace fcl_fibers::benchmarks
