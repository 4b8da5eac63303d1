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
