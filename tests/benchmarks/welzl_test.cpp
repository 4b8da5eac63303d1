// SPDX-License-Identifier: BSD-3-Clause
#include "measures/paper/welzl.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace fcl_fibers::benchmarks {
namespace {

using geometry::Ball;
using geometry::EnclosingSphere;

class WelzlSpheres : public testing::TestWithParam<Welzl::Order> {};

/// If this failed, the times of the paper's algorithm would be those of something else.
TEST_P(WelzlSpheres, AreTheLeastOnesOfBallsInAnyPosition) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Welzl welzl(GetParam(), 1);
  enum Position { kAnywhere, kOnAPlane, kOnALine, kOnASphere, kOnAGrid, kAtOnePoint, kPositions };
  for (int i = 0; i < 3000; ++i) {
    const auto position = static_cast<Position>(i % kPositions);
    std::vector<Ball> balls(static_cast<std::size_t>(1 + i / kPositions % 50));
    for (Ball& ball : balls) {
      double x = uniform(random), y = uniform(random), z = uniform(random);
      if (position == kOnAPlane) z = x + y;
      if (position == kOnALine) y = 0.5 * x, z = 2 * x;
      if (position == kOnAGrid) x = std::round(x), y = std::round(y), z = std::round(z);
      if (position == kAtOnePoint) x = y = z = 0.5;
      const double scale = position == kOnASphere ? 1 / std::hypot(x, y, z) : 1;
      ball = {{scale * x, scale * y, scale * z}, 0.1};
    }
    const auto count = static_cast<int>(balls.size());
    const EnclosingSphere least = enclosingSphere(balls.data(), count);
    const EnclosingSphere sphere = welzl.around(balls.data(), count);
    // Both round; spheres are of size 1.
    ASSERT_NEAR(sphere.ball.radius, least.ball.radius, 1e-9) << i << ": " << count << " balls";
    for (const Ball& ball : balls) {
      ASSERT_LE(norm(ball.center - sphere.ball.center) + ball.radius, sphere.ball.radius) << i;
    }
  }
  EXPECT_GT(welzl.tests, 0u);
}

INSTANTIATE_TEST_SUITE_P(Orders, WelzlSpheres,
                         testing::Values(Welzl::Order::kRandom, Welzl::Order::kToFront));

/// If this failed, the claim of linear time would be judged by an algorithm that has no such time.
TEST(WelzlInRandomOrder, TakesTestsInProportionToTheBalls) {
  std::vector<Ball> balls;
  for (int i = 0; i < 10000; ++i) {
    const double t = 0.001 * i;
    balls.push_back({{std::cos(t), std::sin(t), 0.1 * t}, 0.01});
  }
  Welzl welzl(Welzl::Order::kRandom, 1);
  const EnclosingSphere sphere = welzl.around(balls.data(), static_cast<int>(balls.size()));
  EXPECT_GE(welzl.tests, balls.size());
  EXPECT_LE(welzl.tests, 100 * balls.size()) << "a loop over pairs takes 10,000 times as many";
  const Ball* members[4] = {};
  for (std::size_t i = 0; i < static_cast<std::size_t>(sphere.basis.size); ++i) {
    members[i] = &balls[static_cast<std::size_t>(sphere.basis.ball[i])];
  }
  const auto support = geometry::supportSphere(members, sphere.basis.size);
  ASSERT_TRUE(support.has_value());
  EXPECT_NEAR(support->ball.radius, sphere.ball.radius, 1e-9);
}

}  // namespace
}  // namespace fcl_fibers::benchmarks
