// SPDX-License-Identifier: BSD-3-Clause
#include "tree/search.h"

#include <cstdint>
#include <type_traits>

#include "tree/kernels.h"
#include "tree/nearest-inl.h"
#include "tree/traversal-inl.h"

// The searches that make few tests, or much else with each, are compiled once. Their tests are the
// kernels'.

namespace fcl_fibers::tree {
namespace {

using HWY_NAMESPACE::Called;
using HWY_NAMESPACE::FrameOf;
using HWY_NAMESPACE::nearestOf;
using HWY_NAMESPACE::PairTraversal;
using HWY_NAMESPACE::visitAll;
using HWY_NAMESPACE::visitLeaves;
using HWY_NAMESPACE::VisitNearest;
using HWY_NAMESPACE::withAnyPairing;

/// The kernels of two trees, which may be the same, by the packs that they test.
template <class TreeA, class TreeB>
struct Tests {
  template <class Pack>
  FCL_FIBERS_ALWAYS_INLINE const auto& of(const Pack& /*pack*/) const {
    if constexpr (std::is_same_v<Pack, typename TreeA::Pack>) {
      return a;
    } else {
      return b;
    }
  }

  template <class Pack, class... Arguments>
  int nearer(const Pack& pack, Arguments&&... arguments) const {
    return of(pack).nearer(pack, arguments...);
  }

  const Kernels<TreeA>& a = kernels<TreeA>();
  const Kernels<TreeB>& b = kernels<TreeB>();
};

/// Splits the pairs whose volumes overlap into tasks of at most `grain` leaves on either side.
template <class TreeA, class TreeB>
struct SplitIntoTasks {
  static constexpr bool kSplits = true;
  static constexpr bool kNearestFirst = false;

  SplitIntoTasks(std::int32_t most_leaves, TaskSink& sink) : grain(most_leaves), out(sink) {}

