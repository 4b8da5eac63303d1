// SPDX-License-Identifier: BSD-3-Clause
#if defined(FCL_FIBERS_GEOMETRY_VOLUME_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_GEOMETRY_VOLUME_INL_H
#undef FCL_FIBERS_GEOMETRY_VOLUME_INL_H
#else
#define FCL_FIBERS_GEOMETRY_VOLUME_INL_H
#endif

#include <limits>

#include "geometry/box.h"
#include "geometry/moving_box.h"
#include "geometry/sphere.h"
#include "simd/lanes-inl.h"

// A bounding volume `V` is a plain value over floats with
//
//   V::around(segment, padding)       the volume around a capsule thickened by padding, rounded
//                                     outward
//   v.size()                          a length that orders volumes by how much they cover
//   V::Pack<N>                        N volumes as a structure of arrays
//   pack.set(lane, v), pack.get(lane), pack.clear(lane)
//   overlaps(pack, v)                 a bit for each lane whose volume overlaps v
//   nearer(pack, v, limit, out)       a bit for each lane whose volume may be no farther than
//                                     limit from v, and lower bounds of the distances
//
// A cleared lane overlaps nothing and is near nothing, not even an unbounded volume: it holds NaN,
// which no comparison accepts. For boxes LayeredBoxes also needs pack.replace(), replaceAll(),
// unite() and boxesAround(). For spheres WrappedSpheres also needs V::around(ball).

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

using simd::LaneMask;
using simd::HWY_NAMESPACE::Lanes;

// Each function returns a bit for each lane of a pack whose volume overlaps another volume.

template <int N>
FCL_FIBERS_ALWAYS_INLINE LaneMask overlaps(const Box::Pack<N>& pack, const Box& box) {
  const auto overlap = [&](int axis) HWY_ATTR {
    return (Lanes<N>::load(pack.low(axis)) <= Lanes<N>::all(box.high[axis])) &
           (Lanes<N>::all(box.low[axis]) <= Lanes<N>::load(pack.high(axis)));
  };
  return (overlap(0) & overlap(1) & overlap(2)).mask();
}

template <int N>
FCL_FIBERS_ALWAYS_INLINE LaneMask overlaps(const Sphere::Pack<N>& pack, const Sphere& sphere) {
  // The two sides carry at most seven roundings in one direction, each of 2^-23 in any mode. The
  // smallest normal float covers losses below it.
  constexpr float kRoundUp = 1 + 0x1p-20f;
  const Lanes<N> x = Lanes<N>::load(pack.center(0)) - Lanes<N>::all(sphere.center[0]);
  const Lanes<N> y = Lanes<N>::load(pack.center(1)) - Lanes<N>::all(sphere.center[1]);
  const Lanes<N> z = Lanes<N>::load(pack.center(2)) - Lanes<N>::all(sphere.center[2]);
  const Lanes<N> reach = Lanes<N>::load(pack.radius()) + Lanes<N>::all(sphere.radius);
  const Lanes<N> reach_squared =
      reach * reach * Lanes<N>::all(kRoundUp) + Lanes<N>::all(std::numeric_limits<float>::min());
  return (x * x + y * y + z * z <= reach_squared).mask();
}

namespace internal {

/// By how much the high side of one box is above the low side of the other, on one of six sides. It
/// is no function, because gcc 12 then keeps the depths of eight boxes in memory with SSE4.
template <int N>
constexpr auto depth = [](int side, const Box::Pack<N>& boxes, const Box& other) HWY_ATTR {
  const int axis = side % 3;
  return side < 3 ? Lanes<N>::load(boxes.high(axis)) - Lanes<N>::all(other.low[axis])
                  : Lanes<N>::all(other.high[axis]) - Lanes<N>::load(boxes.low(axis));
};

/// Takes one depth into the shares of a step before and after the time at which boxes overlap. See
/// overlaps().
template <int N>
FCL_FIBERS_ALWAYS_INLINE void addShare(const Lanes<N>& start, const Lanes<N>& end, Lanes<N>& waits,
                                       Lanes<N>& parts) {
  using Row = Lanes<N>;
  const Row zero = Row::all(0);
  const Row low = min(start, end), high = max(start, end);
  const Row share = quotient(zero - low, high - low) * Row::all(1 - 0x1p-21f);
  // The share is infinite where a difference of 0 is -0, as in a program that rounds down.
  const auto at_start = start <= end, some_time = share <= Row::all(1);
  waits = max(waits, choose(at_start & some_time, share, zero));
  parts = max(parts, choose(at_start, zero, choose(some_time, share, zero)));
}

/// Whether two boxes overlap between the start and the end, behind a call. A copy at each test
/// would take more time in a traversal of two children, although the depths are computed again.
HWY_NOINLINE inline LaneMask overlapsBetween(const MovingBox::Pack<2>& pack, const MovingBox& box) {
  using Row = Lanes<2>;
  Row waits = Row::all(0), parts = Row::all(0);
  for (int side = 0; side < 6; ++side) {
    addShare(depth<2>(side, pack.start(), box.start), depth<2>(side, pack.end(), box.end), waits,
             parts);
  }
  return ((waits + parts <= Row::all(1)) & (waits <= Row::all(pack.until()))).mask();
}

}  // namespace internal

