// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "index/pair_search.h"
#include "tree/moving_search.h"
#include "tree/search.h"

namespace fcl_fibers::index {

/// A search of one tree, of two, or of a tree and a mesh.
template <class Trees>
class TreeSearch final : public PairSearch {
 public:
  explicit TreeSearch(const Trees& trees) : trees_(trees), kernels_(tree::pairKernels(trees)) {}
  tree::Visit split(tree::TaskSink& out) const override {
    return kernels_.splitIntoTasks(trees_, out);
  }
  tree::Visit run(const tree::TraversalTask& task, tree::PairBuffer& out) const override {
    return kernels_.overlaps(trees_, task, out);
  }

 private:
  const Trees& trees_;
  const tree::PairKernels<Trees>& kernels_;
};

}  // namespace fcl_fibers::index
