// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/obstacle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "support/exact_box.h"
#include "support/random.h"
#include "support/segments.h"

namespace fcl_fibers::geometry {
namespace {

using test::Exact;
using test::exact;
using test::extentOf;
using test::Random;
using test::Rational;
using test::rootOf;

constexpr double kEps = std::numeric_limits<double>::epsilon();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// What lengths may lose at the small end of the range.
double lossOfSmallNumbers() {
  const volatile double least = std::numeric_limits<double>::min();
  const bool flushes_to_zero = least / 2 == 0;
  return flushes_to_zero ? 16 * least : std::numeric_limits<double>::denorm_min();
}

/// Compares answers at the distance, one ulp from it, and as far beyond it as rounding may reach.
/// "A few ulp of the coordinates" are 16 eps of the extent.
void expectExactDecisions(Segment s, const Obstacle& box) {
  const Rational squared = test::exactWay(s, box).squared;
  const double distance = rootOf(squared), slack = 16 * kEps * extentOf(s, box);
  for (const double reach :
       {distance, std::nextafter(distance, kInfinity), std::nextafter(distance, 0.0),
        distance - slack, distance - 2 * slack, distance / 2, 2 * distance, 0.0}) {
    if (reach < 0) continue;
    s.radius = reach;
    const bool answer = touch(s, box, 0, 0);
    if (Rational(reach) * Rational(reach) >= squared) {
      ASSERT_TRUE(answer) << distance << ", reach " << reach;
    }
    const Rational most = Rational(reach) + Rational(slack) + Rational(4 * kEps * reach) +
                          Rational(lossOfSmallNumbers());
    if (most * most < squared) {
      ASSERT_FALSE(answer) << distance << ", reach " << reach;
    }
  }
}

Obstacle makeBox(const Vec3d& point, const Vec3d& x, const Vec3d& y, const Vec3d& z) {
  Obstacle box;
  box.kind = Obstacle::Kind::kBox;
  box.point = point;
  box.vector[0] = x;
  box.vector[1] = y;
  box.vector[2] = z;
  return box;
}

/// Of these half sides, some of which may be zero. It is not quite rectangular if `skew` is not 0.
Obstacle randomBox(Random& random, const Vec3d& half, double skew) {
  const Eigen::Matrix3d turn = random.rotation().toRotationMatrix();
  const auto side = [&](double length, int i) {
    return length * fromEigen(turn.col(i) + skew * random.direction());
  };
  const Vec3d at[] = {fromEigen(random.inCube(1)), side(half.x, 0), side(half.y, 1),
                      side(half.z, 2)};
  return makeBox(at[0], at[1], at[2], at[3]);
}

Segment randomSegment(Random& random, double length) {
  const Vec3d a = fromEigen(random.inCube(2));
  return {a, a + length * fromEigen(random.direction()), 0};
}

double randomSize(Random& random) {
  const double sizes[] = {1, 1, 1, 0, 1e-3, 1e-8, 1e-13, 30};
  const double size = sizes[random.below(8)];
  return size * random.between(0.1, 1);
}

TEST(ObstacleBox, DecisionsAreExactForTurnedBoxes) {
  // If this fails, capsules beside a box are missed, or one that is clear of it counts.
  Random random(701);
  for (int i = 0; i < 1500; ++i) {
    const Vec3d half{randomSize(random), randomSize(random), randomSize(random)};
    const Obstacle box = randomBox(random, half, i % 2 == 0 ? 0 : 5e-3);
    ASSERT_NO_FATAL_FAILURE(expectExactDecisions(randomSegment(random, randomSize(random)), box))
        << i;
  }
}

TEST(ObstacleBox, DecisionsAreExactBesideFacesAndEdges) {
  // If this fails, a search ends too early where all points are about equally close.
  Random random(702);
  for (int i = 0; i < 1500; ++i) {
    const Vec3d half{random.between(0.2, 1), random.between(0.2, 1), random.between(0.2, 1)};
    const Obstacle box = randomBox(random, half, i % 2 == 0 ? 0 : 1e-6);
    // Along an edge or a face, tilted by next to nothing, and as far away.
    const Vec3d across = i % 3 == 0 ? box.vector[1] : 0.7 * box.vector[1] - 0.2 * box.vector[0];
    const double tilt = std::pow(10.0, -random.between(1, 17));
    const double height = 1 + (random.below(3) == 0 ? 0 : std::pow(10.0, -random.between(0, 16)));
    const double x = random.between(-1, 1), y = i % 3 == 1 ? height : random.between(-2, 2);
    const Vec3d middle = box.point + height * box.vector[2] + x * box.vector[0] + y * box.vector[1];
    const Vec3d way = random.between(0.1, 3) * across;
    const Vec3d along = way + tilt * fromEigen(random.direction());
    ASSERT_NO_FATAL_FAILURE(expectExactDecisions({middle - along, middle + along, 0}, box)) << i;
  }
}

TEST(ObstacleBox, DecisionsAreExactForWholeNumbers) {
  // If this fails, exact contact is missed: with a corner, an edge or a face, by an end or between
  // the ends, and for boxes and segments without thickness or length.
  Random random(703);
  const auto whole = [&] { return static_cast<double>(random.below(9)) - 4; };
  for (int i = 0; i < 3000; ++i) {
    const Vec3d half{double(random.below(3)), double(random.below(3)), double(random.below(3))};
    const Obstacle box =
        i % 2 == 0
            ? makeBox({whole(), whole(), whole()}, {half.x, 0, 0}, {0, half.y, 0}, {0, 0, half.z})
            : makeBox({whole(), whole(), whole()}, half.x * Vec3d{0.75, 1, 0},
                      half.y * Vec3d{-1, 0.75, 0}, half.z * Vec3d{0, 0, -1});
    ASSERT_NO_FATAL_FAILURE(
        expectExactDecisions({{whole(), whole(), whole()}, {whole(), whole(), whole()}, 0}, box))
        << i;
  }
}

TEST(ObstacleBox, DecisionsAreExactAtAllScalesAndOffsets) {
  // If this fails, squares overflow or vanish, or a place far from the origin costs digits.
  Random random(704);
  for (int i = 0; i < 1000; ++i) {
    const Vec3d half{randomSize(random), randomSize(random), randomSize(random)};
    Obstacle box = randomBox(random, half, 0);
    Segment s = randomSegment(random, randomSize(random));
    if (i % 2 == 0) {
      const int powers[] = {-1070, -1030, -1000, -600, -300, 300, 600, 1000};
      const double scale = std::ldexp(1.0, powers[random.below(8)]);
      s = {scale * s.a, scale * s.b, 0};
      box.point = scale * box.point;
      for (Vec3d& v : box.vector) v = scale * v;
    } else {
      const double offset = std::pow(10.0, random.between(0, 15));
      const Vec3d by{offset, -offset, offset};
      s = {s.a + by, s.b + by, 0};
      box.point = box.point + by;
    }
    ASSERT_NO_FATAL_FAILURE(expectExactDecisions(s, box)) << i;
  }
}

TEST(ObstacleBox, RadiusMarginsAndErrorsAddUp) {
  // If this fails, a margin or an error is not counted, or counted twice.
  Obstacle box = makeBox({1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  const Segment s{{0, 5, -4}, {0, 5, 4}, 1};
  box.margin = 0.5;
  box.error = 0.25;
  EXPECT_TRUE(touch(s, box, 2, 0.25));
  EXPECT_FALSE(touch(s, box, 2, 0.25 - 1e-12));
  EXPECT_FALSE(touch(s, box, 2 - 1e-12, 0.25));
}

TEST(Obstacle, AnUnknownOneAndOneBeyondAllBoundsTouchEverything) {
  // If this fails, what overflows or is not known is taken for apart.
  const Segment s{{0, 0, 0}, {1, 0, 0}, 0};
  EXPECT_TRUE(touch(s, Obstacle{}, 0, 0));
  const double most = std::numeric_limits<double>::max();
  EXPECT_TRUE(touch(s, makeBox({most, most, most}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}), 0, 0));
  EXPECT_FALSE(touch(s, makeBox({most / 16, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}), 1e300, 0));
  EXPECT_TRUE(touch(s, makeBox({0, 9, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}), kInfinity, 0));
  EXPECT_TRUE(touch(s, makeBox({0, 9, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}), most, 0));
  EXPECT_TRUE(touch({{0, 0, 0}, {0, 0, 0}, 0}, makeBox({0, 0, 0}, {}, {}, {}), 0, 0));
}

// --- Planes, half-spaces and triangles ---

TEST(ObstaclePlane, TheEndsDecide) {
  // If this fails, a capsule behind a plane counts, or one that crosses it does not.
  Obstacle plane;
  plane.kind = Obstacle::Kind::kPlane;
  plane.point = {0, 0, 1};
  plane.vector[0] = {0, 0.6, 0.8};
  plane.offset = 2;
  Obstacle halfspace = plane;
  halfspace.kind = Obstacle::Kind::kHalfspace;
  const auto at = [](double height_a, double height_b) {
    const Vec3d n{0, 0.6, 0.8}, foot{0, 1.2, 2.6};
    return Segment{Vec3d{3, 0, 0} + foot + height_a * n, Vec3d{-5, 0, 0} + foot + height_b * n, 1};
  };
  constexpr double kTiny = 1e-12;
  const double halfspace_touches[][2] = {{1, 7}, {7, 1}, {-1, 7}, {-9, 7}, {-9, -7}, {0, 0}};
  for (const auto& [a, b] : halfspace_touches) EXPECT_TRUE(touch(at(a, b), halfspace, 0, 0));
  const double plane_touches[][2] = {{1, 7}, {7, 1}, {-1, -7}, {-7, -1}, {-9, 7}, {9, -7}, {0, 0}};
  for (const auto& [a, b] : plane_touches) EXPECT_TRUE(touch(at(a, b), plane, 0, 0));
  for (const Obstacle& obstacle : {plane, halfspace}) {
    EXPECT_FALSE(touch(at(1 + kTiny, 7), obstacle, 0, 0));
    EXPECT_FALSE(touch(at(7, 1 + kTiny), obstacle, 0, 0));
    EXPECT_TRUE(touch(at(1.5, 7), obstacle, 0.25, 0.25));
    EXPECT_FALSE(touch(at(1.5 + kTiny, 7), obstacle, 0.25, 0.25));
    Obstacle widened = obstacle;
    widened.margin = 0.25;
    widened.error = 0.25;
    EXPECT_TRUE(touch(at(1.5, 7), widened, 0, 0));
    EXPECT_FALSE(touch(at(1.5 + kTiny, 7), widened, 0, 0));
  }
  EXPECT_FALSE(touch(at(-1 - kTiny, -7), plane, 0, 0));
  EXPECT_TRUE(touch({{0, 0, kInfinity}, {0, 0, kInfinity}, 0}, plane, 0, 0));
}

TEST(ObstaclePlane, DecisionsAreExact) {
  // If this fails, rounding of products or of the normal's length is not bounded.
  Random random(705);
  for (int i = 0; i < 20000; ++i) {
    Obstacle plane;
    plane.kind = i % 2 == 0 ? Obstacle::Kind::kPlane : Obstacle::Kind::kHalfspace;
    plane.vector[0] = fromEigen(random.direction());
    const double size = std::pow(10.0, random.between(-12, 12));
    plane.point = std::pow(10.0, random.between(-12, 12)) * fromEigen(random.inCube(1));
    plane.offset = size * random.between(-1, 1);
    const Exact n = exact<Rational>(plane.vector[0]);
    const Segment s{size * fromEigen(random.inCube(3)), size * fromEigen(random.inCube(3)), 0};
    const auto height = [&](const Vec3d& p) -> Rational {
      return test::product(
                 n, test::sum(exact<Rational>(p), Rational(-1), exact<Rational>(plane.point))) -
             Rational(plane.offset);
    };
    const Rational at_a = height(s.a), at_b = height(s.b), squared = test::product(n, n);
    Rational nearest = std::min(at_a, at_b);
    if (i % 2 == 0 && nearest < 0) nearest = std::max(nearest, Rational(-std::max(at_a, at_b)));
    const double distance = nearest > 0 ? rootOf(nearest * nearest / squared) : 0;
    const double slack =
        64 * kEps *
        (maxNorm(s.a - plane.point) + maxNorm(s.b - plane.point) + std::fabs(plane.offset));
    const Segment near{s.a, s.b, std::nextafter(distance, kInfinity)};
    ASSERT_TRUE(touch(near, plane, 0, 0)) << i;
    if (distance <= 2 * slack) continue;
    ASSERT_FALSE(touch(Segment{s.a, s.b, distance - 2 * slack}, plane, 0, 0)) << i;
  }
}

TEST(ObstaclePlane, MayReachABoxIfItReachesACorner) {
  // If this fails, a floor passes what it meets in a step, or all of a tree is visited for it.
  using test::Real;
  Random random(706);
  int reached = 0, apart = 0;
  for (int i = 0; i < 20000; ++i) {
    Obstacle plane;
    plane.kind = i % 2 == 0 ? Obstacle::Kind::kPlane : Obstacle::Kind::kHalfspace;
    plane.vector[0] = fromEigen(random.direction());
    if (i % 5 == 0) plane.vector[0] = {0, i % 3 == 0 ? -1.0 : 1.0, 0};
    const double size = std::pow(10.0, random.between(-6, 6));
    plane.point = std::pow(10.0, random.between(-6, 6)) * fromEigen(random.inCube(1));
    plane.offset = size * random.between(-1, 1);
    plane.margin = i % 7 == 0 ? 0.1 * size : 0;
    plane.error = i % 11 == 0 ? 0.1 * size : 0;
    const double margin = i % 3 == 0 ? 0.2 * size : 0, error = i % 13 == 0 ? 0.1 * size : 0;
    const Vec3d way = i % 4 == 0 ? Vec3d{0, 0, 0} : size * fromEigen(random.inCube(1));
    // Floats, near the plane.
    const Vec3d middle = plane.point + size * fromEigen(random.inCube(3)),
                half = size * fromEigen((random.inCube(0.5).array() + 0.5).matrix());
    Box box;
    const Vec3d low = middle - half, high = middle + half;
    const double lows[3] = {low.x, low.y, low.z}, highs[3] = {high.x, high.y, high.z};
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] = static_cast<float>(lows[axis]);
      box.high[axis] = static_cast<float>(highs[axis]);
    }
    const test::Point n = toPoint(plane.vector[0]);
    Real lowest = std::numeric_limits<Real>::infinity(), highest = -lowest;
    for (int corner = 0; corner < 8; ++corner) {
      test::Point p;
      for (int axis = 0; axis < 3; ++axis) {
        p[axis] = Real((corner >> axis & 1) != 0 ? box.high[axis] : box.low[axis]);
      }
      for (const Real time : {Real(0), Real(1)}) {
        const test::Point point = toPoint(plane.point) - (1 - time) * toPoint(way);
        const Real height = n.dot(p - point) - Real(plane.offset);
        lowest = std::min(lowest, height);
        highest = std::max(highest, height);
      }
    }
    const Real reach = Real(margin) + Real(plane.margin) + Real(plane.error) + Real(error);
    const Real gap = i % 2 == 0 ? std::max(lowest, -highest) : lowest;
    const bool may_reach = mayReach(box, plane, way, margin, error);
    const double coordinates = maxNorm(plane.point) + 8 * size;
    if (gap <= reach) {
      ASSERT_TRUE(may_reach) << i;
      ++reached;
    } else if (gap > reach + 200 * Real(kEps) * Real(coordinates)) {
      ASSERT_FALSE(may_reach) << i;
      ++apart;
    }
  }
  EXPECT_GT(reached, 3000);
  EXPECT_GT(apart, 3000);
  // What is unknown or unbounded may be anywhere.
  Obstacle plane;
  plane.kind = Obstacle::Kind::kPlane;
  plane.vector[0] = {0, 0, 1};
  const Box far{{5, 5, 5}, {6, 6, 6}};
  EXPECT_FALSE(mayReach(far, plane, {0, 0, 0}, 4.5, 0));
  EXPECT_TRUE(mayReach(far, plane, {0, 0, 0}, kInfinity, 0));
  EXPECT_TRUE(mayReach(far, plane, {0, 0, 0}, std::nan(""), 0));
  EXPECT_TRUE(mayReach(far, plane, {0, 0, kInfinity}, 0, 0));
  const float open = std::numeric_limits<float>::infinity();
  EXPECT_TRUE(mayReach({{-open, -open, -open}, {open, open, open}}, plane, {0, 0, 0}, 0, 0));
  for (const auto kind : {Obstacle::Kind::kNone, Obstacle::Kind::kBox, Obstacle::Kind::kTriangle,
                          Obstacle::Kind::kAxis}) {
    plane.kind = kind;
    EXPECT_TRUE(mayReach(far, plane, {0, 0, 0}, 0, 0));
  }
}

TEST(ObstacleTriangle, CountsByItsCornersMarginAndError) {
  // If this fails, a triangle counts by a box, or without its margin.
  Obstacle triangle;
  triangle.kind = Obstacle::Kind::kTriangle;
  triangle.vector[0] = {0, 0, 0};
  triangle.vector[1] = {4, 0, 0};
  triangle.vector[2] = {0, 4, 0};
  triangle.margin = 0.5;
  triangle.error = 0.25;
  const Segment above{{1, 1, 3}, {1, 1, 9}, 1}, beyond{{3, 3, -9}, {3, 3, 9}, 0};
  EXPECT_TRUE(touch(above, triangle, 1, 0.25));
  EXPECT_FALSE(touch(above, triangle, 1, 0.25 - 1e-12));
  EXPECT_FALSE(touch(above, triangle, 1 - 1e-12, 0.25));
  EXPECT_FALSE(touch(beyond, triangle, 0, 0));
  EXPECT_TRUE(touch(beyond, triangle, 0.67, 0));
}

}  // namespace
}  // namespace fcl_fibers::geometry
