// SPDX-License-Identifier: BSD-3-Clause
#include "tree/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tree/box_kernels.cpp"
#include <hwy/foreach_target.h>

#include "tree/kernels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

const Kernels<LayeredBoxTree<2>>& boxes2() { return kKernels<LayeredBoxTree<2>>; }
const Kernels<LayeredBoxTree<8>>& boxes8() { return kKernels<LayeredBoxTree<8>>; }

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::tree {

HWY_EXPORT(boxes2);
HWY_EXPORT(boxes8);

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

}  // namespace fcl_fibers::tree
#endif
