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
  tree.visit(Pairs{}, [&](SegmentPair) { ++pairs; });
  return pairs;
}

/// A pin: the library's own count of the day when the scene was made, which TouchesAreCountedRight
/// gives reason to trust. One part in a hundred is for mathematical functions that round otherwise.
inline void expectTouches(const FiberPolylines& scene, double pinned) {
  EXPECT_NEAR(static_cast<double>(touchingPairs(scene, 1)), pinned, 0.01 * pinned);
}

/// That a scene is another one, turned by pi/4 about y, then by pi/4 about x.
inline void expectTurnedAboutTwoAxes(const FiberPolylines& turned, const FiberPolylines& other) {
  const double c = std::sqrt(0.5);
  for (std::size_t i = 0; i < turned.points.size(); ++i) {
    const Point& p = other.points[i];
    const double x = c * p[0] + c * p[2];
    const double z = c * p[2] - c * p[0];
    EXPECT_LE(distance(turned.points[i], {x, c * p[1] - c * z, c * p[1] + c * z}), 1e-9);
  }
}

/// How often a scene of one fiber turns about z.
inline double turnsOf(const FiberPolylines& fiber) {
  const auto heading = [&](std::size_t k) {
    return std::atan2(fiber.points[k][1] - fiber.points[k - 1][1],
                      fiber.points[k][0] - fiber.points[k - 1][0]);
  };
  double turned = 0;
  for (std::size_t i = 2; i < fiber.points.size(); ++i) {
    turned += std::remainder(heading(i) - heading(i - 1), 2 * kPi);
  }
  return std::abs(turned) / (2 * kPi);
}

}  // namespace fcl_fibers::scenes
