// SPDX-License-Identifier: BSD-3-Clause
#include "tree/search.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tree/search.cpp"
#include <hwy/foreach_target.h>

#include "tree/kernels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

template <class Trees>
constexpr PairKernels<Trees> kPairKernels = {
    kOverlapKernels<Trees>.splitIntoTasks,
    kOverlapKernels<Trees>.overlaps,
    [](const Trees& trees, double limit, NearestVisitor& visitor) HWY_ATTR {
      VisitNearest query(limit, visitor);
      return visitPairs(trees, query);
    },
};

template <class Tree, class Volume = typename Tree::Volume>
constexpr Kernels<Tree> kKernels = {
    kPairKernels<Tree>,
    kPairKernels<TreePair<Tree>>,
    overlapsVolume<Tree>,
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
