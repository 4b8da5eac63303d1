// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <fcl_fibers/fiber_tree.h>

#include "arrays/array_fibers.h"
#include "geometry/segment.h"
#include "support/cone_oracle.h"
#include "support/segments.h"

namespace fcl_fibers::test {

/// A segment of arrays by their definition.
struct GivenCone {
  std::int32_t name;  ///< its first point
  std::size_t fiber;
  geometry::Segment cone;
};

template <typename S>
std::vector<GivenCone> conesOf(const FiberArrays<S>& fibers) {
  using Radii = typename FiberArrays<S>::Radii;
  constexpr auto kSize = static_cast<std::ptrdiff_t>(sizeof(S));
  const std::ptrdiff_t point = fibers.point_stride != 0 ? fibers.point_stride / kSize : 3;
  const std::ptrdiff_t axis = fibers.axis_stride != 0 ? fibers.axis_stride / kSize : 1;
  const auto at = [&](std::size_t i) {
    const S* const x = fibers.points + static_cast<std::ptrdiff_t>(i) * point;
    return geometry::Vec3d{double{x[0]}, double{x[axis]}, double{x[2 * axis]}};
  };
  const auto radiusAt = [&](std::size_t i, std::size_t f) {
    const bool is_one = fibers.radii_are == Radii::kOne;
    return double{fibers.radii[is_one ? 0 : fibers.radii_are == Radii::kPerFiber ? f : i]};
  };
  std::vector<GivenCone> cones;
  for (std::size_t f = 0; f < fibers.fiber_count; ++f) {
    const bool has_end = fibers.point_end != nullptr;
    const std::size_t end = has_end ? fibers.point_end[f] : fibers.point_begin[f + 1];
    for (std::size_t i = fibers.point_begin[f]; i + 1 < end; ++i) {
      const double radius = radiusAt(i, f);
      const double last = fibers.radii_are == Radii::kPerPoint ? radiusAt(i + 1, f) : radius;
      cones.push_back({static_cast<std::int32_t>(i), f,
                       geometry::Segment::cone(at(i), at(i + 1), radius, last)});
    }
  }
  return cones;
}

/// The distance of two segments; above `most` a lower bound.
inline double distanceUpTo(const geometry::Segment& p, const geometry::Segment& q, double most) {
  const auto around = static_cast<double>(geometry::capsuleDistance(p, q));
  const bool is_plain = !p.isTapered() && !q.isTapered();
  return is_plain || around > most ? around : static_cast<double>(coneDistance(p, q));
}

/// Whether two segments are at most `margin` apart, which must not be a matter of rounding. Tips
/// that are one point are exactly 0 apart.
inline bool areWithin(const GivenCone& p, const GivenCone& q, double margin) {
  const double size = 1 + std::fabs(margin) + maxNorm(p.cone.a) + maxNorm(q.cone.a);
  const double gap = distanceUpTo(p.cone, q.cone, margin) - margin;
  EXPECT_TRUE(gap == 0 || std::fabs(gap) > 1e-12 * size) << "another seed will do";
  return gap <= 0;
}

/// The pairs of one set of segments, without neighbours of fibers that are closed or not and
/// without those of one group.
template <typename S>
PairList touchingCones(const FiberArrays<S>& fibers, int ignored, double margin) {
  const std::vector<GivenCone> cones = conesOf(fibers);
  std::vector<std::int32_t> counts(fibers.fiber_count);
  for (const GivenCone& cone : cones) ++counts[cone.fiber];
  PairList pairs;
  for (std::size_t i = 0; i < cones.size(); ++i) {
    for (std::size_t j = i + 1; j < cones.size(); ++j) {
      const GivenCone &p = cones[i], &q = cones[j];
      if (p.fiber == q.fiber) {
        const bool is_closed = fibers.closed != nullptr && fibers.closed[p.fiber] != 0;
        const std::int32_t apart = q.name - p.name;
        if (apart <= ignored || (is_closed && counts[p.fiber] - apart <= ignored)) continue;
      }
      const std::int32_t group = fibers.groups != nullptr ? fibers.groups[p.fiber] : 0;
      if (group != 0 && group == fibers.groups[q.fiber]) continue;
      if (areWithin(p, q, margin)) pairs.emplace_back(p.name, q.name);
    }
  }
  return pairs;
}

/// The pairs of two sets.
template <typename S, typename T>
PairList touchingCones(const FiberArrays<S>& fibers, const FiberArrays<T>& others, double margin) {
  const std::vector<GivenCone> second = conesOf(others);
  PairList pairs;
  for (const GivenCone& p : conesOf(fibers)) {
    for (const GivenCone& q : second) {
      if (areWithin(p, q, margin)) pairs.emplace_back(p.name, q.name);
    }
  }
  return pairs;
}

}  // namespace fcl_fibers::test
