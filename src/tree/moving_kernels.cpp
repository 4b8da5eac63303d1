// SPDX-License-Identifier: BSD-3-Clause
#include "tree/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tree/moving_kernels.cpp"
#include <hwy/foreach_target.h>

#include "tree/kernels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

const Kernels<MovingTree<2>>& moving2() { return kKernels<MovingTree<2>>; }
const Kernels<MovingTree<8>>& moving8() { return kKernels<MovingTree<8>>; }

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::tree {

HWY_EXPORT(moving2);
HWY_EXPORT(moving8);

template <>
const Kernels<MovingTree<2>>& kernels() {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(moving2)();
}
template <>
const Kernels<MovingTree<8>>& kernels() {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(moving8)();
}

}  // namespace fcl_fibers::tree
#endif
