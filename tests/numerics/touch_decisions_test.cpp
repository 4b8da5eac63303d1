// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/touch_decisions.h"

#include <array>
#include <cfenv>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "support/exact_geometry.h"
#include "support/impact_oracle.h"
#include "support/random.h"

namespace fcl_fibers::test {
namespace {

void expectRight(const TouchTally& tally) {
  EXPECT_EQ(tally.missed, 0u) << tally.first_wrong;
  EXPECT_EQ(tally.unpromised, 0u) << tally.first_wrong;
  EXPECT_EQ(tally.wrong_in_float, 0u);
  EXPECT_GT(tally.within, tally.decisions / 4);
  EXPECT_GT(tally.at_contact, tally.decisions / 4);
  EXPECT_GT(tally.exact, tally.decisions / 10);
}

// Capsules that touch would be missed, or some that are apart be reported.
TEST(TouchDecisions, OfCapsulesAreThoseOfTheExactOracle) {
  const TouchTally tally = decideTouches(2, 200'000, 1);
  expectRight(tally);
  EXPECT_GT(tally.in_float, 40'000u);
}

// A segment that touches a triangle would be missed, or one that is apart be reported.
TEST(TouchDecisions, OfTrianglesAreThoseOfTheExactOracle) {
  const TouchTally tally = decideTouches(3, 200'000, 1);
  expectRight(tally);
  EXPECT_LT(tally.beyond_usual, 40u);
  EXPECT_GT(tally.in_float, 40'000u);
}

// Cones that touch would be missed, or the capsules around them be taken for them.
TEST(TouchDecisions, OfConesAreThoseOfBoundsFromBothSides) {
  const TouchTally tally = decideConeTouches(60'000, 1);
  expectRight(tally);
  EXPECT_GT(tally.in_float, 12'000u);
}

// A program that computes intervals, in which rounding goes one way, would miss what touches.
TEST(TouchDecisions, AreRightInEveryModeOfRounding) {
  for (const int rounding : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
    for (const std::size_t corners : {2u, 3u}) {
      SCOPED_TRACE("mode " + std::to_string(rounding) + ", " + std::to_string(corners));
      expectRight(decideTouches(corners, 60'000, 2, rounding));
    }
    SCOPED_TRACE("mode " + std::to_string(rounding) + ", cones");
    expectRight(decideConeTouches(20'000, 2, rounding));
  }
}

struct GivenSegment {
  std::array<double, 3> a, b;
};
struct GivenTriangle {
  std::array<double, 3> a, b, c;
};

void expectBoth(const GivenSegment& segment, const GivenTriangle& triangle, double reach,
                bool within) {
  const auto& [a, b, c] = triangle;
  for (const bool exact : {false, true}) {
    for (const GivenSegment& s : {segment, GivenSegment{segment.b, segment.a}}) {
      for (const GivenTriangle& t : {triangle, GivenTriangle{b, c, a}, GivenTriangle{c, b, a}}) {
        const GivenInstant pair{{s.a, s.b}, {t.a, t.b, t.c}};
        EXPECT_EQ(ImpactOracle::within(pair, 3, reach, exact).certain, within);
      }
    }
  }
}

// The judge of all this would take a near miss for contact.
TEST(ImpactOracleTest, KnowsContactAtRestToTheLastBit) {
  const GivenTriangle triangle{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
  const GivenSegment over{{1, 1, 1}, {9, 9, 9}}, above{{-9, 1, 1}, {9, 1, 1}};
  const GivenSegment beside{{1, -1, -5}, {1, -1, 5}}, at_corner{{-1, 0, 0}, {-5, 0, 0}};
  for (const GivenSegment& segment : {over, above, beside, at_corner}) {
    expectBoth(segment, triangle, 1, true);
    expectBoth(segment, triangle, 1 - 0x1p-53, false);
  }
  // Through the inside, an edge and a corner; and past them by the least number.
  expectBoth({{1, 1, -1}, {1, 1, 1}}, triangle, 0, true);
  expectBoth({{2, 2, -1}, {2, 2, 1}}, triangle, 0, true);
  expectBoth({{0, 0, -1}, {0, 0, 1}}, triangle, 0, true);
  expectBoth({{1, -5e-324, -1}, {1, -5e-324, 1}}, triangle, 0, false);
  expectBoth({{1, 1, 5e-324}, {1, 1, 1}}, triangle, 0, false);
  expectBoth({{1, 1, 0}, {1, 1, 1}}, triangle, 0, true);
  // In its plane, and without area.
  expectBoth({{-1, 1, 0}, {9, 1, 0}}, triangle, 0, true);
  expectBoth({{3, 2, 0}, {2, 3, 0}}, triangle, 0.70710678118654746, false);
  expectBoth({{3, 2, 0}, {2, 3, 0}}, triangle, 0.70710678118654757, true);
  const GivenTriangle needle{{0, 0, 0}, {2, 2, 2}, {5, 5, 5}},
      point{{3, 0, 0}, {3, 0, 0}, {3, 0, 0}};
  expectBoth({{4, 4, 4}, {9, 4, 4}}, needle, 0, true);
  expectBoth({{0, 4, 0}, {0, 4, 0}}, point, 5, true);
  expectBoth({{0, 4, 0}, {0, 4, 0}}, point, 5 - 0x1p-50, false);
}

// What double decides would not be what integers do.
TEST(ImpactOracleTest, AgreesWithAnEnumerationInLongDouble) {
  Random random(3);
  for (int i = 0; i < 20000; ++i) {
    const auto point = [&]() -> std::array<double, 3> {
      const Eigen::Vector3d p = random.inCube(1);
      return {p.x(), p.y(), p.z()};
    };
    const GivenInstant pair{{point(), point()}, {point(), point(), point()}};
    const Real distance = ImpactOracle::excessAt({pair, pair, 3}, 0);
    const double change = std::pow(10.0, -random.between(0, 14));
    const auto more = static_cast<double>(distance * (1 + Real(change)) + 1e-16L);
    const auto less = static_cast<double>(distance * (1 - Real(change)));
    for (const bool exact : {false, true}) {
      ASSERT_TRUE(ImpactOracle::within(pair, 3, more, exact).certain) << i;
      if (distance == 0) continue;
      ASSERT_FALSE(ImpactOracle::within(pair, 3, less, exact).certain) << i;
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::test
