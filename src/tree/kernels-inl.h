// SPDX-License-Identifier: BSD-3-Clause
#if defined(FCL_FIBERS_TREE_KERNELS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_TREE_KERNELS_INL_H
#undef FCL_FIBERS_TREE_KERNELS_INL_H
#else
#define FCL_FIBERS_TREE_KERNELS_INL_H
#endif

#include "tree/kernels.h"
#include "tree/nearest-inl.h"
#include "tree/traversal-inl.h"
#include "tree/wide_overlaps-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

/// The paper's binary tree is searched as published, by recursion.
template <class Trees>
Visit overlapsOf(const Trees& trees, const TraversalTask& task, PairBuffer& out) {
  return withPairing(trees, [&](const auto& pairing) HWY_ATTR {
    using Pairing = std::decay_t<decltype(pairing)>;
    if constexpr (Pairing::TreeA::kArity == 2) {
      CollectPairs query(out);
      if (task.node == TraversalTask::kAll) return visitAll<Trees>(pairing, query);
      return PairTraversal<Pairing, CollectPairs>(pairing, query).run(task);
    } else {
      return WideOverlaps<Pairing, Trees>(pairing, trees, out).run(task);
    }
  });
}

template <class Tree>
Visit overlapsOfVolume(const Tree& tree, const typename Tree::Volume& volume, SegmentId second,
                       Group group, PairBuffer& out) {
  CollectPairs query(out, second);
  return visitLeaves(tree, volume, query, group);
}

template <class Pack, class Volume>
simd::LaneMask overlapsOfPack(const Pack& pack, const Volume& volume) {
  return geometry::HWY_NAMESPACE::overlaps(pack, volume);
}
template <int N, template <int> class Pack, class Volume>
FCL_FIBERS_ALWAYS_INLINE int nearerOfPack(const Pack<N>& pack, const Volume& volume,
                                          simd::LaneMask lanes, float limit, int first,
                                          Place* places, int count, bool in_order) {
  float distances[N];
  for (auto rest = geometry::HWY_NAMESPACE::nearer(pack, volume, limit, distances) & lanes;
       rest != 0; rest &= rest - 1) {
    const int lane = __builtin_ctz(rest);
    const Place place(distances[lane], first + lane);
    int at = count++;
    for (; in_order && at > 0 && place < places[at - 1]; --at) places[at] = places[at - 1];
    places[at] = place;
  }
  return count;
}

template <class TreeA, class TreeB>
struct OwnTests {
  template <int N, template <int> class Pack, class Volume>
  FCL_FIBERS_ALWAYS_INLINE int nearer(const Pack<N>& pack, const Volume& volume,
                                      simd::LaneMask lanes, float limit, int first, Place* places,
                                      int count, bool in_order) const {
    return nearerOfPack(pack, volume, lanes, limit, first, places, count, in_order);
  }
};

template <class Tree>
Visit nearestToVolume(const Tree& tree, const typename Tree::Volume& volume, SegmentId second,
                      Group group, double limit, NearestVisitor& visitor) {
  VisitNearest<OwnTests<Tree, Tree>> query(second, limit, visitor);
  return visitLeaves(tree, volume, query, group);
}

template <class Tree>
constexpr Kernels<Tree> makeKernels() {
  Kernels<Tree> kernels = {};
  kernels.overlaps = overlapsOfPack<typename Tree::Pack, typename Tree::Volume>;
  kernels.within = overlapsOf<Tree>;
  kernels.between = overlapsOf<TreePair<Tree>>;
  kernels.with_mesh = overlapsOf<TreePair<Tree, typename Kernels<Tree>::Mesh>>;
  kernels.with_volume = overlapsOfVolume<Tree>;
  if constexpr (!Kernels<Tree>::kMoves) {
    kernels.nearer = nearerOfPack<Tree::kArity, Tree::Volume::template Pack, typename Tree::Volume>;
    if constexpr (Tree::kArity == 2) {
      kernels.nearest_to_volume = nearestToVolume<Tree>;
      kernels.nearest = nearestOf<OwnTests, Tree>;
      kernels.nearest_between = nearestOf<OwnTests, TreePair<Tree>>;
    }
  }
  return kernels;
}

template <class Tree>
constexpr Kernels<Tree> kKernels = makeKernels<Tree>();

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
