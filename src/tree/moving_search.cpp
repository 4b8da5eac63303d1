// SPDX-License-Identifier: BSD-3-Clause
#include "tree/moving_search.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tree/moving_search.cpp"
#include <hwy/foreach_target.h>

#include "tree/kernels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

/// Calls visit(change, filter) with the change of frame in both directions and the filter.
template <int Arity, class F>
FCL_FIBERS_ALWAYS_INLINE Visit withBoth(const MovingMeshPair<Arity>& trees, F&& visit) {
  const geometry::FrameChange grown(1, {0, 0, 0}, trees.growth);
  return withMeeting(trees.a, trees.categories,
                     [&](auto filter) HWY_ATTR { return visit(grown, filter); });
}

template <int Arity>
constexpr PairKernels<MovingMeshPair<Arity>> kMeshKernels = {
    [](const MovingMeshPair<Arity>& trees, TaskSink& out) HWY_ATTR {
      SplitIntoTasks query(out);
      return withBoth(trees, [&](const auto& grown, auto filter) HWY_ATTR {
        return visitPairs(trees.a, trees.b, grown, grown, filter, query);
      });
    },
    [](const MovingMeshPair<Arity>& trees, const TraversalTask& task, PairBuffer& out) HWY_ATTR {
      return withBoth(trees, [&](const auto& grown, auto filter) HWY_ATTR {
        return overlapsOf(trees.a, trees.b, grown, grown, filter, task, out);
      });
    },
    nullptr};

const PairKernels<MovingMeshPair<2>>& movingMesh2() { return kMeshKernels<2>; }
const PairKernels<MovingMeshPair<8>>& movingMesh8() { return kMeshKernels<8>; }

template <class Tree>
constexpr Kernels<Tree> kKernels = {kOverlapKernels<Tree>, kOverlapKernels<TreePair<Tree>>,
                                    overlapsVolume<Tree>, nullptr};

const Kernels<MovingTree<2>>& movingBoxes2() { return kKernels<MovingTree<2>>; }
const Kernels<MovingTree<8>>& movingBoxes8() { return kKernels<MovingTree<8>>; }

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::tree {

HWY_EXPORT(movingMesh2);
HWY_EXPORT(movingMesh8);
HWY_EXPORT(movingBoxes2);
HWY_EXPORT(movingBoxes8);

template <>
const Kernels<MovingTree<2>>& kernels() {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(movingBoxes2)();
}
template <>
const Kernels<MovingTree<8>>& kernels() {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(movingBoxes8)();
}

const PairKernels<MovingMeshPair<2>>& pairKernels(const MovingMeshPair<2>& /*trees*/) {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(movingMesh2)();
}
const PairKernels<MovingMeshPair<8>>& pairKernels(const MovingMeshPair<8>& /*trees*/) {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(movingMesh8)();
}

}  // namespace fcl_fibers::tree
#endif
