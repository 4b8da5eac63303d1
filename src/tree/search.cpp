// SPDX-License-Identifier: BSD-3-Clause
#include "tree/search.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tree/search.cpp"
#include <hwy/foreach_target.h>

#include "tree/traversal-inl.h"
#include "tree/wide_overlaps-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

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
    return visitPairs(trees.a, trees.b, b_to_a, a_to_b, query);
  });
}

/// The paper's binary tree is searched as published, by recursion.
template <class Tree, class BToA, class AToB, class GroupFilter>
Visit overlapsOf(const Tree& a, const Tree& b, const BToA& b_to_a, const AToB& a_to_b,
                 GroupFilter filter, const TraversalTask& task, PairBuffer& out) {
  if constexpr (Tree::kArity == 2) {
    CollectPairs query(out);
    return internal::PairTraversal<Tree, Tree, CollectPairs, BToA, AToB, GroupFilter>(
               a, b, b_to_a, a_to_b, filter, query)
        .run(task);
  } else {
    return WideOverlaps<Tree, BToA, AToB, GroupFilter>(a, b, b_to_a, a_to_b, filter, out).run(task);
  }
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

template <class Trees>
constexpr PairKernels<Trees> kPairKernels = {
    [](const Trees& trees, TaskSink& out) HWY_ATTR {
      SplitIntoTasks query(out);
      return visitPairs(trees, query);
    },
    [](const Trees& trees, const TraversalTask& task, PairBuffer& out)
        HWY_ATTR { return overlaps(trees, task, out); },
    [](const Trees& trees, double limit, NearestVisitor& visitor) HWY_ATTR {
      VisitNearest query(limit, visitor);
      return visitPairs(trees, query);
    },
};

template <class Tree, class Volume = typename Tree::Volume>
constexpr Kernels<Tree> kKernels = {
    kPairKernels<Tree>,
    kPairKernels<TreePair<Tree>>,
    [](const Tree& tree, const Volume& volume, SegmentId second, Group group, PairBuffer& out)
        HWY_ATTR {
          CollectPairs query(out, second);
          return visitLeaves(tree, volume, query, group);
        },
    [](const Tree& tree, const Volume& volume, SegmentId second, Group group, double limit,
       NearestVisitor& visitor) HWY_ATTR {
      VisitNearest query(limit, visitor, second);
      return visitLeaves(tree, volume, query, group);
    },
};

const Kernels<LayeredBoxTree<2>>& boxes2() { return kKernels<LayeredBoxTree<2>>; }
const Kernels<LayeredBoxTree<8>>& boxes8() { return kKernels<LayeredBoxTree<8>>; }
const Kernels<WrappedSphereTree<2>>& spheres2() { return kKernels<WrappedSphereTree<2>>; }
const Kernels<WrappedSphereTree<8>>& spheres8() { return kKernels<WrappedSphereTree<8>>; }

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::tree {

HWY_EXPORT(boxes2);
HWY_EXPORT(boxes8);
HWY_EXPORT(spheres2);
HWY_EXPORT(spheres8);

template <>
const Kernels<LayeredBoxTree<2>>& kernels() {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(boxes2)();
}
template <>
const Kernels<LayeredBoxTree<8>>& kernels() {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(boxes8)();
}
template <>
const Kernels<WrappedSphereTree<2>>& kernels() {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(spheres2)();
}
template <>
const Kernels<WrappedSphereTree<8>>& kernels() {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(spheres8)();
}

}  // namespace fcl_fibers::tree
#endif