  template <class Pack, class Volume, class F>
  Visit forEachPassing(const Pack& pack, FrameOf /*frame*/, const Volume& volume,
                       simd::LaneMask lanes, F&& visit) {
    for (auto rest = tests.of(pack).overlaps(pack, volume) & lanes; rest != 0; rest &= rest - 1) {
      if (visit(__builtin_ctz(rest)) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }
  bool isTask(std::int32_t a_leaves, std::int32_t b_leaves) const {
    return a_leaves <= grain && b_leaves <= grain;
  }
  Visit addTask(const TraversalTask& task) { return out.take(task); }

  Tests<TreeA, TreeB> tests;
  std::int32_t grain;
  TaskSink& out;
};

template <class Tree>
Visit runKernel(const Tree& tree, const TraversalTask& task, PairBuffer& out) {
  return kernels<Tree>().within(tree, task, out);
}
template <class TreeA, class TreeB>
Visit runKernel(const TreePair<TreeA, TreeB>& trees, const TraversalTask& task, PairBuffer& out) {
  if constexpr (std::is_same_v<TreeA, TreeB>) {
    return kernels<TreeA>().between(trees, task, out);
  } else {
    return kernels<TreeA>().with_mesh(trees, task, out);
  }
}

template <class Trees>
constexpr bool kHasNearestKernel = false;
template <class Tree>
constexpr bool kHasNearestKernel<TreePair<Tree, Tree>> = Tree::kArity == 2;
template <class Hierarchy>
constexpr bool kHasNearestKernel<Bvh<Hierarchy>> = Hierarchy::kArity == 2;

template <class Tree>
Visit runNearestKernel(const Tree& tree, double limit, NearestVisitor& visitor) {
  return kernels<Tree>().nearest(tree, limit, visitor);
}
template <class Tree>
Visit runNearestKernel(const TreePair<Tree>& trees, double limit, NearestVisitor& visitor) {
  return kernels<Tree>().nearest_between(trees, limit, visitor);
}

}  // namespace

template <class Trees>
Visit splitIntoTasks(const Trees& trees, const TraversalTask& task, std::int32_t grain,
                     TaskSink& out) {
  return withAnyPairing<Called>(trees, [&](const auto& pairing) {
    using Pairing = std::decay_t<decltype(pairing)>;
    using Query = SplitIntoTasks<typename Pairing::TreeA, typename Pairing::TreeB>;
    Query query(grain, out);
    if (task.node == TraversalTask::kAll) return visitAll<Trees>(pairing, query);
    return PairTraversal<Pairing, Query>(pairing, query).run(task);
  });
}

template <class Trees>
Visit visitOverlaps(const Trees& trees, const TraversalTask& task, PairBuffer& out) {
  return runKernel(trees, task, out);
}

template <class Trees>
Visit visitNearest(const Trees& trees, double limit, NearestVisitor& visitor) {
  if constexpr (kHasNearestKernel<Trees>) {
    return runNearestKernel(trees, limit, visitor);
  } else {
    return nearestOf<Tests>(trees, limit, visitor);
  }
}

template <class Tree>
Visit visitOverlaps(const Tree& tree, const typename Tree::Volume& volume, SegmentId second,
                    Group group, PairBuffer& out) {
  return kernels<Tree>().with_volume(tree, volume, second, group, out);
}

template <class Tree>
Visit visitNearest(const Tree& tree, const typename Tree::Volume& volume, SegmentId second,
                   Group group, double limit, NearestVisitor& visitor) {
  if constexpr (kHasNearestKernel<Tree>) {
    return kernels<Tree>().nearest_to_volume(tree, volume, second, group, limit, visitor);
  } else {
    VisitNearest<Tests<Tree, Tree>> query(second, limit, visitor);
    return visitLeaves(tree, volume, query, group);
  }
}

template <class Trees>
Visit visitOneByOne(const Trees& trees, std::int32_t a_slot, std::int32_t b_slot, PairBuffer& out) {
  return withAnyPairing<Called>(trees, [&](const auto& pairing) {
    using Pairing = std::decay_t<decltype(pairing)>;
    using Query = SplitIntoTasks<typename Pairing::TreeA, typename Pairing::TreeB>;
    // A task of one leaf on either side is a pair.
    struct PushPairs final : TaskSink {
      PushPairs(const Pairing& p, PairBuffer& buffer) : pairing(p), out(buffer) {}
      Visit take(const TraversalTask& task) override {
        return out.push(Child<typename Pairing::TreeA>::of(pairing.a, task.a_slot).link.segment(),
                        Child<typename Pairing::TreeB>::of(pairing.b, task.b_slot).link.segment());
      }
      const Pairing& pairing;
      PairBuffer& out;
    } pairs(pairing, out);
    Query query(/*most_leaves=*/1, pairs);
    return PairTraversal<Pairing, Query>(pairing, query)
        .run({TraversalTask::kCross, a_slot, b_slot});
  });
}

#define FCL_FIBERS_SEARCH(...)                                                          \
  template Visit splitIntoTasks(const __VA_ARGS__&, const TraversalTask&, std::int32_t, \
                                TaskSink&);                                             \
  template Visit visitOverlaps(const __VA_ARGS__&, const TraversalTask&, PairBuffer&);
#define FCL_FIBERS_SEARCH_OF_ONE(TREE) \
  FCL_FIBERS_SEARCH(TREE)              \
  FCL_FIBERS_SEARCH(TreePair<TREE>)    \
  template Visit visitOverlaps(const TREE&, const TREE::Volume&, SegmentId, Group, PairBuffer&);
#define FCL_FIBERS_NEAREST(...) \
  template Visit visitNearest(const __VA_ARGS__&, double, NearestVisitor&);
#define FCL_FIBERS_NEAREST_OF_ONE(TREE)                                                   \
  FCL_FIBERS_NEAREST(TREE)                                                                \
  FCL_FIBERS_NEAREST(TreePair<TREE>)                                                      \
  template Visit visitNearest(const TREE&, const TREE::Volume&, SegmentId, Group, double, \
                              NearestVisitor&);
#define FCL_FIBERS_ONE_BY_ONE(...) \
  template Visit visitOneByOne(const __VA_ARGS__&, std::int32_t, std::int32_t, PairBuffer&);

FCL_FIBERS_SEARCH_OF_ONE(LayeredBoxTree<2>)
FCL_FIBERS_SEARCH_OF_ONE(LayeredBoxTree<8>)
FCL_FIBERS_SEARCH_OF_ONE(WrappedSphereTree<2>)
FCL_FIBERS_SEARCH_OF_ONE(WrappedSphereTree<8>)
FCL_FIBERS_SEARCH_OF_ONE(MovingTree<2>)
FCL_FIBERS_SEARCH_OF_ONE(MovingTree<8>)
FCL_FIBERS_SEARCH(MeshPair<LayeredBoxTree<2>>)
FCL_FIBERS_SEARCH(MeshPair<WrappedSphereTree<2>>)
FCL_FIBERS_SEARCH(MeshPair<WrappedSphereTree<8>>)
FCL_FIBERS_SEARCH(MovingMeshPair<2>)
FCL_FIBERS_NEAREST_OF_ONE(LayeredBoxTree<2>)
FCL_FIBERS_NEAREST_OF_ONE(LayeredBoxTree<8>)
FCL_FIBERS_NEAREST_OF_ONE(WrappedSphereTree<2>)
FCL_FIBERS_NEAREST_OF_ONE(WrappedSphereTree<8>)
FCL_FIBERS_NEAREST(MeshPair<LayeredBoxTree<2>>)
FCL_FIBERS_NEAREST(MeshPair<WrappedSphereTree<2>>)
FCL_FIBERS_NEAREST(MeshPair<WrappedSphereTree<8>>)
FCL_FIBERS_ONE_BY_ONE(LayeredBoxTree<8>)
FCL_FIBERS_ONE_BY_ONE(TreePair<LayeredBoxTree<8>>)
FCL_FIBERS_ONE_BY_ONE(WrappedSphereTree<8>)
FCL_FIBERS_ONE_BY_ONE(TreePair<WrappedSphereTree<8>>)
FCL_FIBERS_ONE_BY_ONE(MovingTree<8>)
FCL_FIBERS_ONE_BY_ONE(TreePair<MovingTree<8>>)
FCL_FIBERS_ONE_BY_ONE(MeshPair<WrappedSphereTree<8>>)

#undef FCL_FIBERS_SEARCH
#undef FCL_FIBERS_SEARCH_OF_ONE
#undef FCL_FIBERS_NEAREST
#undef FCL_FIBERS_NEAREST_OF_ONE
#undef FCL_FIBERS_ONE_BY_ONE

}  // namespace fcl_fibers::tree
