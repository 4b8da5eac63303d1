// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/point_boxes.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/point_boxes.cpp"
#include <hwy/foreach_target.h>

#include "geometry/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

struct Bounds {
  Points low, high;

  Bounds() {
    const auto infinity = hn::Inf(Doubles());
    low = {infinity, infinity, infinity};
    high = {hn::Neg(infinity), hn::Neg(infinity), hn::Neg(infinity)};
  }
  FCL_FIBERS_ALWAYS_INLINE void add(const Points& p) {
    low = {hn::Min(low.x, p.x), hn::Min(low.y, p.y), hn::Min(low.z, p.z)};
    high = {hn::Max(high.x, p.x), hn::Max(high.y, p.y), hn::Max(high.z, p.z)};
  }
  FCL_FIBERS_ALWAYS_INLINE void write(Vec3d& least, Vec3d& greatest) const {
    const Doubles d;
    least = {hn::GetLane(hn::MinOfLanes(d, low.x)), hn::GetLane(hn::MinOfLanes(d, low.y)),
             hn::GetLane(hn::MinOfLanes(d, low.z))};
    greatest = {hn::GetLane(hn::MaxOfLanes(d, high.x)), hn::GetLane(hn::MaxOfLanes(d, high.y)),
                hn::GetLane(hn::MaxOfLanes(d, high.z))};
  }
};

template <typename T>
PointBoxes findBoxes(const T* points, std::size_t count, const AffineMap& map) {
  const Doubles d;
  constexpr std::size_t kLanes = hn::MaxLanes(Doubles());
  PointBoxes boxes{};
  if (count == 0) return boxes;
  // A point may be looked at twice, which changes no box.
  T few[3 * kLanes];
  if (count < kLanes) {
    for (std::size_t i = 0; i < 3 * kLanes; ++i) few[i] = points[i % (3 * count)];
    points = few;
    count = kLanes;
  }
  const Vec3d* const c = map.column;
  const auto row = [&](const Points& p, double Vec3d::*axis) HWY_ATTR {
    return hn::Add(
        hn::Add(hn::Mul(p.x, hn::Set(d, c[0].*axis)), hn::Mul(p.y, hn::Set(d, c[1].*axis))),
        hn::Mul(p.z, hn::Set(d, c[2].*axis)));
  };
  const auto posed = [&](const Points& p) HWY_ATTR {
    return Points{row(p, &Vec3d::x), row(p, &Vec3d::y), row(p, &Vec3d::z)};
  };
  // What is not finite leaves no image that is, and no sum. Those of finite numbers may overflow.
  const auto zero = hn::Zero(d);
  auto sum = zero;
  Bounds local, turned;
  for (std::size_t i = 0; i < count; i += kLanes) {
    const Points p = Points::load(points + 3 * (i + kLanes <= count ? i : count - kLanes));
    const Points q = posed(p);
    local.add(p);
    turned.add(q);
    sum = hn::Add(sum, q.x);
  }
  local.write(boxes.low, boxes.high);
  turned.write(boxes.posed_low, boxes.posed_high);
  const auto isFinite = [](T x) { return std::isfinite(x); };
  boxes.is_proper = hn::AllTrue(d, hn::Eq(hn::Mul(sum, zero), zero)) ||
                    std::all_of(points, points + 3 * count, isFinite);
  return boxes;
}

PointBoxes boxesOfDoubles(const double* points, std::size_t count, const AffineMap& map) {
  return findBoxes(points, count, map);
}
PointBoxes boxesOfFloats(const float* points, std::size_t count, const AffineMap& map) {
  return findBoxes(points, count, map);
}

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::geometry {

HWY_EXPORT(boxesOfDoubles);
HWY_EXPORT(boxesOfFloats);

PointBoxes boxesOf(const double* points, std::size_t count, const AffineMap& map) {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(boxesOfDoubles)(points, count, map);
}
PointBoxes boxesOf(const float* points, std::size_t count, const AffineMap& map) {
  simd::readEnvironment();
  return HWY_DYNAMIC_DISPATCH(boxesOfFloats)(points, count, map);
}

}  // namespace fcl_fibers::geometry
#endif
