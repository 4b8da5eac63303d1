// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include <fcl_fibers/benchmark/judge.h>

#include "support/exact_geometry.h"

namespace fcl_fibers::benchmarks {

/// Three corners, in the frame of the capsules.
using Corners = std::array<fcl::Vector3d, 3>;

/// Distance of a capsule's axis and the nearest triangle, or more than `limit`. Takes all triangles
/// one by one, except those whose boxes are farther than that.
inline double meshDistance(const Capsule& capsule, const std::vector<Corners>& triangles,
                           double limit) {
  const Eigen::Array3d least = capsule.from.cwiseMin(capsule.to).array();
  const Eigen::Array3d greatest = capsule.from.cwiseMax(capsule.to).array();
  double distance = std::numeric_limits<double>::infinity();
  for (const Corners& t : triangles) {
    const Eigen::Array3d low = t[0].cwiseMin(t[1]).cwiseMin(t[2]).array();
    const Eigen::Array3d high = t[0].cwiseMax(t[1]).cwiseMax(t[2]).array();
    if ((least - high).max(low - greatest).maxCoeff() > std::min(limit, distance)) continue;
    const auto point = [](const fcl::Vector3d& x) -> test::Point { return x.cast<test::Real>(); };
    const test::Real exact = test::segmentTriangleDistance(point(capsule.from), point(capsule.to),
                                                           {point(t[0]), point(t[1]), point(t[2])});
    distance = std::min(distance, static_cast<double>(exact));
  }
  return distance;
}

/// As contact() of two capsules, with the same band.
inline Contact contact(const Capsule& capsule, const std::vector<Corners>& triangles) {
  constexpr double kBand = 1e-9;
  const double distance = meshDistance(capsule, triangles, (1 + kBand) * capsule.radius);
  if (distance < (1 - kBand) * capsule.radius) return Contact::kTouching;
  return distance <= (1 + kBand) * capsule.radius ? Contact::kBoundary : Contact::kApart;
}

}  // namespace fcl_fibers::benchmarks
