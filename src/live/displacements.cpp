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

/// Bounds by how much radii have grown, by the least and the largest difference.
FCL_FIBERS_ALWAYS_INLINE double growthOf(double least, double most) {
  const bool is_box_or_capsule = least > -0.5 * kRadiusOfBox;
  return is_box_or_capsule ? std::max(most, 0.0) : kInfinity;
}

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

/// Takes an end and its anchor to the displacement.
/// @tparam kTurns  whether the motion of the anchors is more than a shift
template <bool kTurns>
class Displace {
 public:
  FCL_FIBERS_ALWAYS_INLINE explicit Displace(const Displacing& displacing)
      : scale_(Four::load(displacing.scale)),
        shift_(Four::load(displacing.shift)),
        x_(Four::load(displacing.columns[0])),
        y_(Four::load(displacing.columns[1])),
        z_(Four::load(displacing.columns[2])),
        w_(Four::load(displacing.columns[3])),
        moved_(Four::load(displacing.moved)) {}

  FCL_FIBERS_ALWAYS_INLINE Four operator()(const geometry::CapsuleEnd& from,
                                           const Anchor& to) const {
    const float* const a = to.numbers;
    const Four end = Four::load(from.numbers) * scale_ + shift_;
    Four anchor = moved_;
    if constexpr (kTurns) {
      anchor = anchor + Four::all(a[0]) * x_ + Four::all(a[1]) * y_ + Four::all(a[2]) * z_ +
               Four::all(a[3]) * w_;
    } else {
      anchor = anchor + Four::promoted(a);
    }
    return end.unlessNaN(kRadiusOfBox) - anchor;
  }

 private:
  Four scale_, shift_, x_, y_, z_, w_, moved_;
};

template <bool kTurns>
FCL_FIBERS_ALWAYS_INLINE Displacements bounded(const AnchoredEnds& all,
                                               const Displacing& displacing) {
  const Displace<kTurns> displace(displacing);
  const Four nothing = Four::all(kInfinity), all_of_it = Four::all(-kInfinity);
  Four first_low = nothing, first_high = all_of_it, second_low = nothing, second_high = all_of_it;
  Four sum = Four::all(0);
  const auto add = [&](const geometry::CapsuleEnd& from, const Anchor& to, Four& low, Four& high)
                       HWY_ATTR {
                         const Four displacement = displace(from, to);
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
  // The second end of a capsule has the radius of another one or none.
  result.growth = all.may_taper ? growthOf(std::min(first[0][3], second[0][3]),
                                           std::max(first[1][3], second[1][3]))
                                : growthOf(first[0][3], first[1][3]);
  // Minima and maxima may pass over NaN, and sums do not.
  result.are_finite = std::isfinite(sums[0] + sums[1] + sums[2]);
  return result;
}

Displacements displacementsOf(const AnchoredEnds& ends, const Displacing& displacing) {
  return displacing.turns ? bounded<true>(ends, displacing) : bounded<false>(ends, displacing);
}

template <bool kTurns>
FCL_FIBERS_ALWAYS_INLINE void boundEach(const AnchoredEnds& all, const Displacing& displacing,
                                        Displacements* out) {
  const Displace<kTurns> displace(displacing);
  const Anchor* anchor = all.anchors;
  double first[4], second[4];
  for (int i = 0; i < all.count; ++i) {
    const geometry::CapsuleEnd* const ends = &all.ends[all.placeOf(all.ids[i])];
    if (i == 0 || !all.sharesSecond(i - 1)) {
      displace(ends[0], anchor[0]).store(first);
    } else {
      std::copy(second, second + 4, first);
    }
    displace(ends[1], anchor[1]).store(second);
    anchor += all.sharesSecond(i) ? 1 : 2;
    double sum = 0;
    for (int axis = 0; axis < 3; ++axis) {
      out[i].low[axis] = std::min(first[axis], second[axis]);
      out[i].high[axis] = std::max(first[axis], second[axis]);
      sum += first[axis] + second[axis];
    }
    const double last = all.may_taper ? second[3] : first[3];
    out[i].growth = growthOf(std::min(first[3], last), std::max(first[3], last));
    out[i].are_finite = std::isfinite(sum);
  }
}

void eachDisplacement(const AnchoredEnds& ends, const Displacing& displacing, Displacements* out) {
  displacing.turns ? boundEach<true>(ends, displacing, out)
                   : boundEach<false>(ends, displacing, out);
}

}  // namespace fcl_fibers::live::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::live {

HWY_EXPORT(displacementsOf);
HWY_EXPORT(eachDisplacement);

Displacements displacementsOf(const AnchoredEnds& ends, const Displacing& displacing) {
  return HWY_DYNAMIC_DISPATCH(displacementsOf)(ends, displacing);
}
void eachDisplacement(const AnchoredEnds& ends, const Displacing& displacing, Displacements* out) {
  HWY_DYNAMIC_DISPATCH(eachDisplacement)(ends, displacing, out);
}

geometry::Box boxAround(const AnchoredEnds& ends) {
  geometry::Box box = geometry::Box::empty();
  float radius = 0;
  const auto add = [&](const Anchor& anchor) {
    if (anchor.numbers[3] != kRadiusOfBox) radius = std::max(radius, anchor.numbers[3]);
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] = std::min(box.low[axis], anchor.numbers[axis]);
      box.high[axis] = std::max(box.high[axis], anchor.numbers[axis]);
    }
  };
  const Anchor* anchor = ends.anchors;
  for (int i = 0; i < ends.count; ++i) {
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
