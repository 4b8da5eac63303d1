// SPDX-License-Identifier: BSD-3-Clause
#if defined(FCL_FIBERS_TREE_QUERIES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_TREE_QUERIES_INL_H
#undef FCL_FIBERS_TREE_QUERIES_INL_H
#else
#define FCL_FIBERS_TREE_QUERIES_INL_H
#endif

#include "tree/search.h"
#include "tree/traversal-inl.h"
#include "tree/wide_overlaps-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

// The queries for which the trees are traversed.

struct CollectPairs : OverlapTest {
  explicit CollectPairs(PairBuffer& buffer, SegmentId id = 0) : out(buffer), second(id) {}

  FCL_FIBERS_ALWAYS_INLINE Visit leafPair(SegmentId a, SegmentId b) { return out.push(a, b); }
  FCL_FIBERS_ALWAYS_INLINE Visit leaf(SegmentId a) { return out.push(a, second); }

  PairBuffer& out;
  SegmentId second;
};

struct SplitIntoTasks : OverlapTest {
  /// A task takes some microseconds. So batches fill, and there are enough tasks for any number of
  /// threads. This is the size of a full node three levels above the leaves.
  static constexpr std::int32_t kGrain = 512;
  static constexpr bool kSplits = true;

  explicit SplitIntoTasks(TaskSink& sink) : out(sink) {}
  static bool isTask(std::int32_t a_leaves, std::int32_t b_leaves) {
    return a_leaves <= kGrain && b_leaves <= kGrain;
  }
  Visit addTask(const TraversalTask& task) { return out.take(task); }
  Visit leafPair(SegmentId, SegmentId) { return Visit::kContinue; }  // it is a task too

  TaskSink& out;
};

struct VisitNearest : DistanceTest {
  VisitNearest(double least, NearestVisitor& v, SegmentId id = 0)
      : DistanceTest{least}, visitor(v), second(id) {}

  Visit leafPair(SegmentId a, SegmentId b) { return visitor.visit(a, b, limit); }
  Visit leaf(SegmentId a) { return visitor.visit(a, second, limit); }

  NearestVisitor& visitor;
  SegmentId second;
};

/// The paper's binary tree is searched as published, by recursion.
template <class TreeA, class TreeB, class BToA, class AToB, class GroupFilter>
Visit overlapsOf(const TreeA& a, const TreeB& b, const BToA& b_to_a, const AToB& a_to_b,
                 GroupFilter filter, const TraversalTask& task, PairBuffer& out) {
  if constexpr (TreeA::kArity == 2) {
    CollectPairs query(out);
    return internal::PairTraversal<TreeA, TreeB, CollectPairs, BToA, AToB, GroupFilter>(
               a, b, b_to_a, a_to_b, filter, query)
        .run(task);
  } else {
    return WideOverlaps<TreeA, TreeB, BToA, AToB, GroupFilter>(a, b, b_to_a, a_to_b, filter, out)
        .run(task);
  }
}

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
