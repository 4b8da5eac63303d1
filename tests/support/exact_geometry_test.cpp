// SPDX-License-Identifier: BSD-3-Clause
#include "support/exact_geometry.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "support/random.h"

namespace fcl_fibers::test {
namespace {

Point point(double x, double y, double z) { return Point(x, y, z); }

Point randomPoint(Random& random) { return random.inCube(1).cast<Real>(); }

// Along [a, b], the distance to a convex set is convex: a search by thirds finds its minimum.
template <typename Distance>
Real smallestAlong(const Point& a, const Point& b, Distance distance) {
  Real low = 0;
  Real high = 1;
  for (int i = 0; i < 200; ++i) {
    const Real third = (high - low) / 3;
    const Point left = a + (low + third) * (b - a);
    const Point right = a + (high - third) * (b - a);
    (distance(left) <= distance(right) ? high : low) +=
        distance(left) <= distance(right) ? -third : third;
  }
  return distance(a + (low + high) / 2 * (b - a));
}

// The oracle of all contract tests would be wrong.
TEST(SegmentDistance, IsExactWhereTheAnswerIsKnown) {
  const Point o = point(0, 0, 0);
  const Point x = point(1, 0, 0);
  EXPECT_EQ(segmentDistance(o, o, o, o), 0);
  EXPECT_EQ(segmentDistance(o, o, point(3, 4, 0), point(3, 4, 0)), 5);
  EXPECT_EQ(segmentDistance(o, x, o, x), 0);
  EXPECT_EQ(segmentDistance(o, x, x, o), 0);
  EXPECT_EQ(segmentDistance(o, x, x, point(2, 0, 0)), 0);
  EXPECT_EQ(segmentDistance(o, x, point(1.5, 0, 0), point(2, 0, 0)), 0.5L);
  EXPECT_EQ(segmentDistance(o, x, point(0.25, 0, 0), point(0.5, 0, 0)), 0);
  EXPECT_EQ(segmentDistance(o, x, point(0, 2, 0), point(1, 2, 0)), 2);
  EXPECT_EQ(segmentDistance(o, x, point(1, 2, 0), point(0, 2, 0)), 2);
  EXPECT_EQ(segmentDistance(o, x, point(0.5, -1, 3), point(0.5, 1, 3)), 3);
  EXPECT_EQ(segmentDistance(o, x, point(0.5, -1, 0), point(0.5, 1, 0)), 0);
  EXPECT_EQ(segmentDistance(o, x, point(4, 4, -1), point(4, 4, 1)), 5);
  EXPECT_EQ(segmentDistance(o, x, point(0.5, 0, 0), point(0.5, 0, 0)), 0);
}

// The oracle would have a slip in one of its candidates.
TEST(SegmentDistance, IsWhatASearchFinds) {
  Random random(11);
  for (int i = 0; i < 2000; ++i) {
    const Point a = randomPoint(random);
    const Point b = randomPoint(random);
    const Point c = randomPoint(random);
    const Point d = randomPoint(random);
    const Real found =
        smallestAlong(a, b, [&](const Point& p) { return pointSegmentDistance(p, c, d); });
    EXPECT_NEAR(static_cast<double>(segmentDistance(a, b, c, d) - found), 0, 1e-9) << i;
    EXPECT_LE(segmentDistance(a, b, c, d), found + 1e-17L) << i;
  }
}

// Pairs of near-parallel segments, the norm in hair, would be judged wrongly.
TEST(SegmentDistance, HoldsForCrossingsAtAnyAngle) {
  Random random(12);
  const Real unit = std::numeric_limits<Real>::epsilon();
  for (int power = 0; power < 70; ++power) {
    // Two segments along nearly one direction, their lines crossing at known points, `gap` apart.
    const Real tilt = std::ldexp(Real(1), -power);
    const Point axis = random.direction().cast<Real>().normalized();
    const Point side = axis.cross(randomPoint(random)).normalized();
    const Point up = axis.cross(side).normalized();
    for (const Real gap : {0.0L, 1e-6L, 0.25L}) {
      const Point center = randomPoint(random);
      const Point first = axis + tilt * side;
      const Point second = axis - tilt * side;
      const Point a = center - Real(random.between(0.25, 1)) * first;
      const Point b = center + Real(random.between(0.25, 1)) * first;
      const Point c = center + gap * up - Real(random.between(0.25, 1)) * second;
      const Point d = center + gap * up + Real(random.between(0.25, 1)) * second;
      EXPECT_NEAR(static_cast<double>(segmentDistance(a, b, c, d) - gap), 0,
                  static_cast<double>(64 * unit))
          << "tilt 2^-" << power << ", gap " << static_cast<double>(gap);
    }
  }
}

// Pairs of a capsule and another shape would be judged wrongly.
TEST(SegmentBoxDistance, IsWhatASearchFinds) {
  Random random(13);
  for (int i = 0; i < 2000; ++i) {
    const Point p = randomPoint(random) / 2;
    const Point q = randomPoint(random) / 2;
    const ExactBox box{p.cwiseMin(q), p.cwiseMax(q)};
    const Point a = randomPoint(random);
    // Some along an axis, where the segment crosses no plane of the others.
    Point b = randomPoint(random);
    if (i % 3 == 0) b[0] = a[0];
    if (i % 5 == 0) b[1] = a[1];
    if (i % 15 == 0) b = a;
    const Real found = smallestAlong(a, b, [&](const Point& s) {
      return boxDistance({s, s}, box);
    });
    EXPECT_NEAR(static_cast<double>(segmentBoxDistance(a, b, box) - found), 0, 1e-9) << i;
    EXPECT_LE(segmentBoxDistance(a, b, box), found + 1e-17L) << i;
  }
}

// Half-spaces and planes would have no truth.
TEST(SegmentBoxDistance, AcceptsUnboundedBoxes) {
  const Real infinity = std::numeric_limits<Real>::infinity();
  const Point all = Point::Constant(infinity);
  ExactBox below{-all, all};
  EXPECT_EQ(segmentBoxDistance(point(1, 2, 3), point(4, 5, 6), below), 0);
  below.max[2] = 1;
  EXPECT_EQ(segmentBoxDistance(point(1, 2, 3), point(4, 5, 6), below), 2);
  EXPECT_EQ(segmentBoxDistance(point(1, 2, 3), point(4, 5, 0), below), 0);
}

}  // namespace
}  // namespace fcl_fibers::test
