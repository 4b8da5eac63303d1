// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>

#include "index/pair_search.h"
#include "tree/search.h"
#include "tree/tree_pair.h"

namespace fcl_fibers::index {

/// A search of one tree, of two, or of a tree and a mesh.
template <class Trees>
class TreeSearch final : public PairSearch {
 public:
  explicit TreeSearch(const Trees& trees) : trees_(trees) {}
  std::int32_t leafCount() const override { return leavesOf(trees_); }
  tree::Visit split(const tree::TraversalTask& task, std::int32_t grain,
                    tree::TaskSink& out) const override {
    return splitIntoTasks(trees_, task, grain, out);
  }
  tree::Visit run(const tree::TraversalTask& task, tree::PairBuffer& out) const override {
    return visitOverlaps(trees_, task, out);
  }

 private:
  template <class Tree>
  static std::int32_t leavesOf(const Tree& tree) {
    return tree.empty() ? 0 : tree.node(0).leafCount();
  }
  template <class A, class B>
  static std::int32_t leavesOf(const tree::TreePair<A, B>& trees) {
    return std::max(leavesOf(trees.a), leavesOf(trees.b));
  }

  const Trees& trees_;
};

}  // namespace fcl_fibers::index
