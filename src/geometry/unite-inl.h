// SPDX-License-Identifier: BSD-3-Clause
#if defined(FCL_FIBERS_GEOMETRY_UNITE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_GEOMETRY_UNITE_INL_H
#undef FCL_FIBERS_GEOMETRY_UNITE_INL_H
#else
#define FCL_FIBERS_GEOMETRY_UNITE_INL_H
#endif

#include <limits>

#include "geometry/box.h"
#include "simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

/// The least box around all boxes of a pack; it is empty (low > high) if all lanes are clear.
template <int N>
FCL_FIBERS_ALWAYS_INLINE Box unite(const Box::Pack<N>& pack) {
  using Row = simd::HWY_NAMESPACE::Lanes<N>;
  // Not infinity, which Highway's emulation of instruction sets would replace by this number.
  constexpr float kLargest = std::numeric_limits<float>::max();
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = Row::load(pack.low(axis)).unlessNaN(kLargest).least();
    box.high[axis] = Row::load(pack.high(axis)).unlessNaN(-kLargest).greatest();
  }
  return box;
}

/// Sets all lanes of a pack, the first `count` of them to the boxes from `first` on, and clears the
/// others. Returns whether any has changed.
template <int N>
FCL_FIBERS_ALWAYS_INLINE bool replaceAll(Box::Pack<N>& pack, const BoxRows& boxes, int first,
                                         int count) {
  using Row = simd::HWY_NAMESPACE::Lanes<N>;
  Row low[3], high[3];
  bool changed = false;
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = Row::loadFirst(&boxes.low[axis][first], count);
    high[axis] = Row::loadFirst(&boxes.high[axis][first], count);
    changed |= low[axis].differs(Row::load(pack.low(axis)));
    changed |= high[axis].differs(Row::load(pack.high(axis)));
  }
  if (!changed) return false;
  for (int axis = 0; axis < 3; ++axis) {
    low[axis].storeAligned(pack.low(axis));
    high[axis].storeAligned(pack.high(axis));
  }
  return true;
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
