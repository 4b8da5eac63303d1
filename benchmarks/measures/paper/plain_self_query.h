// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace fcl_fibers::benchmarks {

/// Finds the pairs of leaves of a binary tree whose volumes overlap, each once, by one test of two
/// volumes at a time, as FCL 0.7 does. It is the same plain loop for all trees and volumes, so that
/// counts and times differ by these alone.
///
/// Nodes has an Id and isLeaf(id), child(id, 0 or 1), overlap(a, b) and opensFirst(a, b): which of
/// two inner nodes is opened, against the whole of the other.
template <class Nodes, class F>
class PlainSelfQuery {
 public:
  using Id = typename Nodes::Id;

  /// @param visit  visit(leaf, leaf)
  PlainSelfQuery(Nodes nodes, Id root, F visit) : nodes_(nodes), visit_(visit) { visitSelf(root); }

  std::size_t volumeTests() const { return volume_tests_; }

 private:
  void visitSelf(Id node) {
    if (nodes_.isLeaf(node)) return;
    visitSelf(nodes_.child(node, 0));
    visitSelf(nodes_.child(node, 1));
    visitCross(nodes_.child(node, 0), nodes_.child(node, 1));
  }

  void visitCross(Id a, Id b) {
    ++volume_tests_;
    if (!nodes_.overlap(a, b)) return;
    const bool a_is_leaf = nodes_.isLeaf(a), b_is_leaf = nodes_.isLeaf(b);
    if (a_is_leaf && b_is_leaf) {
      visit_(a, b);
    } else if (b_is_leaf || (!a_is_leaf && nodes_.opensFirst(a, b))) {
      visitCross(nodes_.child(a, 0), b);
      visitCross(nodes_.child(a, 1), b);
    } else {
      visitCross(a, nodes_.child(b, 0));
      visitCross(a, nodes_.child(b, 1));
    }
  }

  Nodes nodes_;
  F visit_;
  std::size_t volume_tests_ = 0;
};

}  // namespace fcl_fibers::benchmarks
