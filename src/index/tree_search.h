// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "index/pair_search.h"
#include "tree/search.h"

namespace fcl_fibers::index {

/// A search of one tree, of two, or of a tree and a mesh.
template <class Trees>
class TreeSearch final : public PairSearch {
 public:
  explicit TreeSearch(const Trees& trees) : trees_(trees) {}
  tree::Visit split(tree::TaskSink& out) const override { return splitIntoTasks(trees_, out); }
  tree::Visit run(const tree::TraversalTask& task, tree::PairBuffer& out) const override {
    return visitOverlaps(trees_, task, out);
  }

 private:
  const Trees& trees_;
};

}  // namespace fcl_fibers::index
