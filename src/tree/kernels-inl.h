// SPDX-License-Identifier: BSD-3-Clause
#if defined(FCL_FIBERS_TREE_KERNELS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_TREE_KERNELS_INL_H
#undef FCL_FIBERS_TREE_KERNELS_INL_H
#else
#define FCL_FIBERS_TREE_KERNELS_INL_H
#endif

#include "tree/queries-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

/// Calls visit(b_to_a, a_to_b) with the changes between the frames of two trees.
template <class Tree, class F>
FCL_FIBERS_ALWAYS_INLINE Visit withChanges(const TreePair<Tree>& trees, F&& visit) {
  constexpr geometry::SameFrame kSame;
  return trees.b_to_a.isIdentity() && trees.a_to_b.isIdentity() ? visit(kSame, kSame)
                                                                : visit(trees.b_to_a, trees.a_to_b);
}

template <class Tree, class Query>
Visit visitPairs(const TreePair<Tree>& trees, Query& query) {
  return withChanges(trees, [&](const auto& b_to_a, const auto& a_to_b) HWY_ATTR {
    return visitPairs(trees.a, trees.b, b_to_a, a_to_b, AllGroups(), query);
  });
}

template <class Tree>
Visit overlaps(const Tree& tree, const TraversalTask& task, PairBuffer& out) {
  constexpr geometry::SameFrame kSame;
  return internal::withGroups(tree, [&](auto filter) HWY_ATTR {
    return overlapsOf(tree, tree, kSame, kSame, filter, task, out);
  });
}
template <class Tree>
Visit overlaps(const TreePair<Tree>& trees, const TraversalTask& task, PairBuffer& out) {
  return withChanges(trees, [&](const auto& b_to_a, const auto& a_to_b) HWY_ATTR {
    return overlapsOf(trees.a, trees.b, b_to_a, a_to_b, AllGroups(), task, out);
  });
}

// Highway sets the instruction set for functions between its macros and for those marked HWY_ATTR,
// such as lambdas that become pointers to functions.

/// The searches for overlapping pairs alone.
template <class Trees>
constexpr PairKernels<Trees> kOverlapKernels = {
    [](const Trees& trees, TaskSink& out) HWY_ATTR {
      SplitIntoTasks query(out);
      return visitPairs(trees, query);
    },
    [](const Trees& trees, const TraversalTask& task, PairBuffer& out)
        HWY_ATTR { return overlaps(trees, task, out); },
    nullptr,
};

template <class Tree>
Visit overlapsVolume(const Tree& tree, const typename Tree::Volume& volume, SegmentId second,
                     Group group, PairBuffer& out) {
  CollectPairs query(out, second);
  return visitLeaves(tree, volume, query, group);
}

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
