// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/io/sampling.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/fiber_tree.h>

#include "scenes/helix.h"

namespace fcl_fibers::io {
namespace {

constexpr double kPi = 3.141592653589793;

/// Points at equal distances along the arc of a circle about the origin.
FiberPolylines arc(double radius, double angle, int segments) {
  FiberPolylines scene;
  for (int i = 0; i <= segments; ++i) {
    const double a = angle * i / segments;
    scene.points.push_back({radius * std::cos(a), radius * std::sin(a), 0.5});
  }
  scene.point_begin = {0, scene.points.size()};
  return scene;
}

// Curves would be further from their segments than what was allowed.
TEST(SamplingTest, ChordErrorBoundsTheSagittaOfCircles) {
  for (const double curvature : {1e-3, 0.5, 1.0, 40.0}) {
    for (const double angle : {1e-3, 0.1, 1.0, 2.0, 3.0, 6.2}) {
      // Beyond half a circle the furthest point from the chord is the one across all the same.
      const double sagitta = (1 - std::cos(angle / 2)) / curvature;
      const double bound = chordError(curvature, angle / curvature);
      EXPECT_GE(bound, sagitta * (1 - 1e-12)) << curvature << ' ' << angle;
      if (angle <= 1) {
        EXPECT_LE(bound, 1.03 * sagitta) << curvature << ' ' << angle;
      }
    }
  }
  EXPECT_EQ(chordError(0, 3), 0);
  // Folded: no point is further from the ends than half the length.
  EXPECT_EQ(chordError(1e9, 3), 1.5);
}

// Segments would be too few, or wasted.
TEST(SamplingTest, SegmentsAreTheFewestThatKeepTheTolerance) {
  for (const double curvature : {0.0, 1e-3, 0.5, 40.0, 1e4}) {
    for (const double tolerance : {1e-6, 1e-3, 0.3}) {
      const double length = 30;
      const int count = segmentsForChordError(curvature, length, tolerance);
      EXPECT_LE(chordError(curvature, length / count), tolerance);
      if (count > 1) {
        EXPECT_GT(chordError(curvature, length / (count - 1)), tolerance);
      }
    }
  }
  EXPECT_EQ(segmentsForChordError(0, 30, 1e-9), 1);
  EXPECT_EQ(segmentsForChordError(5, 0, 1e-9), 1);
  EXPECT_EQ(segmentsForChordError(1e300, 0, 1e-300), 1);
}

TEST(SamplingTest, CurvatureOfCirclesAndLinesIsExact) {
  for (const double radius : {0.01, 1.0, 1e4}) {
    for (const int segments : {3, 20, 1000}) {
      const double curvature = largestCurvature(arc(radius, 2 * kPi * 0.9, segments));
      EXPECT_NEAR(curvature * radius, 1, 1e-7) << radius << ' ' << segments;
    }
  }
  FiberPolylines line;
  for (int i = 0; i < 5; ++i) line.points.push_back({0.1 * i, 0.2 * i, -0.3 * i});
  line.point_begin = {0, 5};
  EXPECT_LT(largestCurvature(line), 1e-12);
  EXPECT_EQ(largestCurvature(FiberPolylines()), 0);
}

// The seam of a loop, a fold and points that coincide would be overlooked, or be no number.
TEST(SamplingTest, CurvatureAtSeamsAndFolds) {
  // An arc, and back to its first point, which is the sharpest corner.
  FiberPolylines drop = arc(1, 2.5, 12);
  drop.points.push_back({0.5, -0.5, 0.5});
  drop.points.push_back(drop.points.front());
  drop.point_begin = {0, drop.points.size()};
  drop.closed = {0};
  const double open = largestCurvature(drop);
  drop.closed = {1};
  EXPECT_GT(largestCurvature(drop), open * 1.01);

  FiberPolylines fold;
  fold.points = {{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {0, 0, 0}};
  fold.point_begin = {0, 4};
  EXPECT_EQ(largestCurvature(fold), 2);
}

/// Pairs of fibers that touch.
std::set<std::pair<std::size_t, std::size_t>> fibersInContact(const FiberPolylines& scene,
                                                              double margin) {
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = 0;
  options.margin = margin;
  FiberTree tree(options);
  tree.build(fiberArrays(scene));
  std::set<std::pair<std::size_t, std::size_t>> fibers;
  tree.visit(Pairs{}, [&](SegmentPair pair) {
    const std::pair<std::size_t, std::size_t> ends =
        std::minmax({tree.fiberSegment(pair.a).fiber, tree.fiberSegment(pair.b).fiber});
    if (ends.first != ends.second) fibers.insert(ends);
  });
  return fibers;
}

// What the header promises of contacts would not hold on curves that are no circles.
TEST(SamplingTest, WithTwiceTheErrorAsMarginNoContactIsMissedAndWithoutNoDeepOne) {
  constexpr int kFinest = 1000;
  scenes::HelixParameters parameters;
  parameters.fibers = 40;
  parameters.radius = 0.02;
  parameters.segments = kFinest;
  const FiberPolylines fine = scenes::makeHelix(parameters);
  const double curvature = largestCurvature(fine), length = 30;
  // The strand's helices: 4 turns on 30 cm, radius 1 cm.
  EXPECT_NEAR(curvature, std::pow(2 * kPi * 4 / length, 2), 0.12);
  const auto touching = fibersInContact(fine, 0);
  ASSERT_GT(touching.size(), 10u);
  for (const double tolerance : {0.01, 0.001}) {
    parameters.segments = segmentsForChordError(curvature, length, tolerance);
    const FiberPolylines coarse = scenes::makeHelix(parameters);
    const double error = chordError(curvature, length / parameters.segments);
    ASSERT_LE(error, tolerance);
    // The finest scene has an error of its own, far smaller.
    const double both = error + chordError(curvature, length / kFinest);
    const auto found = fibersInContact(coarse, 2 * both);
    EXPECT_TRUE(std::includes(found.begin(), found.end(), touching.begin(), touching.end()))
        << tolerance;
    // What is deeper than 2 e touches thinner fibers as well, and is found without a margin.
    FiberPolylines thin = fine;
    thin.radius = parameters.radius - both;
    const auto deep = fibersInContact(thin, 0);
    const auto plain = fibersInContact(coarse, 0);
    EXPECT_FALSE(deep.empty());
    EXPECT_TRUE(std::includes(plain.begin(), plain.end(), deep.begin(), deep.end())) << tolerance;
    const auto near = fibersInContact(fine, 4 * both);
    EXPECT_TRUE(std::includes(near.begin(), near.end(), found.begin(), found.end())) << tolerance;
  }
}

TEST(SamplingTest, RefusesWhatIsNoLength) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [](const std::string& text) {
    return ::testing::ThrowsMessage<std::invalid_argument>(::testing::HasSubstr(text));
  };
  EXPECT_THAT([&] { chordError(-1, 1); }, refused("curvature is -1"));
  EXPECT_THAT([&] { chordError(1, kNaN); }, refused("length is"));
  EXPECT_THAT([&] { segmentsForChordError(1, 1, 0); }, refused("tolerance is 0"));
  EXPECT_THAT([&] { segmentsForChordError(1, kNaN, 1); }, refused("length is"));
  EXPECT_THAT([&] { segmentsForChordError(1, 1e30, 1e-30); }, refused("2^27"));
  FiberPolylines scene;
  scene.points = {{0, 0, 0}, {kNaN, 0, 0}};
  scene.point_begin = {0, 2};
  EXPECT_THAT([&] { largestCurvature(scene); }, refused("coordinate"));
  scene.point_begin = {0, 1};
  EXPECT_THAT([&] { largestCurvature(scene); }, refused("point_begin"));
}

}  // namespace
}  // namespace fcl_fibers::io
