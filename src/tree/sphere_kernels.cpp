// SPDX-License-Identifier: BSD-3-Clause
#include "tree/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tree/sphere_kernels.cpp"
#include <hwy/foreach_target.h>

#include "tree/kernels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

const Kernels<WrappedSphereTree<2>>& spheres2() { return kKernels<WrappedSphereTree<2>>; }
const Kernels<WrappedSphereTree<8>>& spheres8() { return kKernels<WrappedSphereTree<8>>; }

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::tree {

HWY_EXPORT(spheres2);
HWY_EXPORT(spheres8);

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
