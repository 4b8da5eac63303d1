// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <fcl_fibers/benchmark/judge.h>

namespace fcl_fibers::benchmarks {

/// Three corners, in the frame of the capsules.
using Corners = std::array<fcl::Vector3d, 3>;

/// Distance of a capsule's axis and a triangle. Shares no code with the library, which it judges.
///
/// If the axis does not cross the triangle, the minimum lies on an edge or at an end of the axis
/// that is over the triangle. The rounding is that of segmentDistance().
inline double triangleDistance(const Capsule& capsule, const Corners& t) {
  const fcl::Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const double area = normal.norm();
  const auto isOver = [&](const fcl::Vector3d& x) {
    for (std::size_t i = 0; i < 3; ++i) {
      if ((t[(i + 1) % 3] - t[i]).cross(x - t[i]).dot(normal) < 0) return false;
    }
    return area > 0;
  };
  const double from = normal.dot(capsule.from - t[0]), to = normal.dot(capsule.to - t[0]);
  if (from * to <= 0 && from != to &&
      isOver(capsule.from + from / (from - to) * (capsule.to - capsule.from))) {
    return 0;
  }
  double distance = std::numeric_limits<double>::infinity();
  if (isOver(capsule.from)) distance = std::abs(from) / area;
  if (isOver(capsule.to)) distance = std::min(distance, std::abs(to) / area);
  for (std::size_t i = 0; i < 3; ++i) {
    distance = std::min(distance, segmentDistance(capsule.from, capsule.to, t[i], t[(i + 1) % 3]));
  }
  return distance;
}

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
    distance = std::min(distance, triangleDistance(capsule, t));
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
