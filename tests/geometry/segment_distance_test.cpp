// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/segment_distance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

// Random pairs of all kinds are judged by numerics/touch_decisions_test.cpp.
namespace fcl_fibers::geometry {
namespace {

TEST(SegmentDistance, KnowsCoincidentSegmentsAndPoints) {
  // If this fails, a segment of no length, or one equal to another, divides by zero.
  const Vec3d o{0.1, 0.2, 0.3}, e{1.7, -0.4, 0.9};
  const Segment segment{o, e, 0}, reversed{e, o, 0}, point{o, o, 0}, other_point{e, e, 0};
  for (const Segment& p : {segment, reversed, point}) {
    for (const Segment& q : {segment, reversed, point}) {
      EXPECT_TRUE(axesWithin(p, q, 0));
    }
  }
  EXPECT_TRUE(axesWithin(segment, other_point, 0));
  EXPECT_FALSE(axesWithin(point, other_point, 1.7));
  const Segment at_three{{3, 0, 0}, {3, 0, 0}, 0}, at_four{{0, 4, 0}, {0, 4, 0}, 0};
  EXPECT_TRUE(axesWithin(at_three, at_four, 5));
  EXPECT_FALSE(axesWithin(at_three, at_four, std::nextafter(5, 0)));
}

TEST(SegmentDistance, SurvivesSubnormalLengths) {
  // If this fails, a squared length that underflows to 0 is taken for a direction.
  for (const double tiny : {4.9e-324, 1e-310, 1e-200, 1e-160, 1e-100}) {
    for (const Vec3d& u : {Vec3d{tiny, 0, 0}, Vec3d{tiny, -tiny, tiny}, Vec3d{0, 0, -tiny}}) {
      const Segment p{{0, 0, 0}, u, 0};
      const Segment beside{{0, 1, 0}, Vec3d{0, 1, 0} + u, 0};
      const Segment across{{0, 1, -1}, {0, 1, 1}, 0};
      for (const Segment& q : {beside, across}) {
        EXPECT_TRUE(axesWithin(p, q, 1)) << tiny;
        EXPECT_FALSE(axesWithin(p, q, 1 - 1e-12)) << tiny;
        EXPECT_FALSE(axesWithin(q, p, 1 - 1e-12)) << tiny;
      }
      EXPECT_TRUE(axesWithin(p, p, 0)) << tiny;
      EXPECT_TRUE(axesWithin(p, {u, u + u, 0}, 0)) << tiny;
      EXPECT_TRUE(axesWithin(p, {u, {1, 1, 1}, 0}, 0)) << tiny;
    }
  }
}

TEST(SegmentDistance, WhatIsNotFiniteIsNotRuledOut) {
  // If this fails, coordinates that overflow in another scene's frame are taken for apart, or
  // scaled without end.
  const double infinity = std::numeric_limits<double>::infinity();
  const Segment p{{0, 0, 0}, {1, 0, 0}, 0};
  for (const double bad : {infinity, -infinity, std::nan("")}) {
    for (const Segment& q :
         {Segment{{bad, 0, 0}, {bad, 1, 0}, 0}, Segment{{0, 5, bad}, {0, 6, 0}, 0}}) {
      EXPECT_TRUE(axesWithin(p, q, 1));
      EXPECT_TRUE(axesWithin(q, p, 1));
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::geometry
