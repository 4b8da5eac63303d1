// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/ball.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace fcl_fibers::scenes {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(Ball, IsClosedAndItsTrianglesFaceOutward) {
  // If this fails, the head has holes, or is inside out, and benchmarks measure something else.
  // A solid mesh is refused then.
  for (const int triangles : {16, 100, 5000}) {
    const Triangles ball = makeBall({2, 3, 4}, triangles);
    EXPECT_NO_THROW(TriangleMesh(ball.arrays(), TriangleMesh::Kind::kSolid));
    for (const Point& p : ball.points) {
      EXPECT_NEAR(std::hypot(p[0] / 2, p[1] / 3, p[2] / 4), 1, 1e-12);
    }
  }
  EXPECT_EQ(makeBall({1, 1, 1}, 102400).arrays().triangle_count, 102400);
}

TEST(Ball, TrianglesAreNoDeeperThanTheBound) {
  // If this fails, a margin of that depth misses what touches the sphere.
  for (const int triangles : {16, 100, 1600, 6400}) {
    const Triangles ball = makeBall({9, 9, 9}, triangles);
    const double most = depthOfTriangles(9, triangles);
    double deepest = 0;
    for (std::size_t i = 0; i < ball.corners.size(); i += 3) {
      const auto corner = [&](std::size_t k) {
        return ball.points[static_cast<std::size_t>(ball.corners[i + k])];
      };
      for (int x = 0; x <= 10; ++x) {
        for (int y = 0; x + y <= 10; ++y) {
          double squared = 0;
          for (std::size_t k = 0; k < 3; ++k) {
            const double sum = x * corner(0)[k] + y * corner(1)[k] + (10 - x - y) * corner(2)[k];
            squared += sum * sum / 100;
          }
          deepest = std::max(deepest, 9 - std::sqrt(squared));
        }
      }
    }
    EXPECT_LE(deepest, most);
    EXPECT_GE(deepest, 0.5 * most);
  }
}

TEST(Ball, RefusesTooFewOrTooManyTriangles) {
  // If this fails, there are rings of two points, or memory runs out.
  for (const int bad : {-1, 15, 100000001}) {
    EXPECT_THAT(
        [bad] {
          makeBall({1, 1, 1}, bad);
        },
        ThrowsMessage<std::invalid_argument>(
            HasSubstr("makeBall: triangles is " + std::to_string(bad) + "; ask for")));
  }
}

}  // namespace
}  // namespace fcl_fibers::scenes
