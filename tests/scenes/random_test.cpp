// SPDX-License-Identifier: BSD-3-Clause
#include <scenes/random.h>

#include <cmath>

#include <gtest/gtest.h>

namespace fcl_fibers::scenes {
namespace {

TEST(Random, UniformIsTheSameOnEveryPlatform) {
  // If this fails, a seed stands for another scene than it did, or than it does elsewhere.
  Random random(5489);  // The first word of this seed is 14514284786278117030.
  EXPECT_EQ(random.uniform(), static_cast<double>(14514284786278117030U >> 11) * 0x1p-53);
  for (int i = 1; i < 9999; ++i) random.uniform();
  // The standard, [rand.predef]: the 10000th word of this seed is 9981545732273789042.
  EXPECT_EQ(random.uniform(), static_cast<double>(9981545732273789042U >> 11) * 0x1p-53);
}

TEST(Random, NormalTakesTwoWords) {
  // If this fails, what is drawn first changes everything that is drawn later.
  Random normal(7);
  Random uniform(7);
  for (int i = 0; i < 5; ++i) {
    normal.normal();
    uniform.uniform();
    uniform.uniform();
    EXPECT_EQ(normal.uniform(), uniform.uniform());
  }
}

TEST(Random, NormalHasTheMomentsOfTheNormalDistribution) {
  // If this fails, the fibers of a scene vary more or less than the scene's description says.
  Random random(3);
  const int n = 100000;
  double sum = 0, squares = 0, fourths = 0;
  for (int i = 0; i < n; ++i) {
    const double x = random.normal();
    sum += x;
    squares += x * x;
    fourths += x * x * x * x;
  }
  // Five standard errors: of x 1, of x^2 sqrt(2), of x^4 sqrt(96).
  const double error = 5 / std::sqrt(n);
  EXPECT_NEAR(sum / n, 0, error);
  EXPECT_NEAR(squares / n, 1, error * std::sqrt(2));
  EXPECT_NEAR(fourths / n, 3, error * std::sqrt(96));
}

}  // namespace
}  // namespace fcl_fibers::scenes
