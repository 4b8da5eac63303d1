// SPDX-License-Identifier: BSD-3-Clause
#include "tree/search.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tree/search.cpp"
#include <hwy/foreach_target.h>

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
