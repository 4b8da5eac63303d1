// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/triangle_decisions.h"

#include <gtest/gtest.h>

#include "support/exact_geometry.h"
#include "support/random.h"
#include "support/triangle_oracle.h"

namespace fcl_fibers::test {
namespace {

// A segment that touches a triangle would be missed, or one that is apart be reported.
TEST(TriangleDecisions, AreThoseOfTheExactOracle) {
  const TriangleTally tally = decideTriangles(200'000, 1);
  EXPECT_EQ(tally.missed, 0u) << tally.first_wrong;
  EXPECT_EQ(tally.unpromised, 0u) << tally.first_wrong;
  EXPECT_LT(tally.beyond_usual, 40u);
  EXPECT_EQ(tally.wrong_in_float, 0u);
  EXPECT_GT(tally.in_float, 40'000u);
  EXPECT_GT(tally.within, 50'000u);
  EXPECT_GT(tally.at_contact, 50'000u);
  EXPECT_GT(tally.exact, 20'000u);
}

void expectBoth(const GivenSegment& segment, const GivenTriangle& triangle, double reach,
                bool within) {
  for (const GivenSegment& s : {segment, GivenSegment{segment.b, segment.a}}) {
    for (const GivenTriangle& t : {triangle, GivenTriangle{triangle.b, triangle.c, triangle.a},
                                   GivenTriangle{triangle.c, triangle.b, triangle.a}}) {
      EXPECT_EQ(TriangleOracle::withinExactly(s, t, reach), within);
      EXPECT_EQ(TriangleOracle::judge(s, t, reach).within, within);
    }
  }
}

// The judge of all this would take a near miss for contact.
TEST(TriangleOracleTest, KnowsContactToTheLastBit) {
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

// The filter in double would disagree with the integers.
TEST(TriangleOracleTest, AgreesWithAnEnumerationInLongDouble) {
  Random random(3);
  for (int i = 0; i < 20000; ++i) {
    std::array<std::array<double, 3>, 5> p;
    for (auto& point : p) {
      const Eigen::Vector3d q = random.inCube(1);
      point = {q.x(), q.y(), q.z()};
    }
    const auto exact = [&](std::size_t k) { return Point(p[k][0], p[k][1], p[k][2]); };
    const Real distance =
        segmentTriangleDistance(exact(0), exact(1), {exact(2), exact(3), exact(4)});
    const GivenSegment segment{p[0], p[1]};
    const GivenTriangle triangle{p[2], p[3], p[4]};
    const double change = std::pow(10.0, -random.between(0, 14));
    const auto more = static_cast<double>(distance * (1 + Real(change)) + 1e-17L);
    const auto less = static_cast<double>(distance * (1 - Real(change)));
    ASSERT_TRUE(TriangleOracle::judge(segment, triangle, more).within) << i;
    ASSERT_TRUE(TriangleOracle::withinExactly(segment, triangle, more)) << i;
    if (distance == 0) continue;
    ASSERT_FALSE(TriangleOracle::judge(segment, triangle, less).within) << i;
    ASSERT_FALSE(TriangleOracle::withinExactly(segment, triangle, less)) << i;
  }
}

}  // namespace
}  // namespace fcl_fibers::test
