// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>

namespace fcl_fibers::scenes {

template <typename Parameters>
Parameters parametersOf(int fibers, int segments) {
  Parameters parameters;
  parameters.fibers = fibers;
  parameters.segments = segments;
  return parameters;
}

constexpr double kPi = 3.141592653589793;

inline double distance(const Point& p, const Point& q) {
  return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
}

/// That roots fill their area uniformly.
/// @param shares      of the area, further inside than the root
/// @param directions  of the root from the middle, in radians
inline void expectUniform(std::vector<double> shares, const std::vector<double>& directions) {
  const auto roots = static_cast<double>(shares.size());
  std::sort(shares.begin(), shares.end());
  EXPECT_GE(shares.front(), 0);
  EXPECT_LE(shares.back(), 1 + 1e-12);
  // Kolmogorov and Smirnov: a larger gap is met once in ten million seeds.
  for (std::size_t i = 0; i < shares.size(); ++i) {
    ASSERT_NEAR(shares[i], static_cast<double>(i) / roots, 3 / std::sqrt(roots));
  }
  // Quadrants turned by pi/8, so that no symmetry of the axes hides an uneven direction.
  int quadrants[4] = {};
  for (const double direction : directions) {
    ++quadrants[static_cast<int>(std::floor((direction + kPi / 8) / (kPi / 2)) + 4) % 4];
  }
  for (const int count : quadrants) {
    EXPECT_NEAR(count, roots / 4, 5 * std::sqrt(roots * 3 / 16));
  }
}

/// Pairs of capsules that touch, the `ignored` next along a fiber left out.
inline std::size_t touchingPairs(const FiberPolylines& scene, int ignored) {
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = ignored;
  FiberTree tree(options);
  tree.build(fiberArrays(scene));
  std::size_t pairs = 0;
  tree.visitPairs([&](SegmentPair) { ++pairs; });
  return pairs;
}

/// A pin: the library's own count of the day when the scene was made, which TouchesAreCountedRight
/// gives reason to trust. One part in a hundred is for mathematical functions that round otherwise.
inline void expectTouches(const FiberPolylines& scene, double pinned) {
  EXPECT_NEAR(static_cast<double>(touchingPairs(scene, 1)), pinned, 0.01 * pinned);
}

}  // namespace fcl_fibers::scenes