/// Whether they overlap at one common time, up to the pack's last one.
///
/// The high side of one box is above the low side of the other by a depth that changes linearly.
/// The two overlap while no depth is negative. Most pairs that do so at any time do so at the start
/// or at the end. If the depths at the start and the end differ in sign, with `low` for the lesser
/// and `high` for the greater, then the depth is negative during a share -low / (high - low) of the
/// step: at its beginning if the depth grows, else at its end. The three roundings of the share
/// amount to less than 2^-21 of it. Where the difference overflows, the share is 0 or NaN, which
/// means any time. A depth that vanishes below float's range is less than the step by which the
/// boxes were rounded outward.
template <int N>
FCL_FIBERS_ALWAYS_INLINE LaneMask overlaps(const MovingBox::Pack<N>& pack, const MovingBox& box) {
  using Row = Lanes<N>;
  const Row zero = Row::all(0), one = Row::all(1);
  Row start[6], end[6];
  Row least_at_start = one, least_at_end = one, least_of_greatest = one;
  for (int side = 0; side < 6; ++side) {
    start[side] = internal::depth<N>(side, pack.start(), box.start);
    end[side] = internal::depth<N>(side, pack.end(), box.end);
    least_at_start = min(least_at_start, start[side]);
    least_at_end = min(least_at_end, end[side]);
    least_of_greatest = min(least_of_greatest, max(start[side], end[side]));
  }
  // Cleared lanes hold NaN, of which the operations above make anything.
  const Row first_low = Row::load(pack.start().low(0)), last_low = Row::load(pack.end().low(0));
  const LaneMask some =
      ((zero <= least_of_greatest) & (first_low <= first_low) & (last_low <= last_low)).mask();
  const LaneMask at_one_end = (zero <= least_at_start).mask() |
                              ((zero <= least_at_end) & (one <= Row::all(pack.until()))).mask();
  if ((some & ~at_one_end) == 0) return some;
  if constexpr (N == 2) {
    return some & (at_one_end | internal::overlapsBetween(pack, box));
  } else {
    Row waits = zero, parts = zero;
    for (int side = 0; side < 6; ++side) internal::addShare(start[side], end[side], waits, parts);
    return some &
           (at_one_end | ((waits + parts <= one) & (waits <= Row::all(pack.until()))).mask());
  }
}

namespace internal {

/// A lower bound of the length of a vector with these components. They are clamped to numbers that
/// can be squared, the smallest normal float covers the losses of squares below it, and the last
/// factor covers five roundings, in whatever direction.
template <int N>
FCL_FIBERS_ALWAYS_INLINE Lanes<N> lengthLowerBound(const Lanes<N>& x, const Lanes<N>& y,
                                                   const Lanes<N>& z) {
  const auto squared = [](const Lanes<N>& d) HWY_ATTR {
    const Lanes<N> clamped = min(max(d, Lanes<N>::all(0) - d), Lanes<N>::all(0x1p62f));
    return clamped * clamped;
  };
  const Lanes<N> sum = squared(x) + squared(y) + squared(z);
  constexpr float kLeast = std::numeric_limits<float>::min();
  return squareRoot(max(sum - Lanes<N>::all(kLeast), Lanes<N>::all(0))) *
         Lanes<N>::all(1 - 0x1p-20f);
}

}  // namespace internal

// Each function returns a bit for each lane of a pack whose volume may be no farther than `limit`
// from another volume, and stores lower bounds of their distances.

template <int N>
FCL_FIBERS_ALWAYS_INLINE LaneMask nearer(const Box::Pack<N>& pack, const Box& box, float limit,
                                         float (&distances)[N]) {
  const auto gap = [&](int axis) HWY_ATTR {
    return max(max(Lanes<N>::load(pack.low(axis)) - Lanes<N>::all(box.high[axis]),
                   Lanes<N>::all(box.low[axis]) - Lanes<N>::load(pack.high(axis))),
               Lanes<N>::all(0));
  };
  const Lanes<N> distance = internal::lengthLowerBound(gap(0), gap(1), gap(2));
  distance.store(distances);
  const Lanes<N> low = Lanes<N>::load(pack.low(0));
  return ((distance <= Lanes<N>::all(limit)) & (low <= low)).mask();
}

template <int N>
FCL_FIBERS_ALWAYS_INLINE LaneMask nearer(const Sphere::Pack<N>& pack, const Sphere& sphere,
                                         float limit, float (&distances)[N]) {
  const auto difference = [&](int axis) HWY_ATTR {
    return Lanes<N>::load(pack.center(axis)) - Lanes<N>::all(sphere.center[axis]);
  };
  const Lanes<N> radius = Lanes<N>::load(pack.radius());
  const Lanes<N> reach = (radius + Lanes<N>::all(sphere.radius)) * Lanes<N>::all(1 + 0x1p-21f);
  const Lanes<N> distance =
      max(internal::lengthLowerBound(difference(0), difference(1), difference(2)) - reach,
          Lanes<N>::all(0));
  distance.store(distances);
  return ((distance <= Lanes<N>::all(limit)) & (radius <= radius)).mask();
}

/// The least box around all boxes of a pack; it is empty (low > high) if all lanes are clear.
template <int N>
FCL_FIBERS_ALWAYS_INLINE Box unite(const Box::Pack<N>& pack) {
  using Row = Lanes<N>;
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
  using Row = Lanes<N>;
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
