// SPDX-License-Identifier: BSD-3-Clause
// Compiled once for every instruction set; see simd/lanes-inl.h.
#if defined(FCL_FIBERS_GEOMETRY_POINTS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_GEOMETRY_POINTS_INL_H
#undef FCL_FIBERS_GEOMETRY_POINTS_INL_H
#else
#define FCL_FIBERS_GEOMETRY_POINTS_INL_H
#endif

#include "simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::geometry::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, 8>;
using DoubleLanes = hn::Vec<Doubles>;

/// Points that a program has one after the other, in lanes.
struct Points {
  DoubleLanes x, y, z;

  FCL_FIBERS_ALWAYS_INLINE static Points load(const double* points) {
    Points p;
    hn::LoadInterleaved3(Doubles(), points, p.x, p.y, p.z);
    return p;
  }
  FCL_FIBERS_ALWAYS_INLINE static Points load(const float* points) {
    const Doubles d;
    const hn::Rebind<float, Doubles> floats;
    hn::Vec<decltype(floats)> x, y, z;
    hn::LoadInterleaved3(floats, points, x, y, z);
    return {hn::PromoteTo(d, x), hn::PromoteTo(d, y), hn::PromoteTo(d, z)};
  }
};

}  // namespace fcl_fibers::geometry::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
