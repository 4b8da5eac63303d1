// SPDX-License-Identifier: BSD-3-Clause
#include "live/displacements.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/rounding.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "live/displacements.cpp"
#include <hwy/foreach_target.h>

#include "simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::live::HWY_NAMESPACE {

using Four = simd::HWY_NAMESPACE::Lanes<4, double>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Calls add(end, anchor) for the first ends of the segments, and addSecond(end, anchor) for those
/// second ends that are not the first ones of the next. Most segments of a block follow each other
/// along a fiber.
template <class Add, class AddSecond>
FCL_FIBERS_ALWAYS_INLINE void forEnds(const AnchoredEnds& all, const Add& add,
                                      const AddSecond& addSecond) {
  for (int i = all.count; i < all.count + all.ahead; ++i) {
    const geometry::CapsuleEnd* const ends = &all.ends[all.placeOf(all.ids[i])];
    __builtin_prefetch(ends);
    __builtin_prefetch(ends + 1);
  }
  const Anchor* anchor = all.anchors;
  for (int i = 0; i < all.count; ++i) {
    const geometry::CapsuleEnd* const ends = &all.ends[all.placeOf(all.ids[i])];
    add(ends[0], *anchor++);
    if (!all.sharesSecond(i)) addSecond(ends[1], *anchor++);
  }
}

/// @tparam kTurns  whether the motion of the anchors is more than a shift
template <bool kTurns>
FCL_FIBERS_ALWAYS_INLINE Displacements bounded(const AnchoredEnds& all,
                                               const Displacing& displacing) {
  const Four scale = Four::load(displacing.scale), shift = Four::load(displacing.shift);
  const Four x = Four::load(displacing.columns[0]), y = Four::load(displacing.columns[1]);
  const Four z = Four::load(displacing.columns[2]), w = Four::load(displacing.columns[3]);
  const Four moved = Four::load(displacing.moved);
  const Four nothing = Four::all(kInfinity), all_of_it = Four::all(-kInfinity);
  Four first_low = nothing, first_high = all_of_it, second_low = nothing, second_high = all_of_it;
  Four sum = Four::all(0);
  const auto add = [&](const geometry::CapsuleEnd& from, const Anchor& to, Four& low, Four& high)
                       HWY_ATTR {
                         const float* const a = to.numbers;
                         const Four end = Four::load(from.numbers) * scale + shift;
                         Four anchor = moved;
                         if constexpr (kTurns) {
                           anchor = anchor + Four::all(a[0]) * x + Four::all(a[1]) * y +
                                    Four::all(a[2]) * z + Four::all(a[3]) * w;
                         } else {
                           anchor = anchor + Four::promoted(a);
                         }
                         const Four displacement = end.unlessNaN(kRadiusOfBox) - anchor;
                         sum = sum + displacement;
                         low = min(low, displacement);
                         high = max(high, displacement);
                       };
  using End = geometry::CapsuleEnd;
  forEnds(
      all, [&](const End& e, const Anchor& a) HWY_ATTR { add(e, a, first_low, first_high); },
      [&](const End& e, const Anchor& a) HWY_ATTR { add(e, a, second_low, second_high); });
  double first[2][4], second[2][4], sums[4];
  first_low.store(first[0]);
  first_high.store(first[1]);
  second_low.store(second[0]);
  second_high.store(second[1]);
  sum.store(sums);
  Displacements result;
  for (int axis = 0; axis < 3; ++axis) {
    result.low[axis] = std::min(first[0][axis], second[0][axis]);
    result.high[axis] = std::max(first[1][axis], second[1][axis]);
  }
  const bool is_box_or_capsule = first[0][3] > -0.5 * kRadiusOfBox;
  result.growth = is_box_or_capsule ? std::max(first[1][3], 0.0) : kInfinity;
  // Minima and maxima may pass over NaN, and sums do not.
  result.are_finite = std::isfinite(sums[0] + sums[1] + sums[2]);
  return result;
}

Displacements displacementsOf(const AnchoredEnds& ends, const Displacing& displacing) {
  return displacing.turns ? bounded<true>(ends, displacing) : bounded<false>(ends, displacing);
}

}  // namespace fcl_fibers::live::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::live {

HWY_EXPORT(displacementsOf);

Displacements displacementsOf(const AnchoredEnds& ends, const Displacing& displacing) {
  return HWY_DYNAMIC_DISPATCH(displacementsOf)(ends, displacing);
}

geometry::Box boxAround(const AnchoredEnds& ends) {
  geometry::Box box = geometry::Box::empty();
  float radius = 0;
  const auto add = [&box](const Anchor& anchor) {
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] = std::min(box.low[axis], anchor.numbers[axis]);
      box.high[axis] = std::max(box.high[axis], anchor.numbers[axis]);
    }
  };
  const Anchor* anchor = ends.anchors;
  for (int i = 0; i < ends.count; ++i) {
    if (anchor->numbers[3] != kRadiusOfBox) radius = std::max(radius, anchor->numbers[3]);
    add(*anchor++);
    if (!ends.sharesSecond(i)) add(*anchor++);
  }
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = geometry::roundedDown(double{box.low[axis]} - double{radius});
    box.high[axis] = geometry::roundedUp(double{box.high[axis]} + double{radius});
  }
  return box;
}

Displacing::Displacing(const geometry::FrameChange* to_anchors, const geometry::AffineMap& motion)
    : turns(motion.turns()) {
  const geometry::Vec3d to = to_anchors != nullptr ? to_anchors->shift() : geometry::Vec3d{0, 0, 0};
  const double length = to_anchors != nullptr ? to_anchors->scale() : 1;
  for (double& number : scale) number = length;
  const auto set = [](double(&out)[4], const geometry::Vec3d& v, double last) {
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
    out[3] = last;
  };
  set(shift, to, 0);
  for (int i = 0; i < 3; ++i) set(columns[i], motion.column[i], 0);
  set(columns[3], {0, 0, 0}, 1);
  set(moved, motion.shift, 0);
}

}  // namespace fcl_fibers::live
#endif
