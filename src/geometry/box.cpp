// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/box.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/box.cpp"
#include <hwy/foreach_target.h>

#include "simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// These repeat Box::around(), roundedDown() and endPointError() for several segments at once,
// operation by operation, so that the results are the same to the last bit.

using Doubles = hn::CappedTag<double, 4>;
using Floats = hn::Rebind<float, Doubles>;
using DoubleLanes = hn::Vec<Doubles>;

FCL_FIBERS_ALWAYS_INLINE DoubleLanes outwardStep(const DoubleLanes& x) {
  const Doubles d;
  return hn::Add(hn::Mul(hn::Abs(x), hn::Set(d, std::numeric_limits<float>::epsilon())),
                 hn::Set(d, std::numeric_limits<float>::min()));
}
FCL_FIBERS_ALWAYS_INLINE void storeRoundedDown(const DoubleLanes& x, float* out) {
  const auto below = hn::Sub(x, outwardStep(x));
  const auto most = hn::Set(Doubles(), std::numeric_limits<float>::max());
  hn::StoreU(hn::DemoteTo(Floats(), hn::Min(below, most)), Floats(), out);
}
FCL_FIBERS_ALWAYS_INLINE void storeRoundedUp(const DoubleLanes& x, float* out) {
  const auto above = hn::Add(x, outwardStep(x));
  const auto least = hn::Set(Doubles(), -std::numeric_limits<float>::max());
  hn::StoreU(hn::DemoteTo(Floats(), hn::Max(above, least)), Floats(), out);
}

void boxesAround(const SegmentBlock& segments, int count, double padding, BoxRows& boxes,
                 int first) {
  const Doubles d;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(Doubles()));
  static_assert(SegmentBlock::kCapacity % kLanes == 0);
  for (int i = 0; i < count; i += kLanes) {
    DoubleLanes low[3], high[3], largest = hn::Zero(d);
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = hn::Load(d, segments.a[axis] + i), b = hn::Load(d, segments.b[axis] + i);
      low[axis] = hn::Min(a, b);
      high[axis] = hn::Max(a, b);
      largest = hn::Max(largest, hn::Max(hn::Abs(a), hn::Abs(b)));
    }
    const auto error = hn::Mul(hn::Set(d, 8 * std::numeric_limits<double>::epsilon()), largest);
    const auto thickness = hn::Max(hn::Load(d, segments.radius + i), hn::Zero(d));
    const auto reach = hn::Add(hn::Add(thickness, hn::Set(d, padding)), error);
    for (int axis = 0; axis < 3; ++axis) {
      storeRoundedDown(hn::Sub(low[axis], reach), boxes.low[axis] + first + i);
      storeRoundedUp(hn::Add(high[axis], reach), boxes.high[axis] + first + i);
    }
    // Near the end of float's range the targets differ, and boxes that are open to a side have
    // errors of their own. Both are rare.
    const auto is_near = hn::Le(hn::Add(largest, reach), hn::Set(d, 0x1p126));
    const auto is_far = hn::AndNot(is_near, hn::FirstN(d, static_cast<std::size_t>(count - i)));
    if (hn::AllFalse(d, is_far)) continue;
    for (int k = i; k < std::min(i + kLanes, count); ++k) {
      const Box box = Box::around(segments[k], padding);
      for (int axis = 0; axis < 3; ++axis) {
        boxes.low[axis][first + k] = box.low[axis];
        boxes.high[axis][first + k] = box.high[axis];
      }
    }
  }
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::geometry {

HWY_EXPORT(boxesAround);

void boxesAround(const SegmentBlock& segments, int count, double padding, BoxRows& boxes,
                 int first) {
  simd::readEnvironment();
  HWY_DYNAMIC_DISPATCH(boxesAround)(segments, count, padding, boxes, first);
}

}  // namespace fcl_fibers::geometry
#endif
