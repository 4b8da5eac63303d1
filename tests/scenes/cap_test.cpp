// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/cap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scene_support.h"

namespace fcl_fibers::scenes {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

double norm(const Point& p) { return std::hypot(p[0], p[1], p[2]); }

TEST(Cap, RootsFillTheirCapUniformly) {
  // If this fails, fibers are denser or sparser somewhere than 325 a square centimetre. The area of
  // a cap is proportional to its height (Archimedes).
  const int fibers = 20000;
  const FiberPolylines scene = makeCap(parametersOf<CapParameters>(fibers, 1));
  const double height = fibers / 325.0 / (2 * kPi * 9);
  std::vector<double> shares, directions;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const Point& root = scene.points[scene.point_begin[f]];
    EXPECT_NEAR(norm(root), 9, 1e-12);
    shares.push_back((9 - root[2]) / height);
    directions.push_back(std::atan2(root[1], root[0]));
  }
  expectUniform(shares, directions);
}

TEST(Cap, SegmentsAreOfOneLengthOutsideTheSphere) {
  // If this fails, fibers grow into the head, or their segments differ. Where a point is put back
  // on the sphere, its segment is shorter.
  const FiberPolylines scene = makeCap(parametersOf<CapParameters>(3000, 50));
  std::size_t shortened = 0;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    for (std::size_t i = scene.point_begin[f] + 1; i < scene.point_begin[f + 1]; ++i) {
      ASSERT_GE(norm(scene.points[i]), 9 - 1e-12);
      const double length = distance(scene.points[i - 1], scene.points[i]);
      if (norm(scene.points[i]) > 9 + 1e-9) {
        ASSERT_NEAR(length, 0.3, 1e-12);
      } else {
        ASSERT_LE(length, 0.6);
        ++shortened;
      }
    }
  }
  EXPECT_LE(shortened, scene.segmentCount() / 100);
}

TEST(Cap, FibersLeaveAlongTheNormalAndFall) {
  // If this fails, the turning has another rate or sign. Far from the top, where fibers stand for a
  // while.
  const FiberPolylines scene = makeCap(parametersOf<CapParameters>(30000, 50));
  int fallen = 0;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const Point* p = &scene.points[scene.point_begin[f]];
    // The first step is the normal plus 0.105 pull, 0.05 wave and noise, normalised.
    ASSERT_GE(norm(p[1]), 9 + 0.3 * 0.95);
    if (p[0][2] > 8) continue;
    ++fallen;
    ASSERT_LT(p[50][2] - p[49][2], -0.25);
  }
  EXPECT_GT(fallen, 5000);
}

TEST(Cap, MoreSegmentsLengthenTheSameFibers) {
  // If this fails, scenes of different length cannot be compared.
  const FiberPolylines shorter = makeCap(parametersOf<CapParameters>(9, 10));
  const FiberPolylines longer = makeCap(parametersOf<CapParameters>(9, 30));
  for (std::size_t f = 0; f < 9; ++f) {
    for (std::size_t i = 0; i <= 10; ++i) {
      EXPECT_EQ(shorter.points[f * 11 + i], longer.points[f * 31 + i]);
    }
  }
}

TEST(Cap, FramesMoveALittle) {
  // If this fails, a frame is no small motion, or none. Only fibers at the top may fall to another
  // side.
  auto parameters = parametersOf<CapParameters>(30000, 50);
  for (const int frame : {-1, 0, 30}) {
    parameters.frame = frame;
    const FiberPolylines still = makeCap(parameters);
    ++parameters.frame;
    const FiberPolylines moved = makeCap(parameters);
    double farthest = 0;
    for (std::size_t f = 0; f < still.fiberCount(); ++f) {
      const std::size_t begin = still.point_begin[f];
      EXPECT_EQ(still.points[begin], moved.points[begin]);
      if (still.points[begin][2] > 8) continue;
      for (std::size_t i = begin; i < still.point_begin[f + 1]; ++i) {
        farthest = std::max(farthest, distance(still.points[i], moved.points[i]));
      }
    }
    EXPECT_LE(farthest, 0.5);
    EXPECT_GE(farthest, 0.01);
  }
}

TEST(Cap, RefusesMoreFibersThanItHasRoomFor) {
  // If this fails, roots lie beyond the sphere.
  for (const int bad : {330810, std::numeric_limits<int>::max()}) {
    EXPECT_THAT([bad] { makeCap(parametersOf<CapParameters>(bad, 1)); },
                ThrowsMessage<std::invalid_argument>(
                    HasSubstr("makeCap: fibers is " + std::to_string(bad) + "; ask for")));
  }
}

TEST(Combed, HairFollowsTheHeadAtAHeightOfAboutARadius) {
  // If this fails, hair stands off or is inside the head, and little of it just touches. Roots are
  // those of the cap.
  const FiberPolylines combed = makeCombed(parametersOf<CapParameters>(1000, 50));
  const FiberPolylines cap = makeCap(parametersOf<CapParameters>(1000, 50));
  double sum = 0, squares = 0;
  for (std::size_t f = 0; f < combed.fiberCount(); ++f) {
    const std::size_t begin = combed.point_begin[f], end = combed.point_begin[f + 1];
    EXPECT_EQ(combed.points[begin], cap.points[begin]);
    for (std::size_t i = begin + 1; i < end; ++i) {
      const double height = (norm(combed.points[i]) - 9) / combed.radius;
      ASSERT_GE(height, -1e-9);
      sum += height;
      squares += height * height;
      ASSERT_NEAR(distance(combed.points[i - 1], combed.points[i]), 0.3, 0.002);
    }
    // 15 cm are 1.7 of the 3.1 rad from the top to the bottom.
    ASSERT_LT(combed.points[end - 1][2], 5);
  }
  const auto count = static_cast<double>(combed.segmentCount());
  EXPECT_NEAR(sum / count, 1, 0.02);
  EXPECT_NEAR(squares / count, 1.25, 0.03);
}

TEST(Combed, FramesTurnItALittle) {
  // If this fails, a frame is no small motion, or none.
  auto parameters = parametersOf<CapParameters>(100, 50);
  const FiberPolylines still = makeCombed(parameters);
  ++parameters.frame;
  const FiberPolylines moved = makeCombed(parameters);
  for (std::size_t i = 0; i < still.points.size(); ++i) {
    ASSERT_LE(distance(still.points[i], moved.points[i]), 0.12);
  }
  EXPECT_GE(distance(still.points[50], moved.points[50]), 0.05);
}

}  // namespace
}  // namespace fcl_fibers::scenes
