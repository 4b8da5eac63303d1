// SPDX-License-Identifier: BSD-3-Clause
#include "live/node_pack.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "live/node_pack.cpp"
#include <hwy/foreach_target.h>

#include "simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::live::HWY_NAMESPACE {

using Eight = simd::HWY_NAMESPACE::Lanes<NodePack::kSize>;

void findUncovered(const NodePack& first, simd::LaneMask rows, const NodePack& second,
                   const Cover& cover, simd::LaneMask* columns) {
  // Makes up for the rounding of the few operations behind it, and for squares that vanish.
  constexpr float kOutward = 1 + 0x1p-18F, kLeast = 0x1p-120F;
  const Eight outward = Eight::all(kOutward), least = Eight::all(kLeast), zero = Eight::all(0);
  const Eight most = Eight::all(cover.most), margin = Eight::all(cover.margin);
  const Eight stretch = Eight::all(cover.stretch * kOutward);
  for (; rows != 0; rows &= rows - 1) {
    const int row = __builtin_ctz(rows);
    Eight approach = least, gap = zero;
    for (int axis = 0; axis < 3; ++axis) {
      const Eight nearer =
          max(Eight::all(first.moved.high(axis)[row]) - Eight::load(second.moved.low(axis)),
              Eight::load(second.moved.high(axis)) - Eight::all(first.moved.low(axis)[row]));
      approach = approach + nearer * nearer;
      const Eight apart =
          max(max(Eight::all(first.where.low(axis)[row]) - Eight::load(second.where.high(axis)),
                  Eight::load(second.where.low(axis)) - Eight::all(first.where.high(axis)[row])),
              zero);
      gap = gap + apart * apart;
    }
    const Eight growth = Eight::all(first.growth[row]) + Eight::load(second.growth);
    approach = (squareRoot(approach) + growth) * outward;
    const Eight reach = (approach + margin) * stretch;
    // An infinite approach is never covered. No node that is there has NaN.
    const Eight::Truth covered = either(approach <= most, reach * reach < gap);
    columns[row] = ~covered.mask() & simd::firstLanes(NodePack::kSize);
  }
}

}  // namespace fcl_fibers::live::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::live {

HWY_EXPORT(findUncovered);

void findUncovered(const NodePack& first, simd::LaneMask rows, const NodePack& second,
                   const Cover& cover, simd::LaneMask* columns) {
  HWY_DYNAMIC_DISPATCH(findUncovered)(first, rows, second, cover, columns);
}

}  // namespace fcl_fibers::live
#endif
