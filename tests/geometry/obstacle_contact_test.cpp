// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/obstacle_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "support/exact_box.h"
#include "support/exact_geometry.h"
#include "support/random.h"
#include "support/segments.h"

namespace fcl_fibers::geometry {
namespace {

using test::Exact;
using test::Random;
using test::Rational;
using test::Real;

constexpr double kEps = std::numeric_limits<double>::epsilon();
// What the header promises of a distance, in eps of the lengths.
constexpr double kMostEps = 32;

Obstacle makeObstacle(Obstacle::Kind kind, const Vec3d& point, const Vec3d& x, const Vec3d& y = {},
                      const Vec3d& z = {}) {
  Obstacle obstacle;
  obstacle.kind = kind;
  obstacle.point = point;
  obstacle.vector[0] = x;
  obstacle.vector[1] = y;
  obstacle.vector[2] = z;
  return obstacle;
}

Segment moved(const Segment& s, const Vec3d& way) { return {s.a + way, s.b + way, s.radius}; }

double largestOf(const Segment& s, const Obstacle& box) {
  double largest = std::max({maxNorm(s.a), maxNorm(s.b), maxNorm(box.point)});
  for (const Vec3d& v : box.vector) largest = std::max(largest, maxNorm(v));
  return largest;
}

/// How far the axis has to move to leave the box: the least over the faces of their differences.
/// They are along two of the edges and the axis, so that products of any two are enough.
/// @pre the axis reaches into the box
double exactDepth(const Segment& axis, const Obstacle& box) {
  const Rational half(0.5);
  const Exact a = test::exact<Rational>(axis.a), b = test::exact<Rational>(axis.b);
  Exact along[4];
  for (int i = 0; i < 3; ++i) along[i] = test::exact<Rational>(box.vector[i]);
  along[3] = test::sum({0, 0, 0}, half, test::sum(b, Rational(-1), a));
  const Exact middle = test::sum(test::sum(test::sum({0, 0, 0}, half, a), half, b), Rational(-1),
                                 test::exact<Rational>(box.point));
  Rational least = -1;
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < i; ++k) {
      const Exact &p = along[i], &q = along[k];
      const Exact n{Rational(p[1] * q[2] - p[2] * q[1]), Rational(p[2] * q[0] - p[0] * q[2]),
                    Rational(p[0] * q[1] - p[1] * q[0])};
      const Rational squared = test::product(n, n);
      if (squared == 0) continue;
      Rational depth = -boost::multiprecision::abs(test::product(n, middle));
      for (const Exact& v : along) depth += boost::multiprecision::abs(test::product(n, v));
      depth = depth < 0 ? Rational(0) : Rational(depth * depth / squared);
      if (least < 0 || depth < least) least = depth;
    }
  }
  return least <= 0 ? 0 : test::rootOf(least);  // a flat one has no inside
}

struct Tally {
  int outside = 0, inside = 0, near = 0;
};

/// Judges the contact with a box in rational numbers.
void expectRight(const Segment& s, const Obstacle& box, Random& random, Tally& tally) {
  const ObstacleContact contact = obstacleContact(s, box, {0, 0, 0});
  const Segment axis{s.a, s.b, 0};
  const test::ExactWay way = test::exactWay(axis, box);
  const double distance = test::rootOf(way.squared);
  // What almost touches may count as touching.
  const bool is_outside = distance > 28 * kEps * largestOf(s, box);
  const double hidden = is_outside ? 0 : distance;
  const double size = test::extentOf(s, box) + s.radius, most = kMostEps * kEps * size;
  const double rounding = 2 * kEps * (largestOf(s, box) + s.radius);
  ASSERT_NEAR(norm(contact.normal), 1, 4 * kEps);
  ASSERT_TRUE(contact.s >= 0 && contact.s <= 1);
  ASSERT_TRUE(contact.s == 0 || !(s.a == s.b));
  ASSERT_EQ(contact.t, 0);
  // The points are what the other members say, and the second is on the box.
  const Vec3d on_axis = s.a + contact.s * (s.b - s.a) + s.radius * contact.normal;
  ASSERT_LE(maxNorm(contact.point_a - on_axis), rounding);
  const Vec3d off = contact.point_b - contact.point_a - contact.distance * contact.normal;
  ASSERT_LE(maxNorm(off), most + 2 * rounding + hidden);
  const double from_box =
      test::rootOf(test::exactWay({contact.point_b, contact.point_b, 0}, box).squared);
  ASSERT_LE(from_box, 4 * kEps * size + 2 * rounding);

  const double axis_distance = contact.distance + s.radius;
  if (is_outside) {
    ++tally.outside;
    tally.near += distance < 1e-9 * size ? 1 : 0;
    ASSERT_NEAR(axis_distance, distance, most);
    const auto exact = [&](std::size_t i) {
      return static_cast<double>(Rational(way.apart[i] / Rational(distance)));
    };
    const double wrong = norm(contact.normal - Vec3d{exact(0), exact(1), exact(2)});
    ASSERT_LE(wrong, kMostEps * kEps * (1 + size / distance));
    return;
  }
  ++tally.inside;
  const double depth = exactDepth(axis, box);
  ASSERT_NEAR(axis_distance, -depth, most + distance);
  // The motion leads out, and on.
  const auto distanceAfter = [&](double length) {
    const Segment after = moved(axis, -length * contact.normal);
    return test::rootOf(test::exactWay(after, box).squared);
  };
  ASSERT_LE(distanceAfter(depth), most + 2 * rounding + distance);
  ASSERT_GE(distanceAfter(depth + 0.1 * size), 0.1 * size - most - 2 * rounding - distance);
  // No shorter one does.
  for (int i = 0; i < 4; ++i) {
    const double less = 0.999 * (depth - most - rounding);
    if (!(less > 0)) break;
    const Vec3d near = contact.normal + 0.1 * fromEigen(random.direction());
    const Vec3d any = i % 2 == 0 ? fromEigen(random.direction()) : (1 / norm(near)) * near;
    ASSERT_LE(test::rootOf(test::exactWay(moved(axis, less * any), box).squared), most) << i;
  }
}

double randomSize(Random& random) {
  const double sizes[] = {1, 1, 1, 0, 1e-3, 1e-8, 1e-13, 30};
  return sizes[random.below(8)] * random.between(0.1, 1);
}

Obstacle randomBox(Random& random, double skew) {
  const Eigen::Matrix3d turn = random.rotation().toRotationMatrix();
  const auto side = [&](int i) {
    return randomSize(random) * fromEigen(turn.col(i) + skew * random.direction());
  };
  return makeObstacle(Obstacle::Kind::kBox, fromEigen(random.inCube(1)), side(0), side(1), side(2));
}

TEST(ObstacleContact, OfABoxIsExactForTurnedBoxes) {
  // If this fails, a depth, a normal or a point is off, also of boxes without volume or at an
  // angle.
  Random random(711);
  Tally tally;
  for (int i = 0; i < 900; ++i) {
    const double skews[] = {0, 5e-3, 0.7};
    const Obstacle box = randomBox(random, skews[i % 3]);
    Segment s{fromEigen(random.inCube(2)), {}, random.below(4) == 0 ? 0 : randomSize(random)};
    // Every other one passes through the box or ends in it.
    if (i % 2 == 0) {
      s.a = box.point;
      for (const Vec3d& v : box.vector) s.a = s.a + random.between(-1, 1) * v;
    }
    const Vec3d way = randomSize(random) * fromEigen(random.direction());
    s = {s.a - random.unit() * way, s.a + way, s.radius};
    ASSERT_NO_FATAL_FAILURE(expectRight(s, box, random, tally)) << i;
  }
  EXPECT_GT(tally.outside, 300);
  EXPECT_GT(tally.inside, 300);
}

TEST(ObstacleContact, OfABoxIsExactAtSmallAngles) {
  // If this fails, an axis nearly along an edge or a face loses digits of its depth or normal.
  Random random(712);
  Tally tally;
  for (int i = 0; i < 1000; ++i) {
    const Obstacle box = randomBox(random, i % 2 == 0 ? 0 : 1e-6);
    // Along an edge or a face, tilted by next to nothing, inside or barely outside.
    const Vec3d across = i % 3 == 0 ? box.vector[1] : 0.7 * box.vector[1] - 0.2 * box.vector[0];
    const double tilt = std::pow(10.0, -random.between(1, 17));
    const double beyond = std::pow(10.0, -random.between(0, 17));
    const double height = random.below(3) == 0 ? random.between(-1, 1) : 1 + beyond;
    const double x = random.between(-1, 1), y = i % 3 == 1 ? height : random.between(-2, 2);
    const Vec3d middle = box.point + height * box.vector[2] + x * box.vector[0] + y * box.vector[1];
    const Vec3d way = random.between(0.1, 3) * across;
    const Vec3d along = way + tilt * fromEigen(random.direction());
    const Segment s{middle - along, middle + along, randomSize(random)};
    ASSERT_NO_FATAL_FAILURE(expectRight(s, box, random, tally)) << i;
  }
  EXPECT_GT(tally.near, 40);
  EXPECT_GT(tally.inside, 150);
}

TEST(ObstacleContact, OfABoxIsExactForWholeNumbers) {
  // If this fails, exact contact and ties go wrong: at a corner, an edge, a face or the middle.
  Random random(713);
  Tally tally;
  const auto whole = [&] { return static_cast<double>(random.below(7)) - 3; };
  const auto half = [&] { return static_cast<double>(random.below(4)); };
  for (int i = 0; i < 1200; ++i) {
    const Vec3d at{whole(), whole(), whole()};
    const Obstacle box =
        i % 2 == 0
            ? makeObstacle(Obstacle::Kind::kBox, at, {half(), 0, 0}, {0, half(), 0}, {0, 0, half()})
            : makeObstacle(Obstacle::Kind::kBox, at, half() * Vec3d{0.75, 1, 0},
                           half() * Vec3d{-1, 0.75, 0}, half() * Vec3d{0, 0, -1});
    const Segment s{{whole(), whole(), whole()}, {whole(), whole(), whole()}, half()};
    ASSERT_NO_FATAL_FAILURE(expectRight(s, box, random, tally)) << i;
  }
  EXPECT_GT(tally.inside, 250);
}

TEST(ObstacleContact, OfABoxIsExactAtAllScalesAndOffsets) {
  // If this fails, squares overflow or vanish, or a place far from the origin costs digits.
  Random random(714);
  Tally tally;
  for (int i = 0; i < 700; ++i) {
    Obstacle box = randomBox(random, i % 3 == 0 ? 0.3 : 0);
    Segment s{fromEigen(random.inCube(1)), fromEigen(random.inCube(1)), randomSize(random)};
    if (i % 2 == 0) {
      const int powers[] = {-1000, -600, -300, -150, 150, 300, 600, 990};
      const double scale = std::ldexp(1.0, powers[random.below(8)]);
      s = {scale * s.a, scale * s.b, scale * s.radius};
      box.point = scale * box.point;
      for (Vec3d& v : box.vector) v = scale * v;
    } else {
      const double offset = std::pow(10.0, random.between(0, 15));
      const Vec3d by{offset, -offset, offset};
      s = moved(s, by);
      box.point = box.point + by;
    }
    ASSERT_NO_FATAL_FAILURE(expectRight(s, box, random, tally)) << i;
  }
}

TEST(ObstacleContact, OfABoxFollowsTheRuleOfTies) {
  // If this fails, the same capsule leaves a box by another face than the header says.
  Obstacle cube = makeObstacle(Obstacle::Kind::kBox, {1, 2, 3}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2});
  const auto normalOf = [&](const Vec3d& a, const Vec3d& b) {
    return obstacleContact({cube.point + a, cube.point + b, 0.5}, cube, {0, 0, 0}).normal;
  };
  // A point in the middle is as near to all faces, and on a diagonal to three.
  EXPECT_TRUE(normalOf({0, 0, 0}, {0, 0, 0}) == (Vec3d{-1, 0, 0}));
  EXPECT_TRUE(normalOf({-1, -1, -1}, {-1, -1, -1}) == (Vec3d{1, 0, 0}));
  EXPECT_TRUE(normalOf({0, -1, -1}, {0, -1, -1}) == (Vec3d{0, 1, 0}));
  // An axis along an edge leaves by a face, from its middle.
  const ObstacleContact along =
      obstacleContact({{1 - 1, 2, 4.5}, {1 + 1, 2, 4.5}, 0.5}, cube, {0, 0, 0});
  EXPECT_TRUE(along.normal == (Vec3d{0, 0, -1}));
  EXPECT_EQ(along.distance, -1);
  EXPECT_EQ(along.s, 0.5);
  EXPECT_TRUE(along.point_a == (Vec3d{1, 2, 4}) && along.point_b == (Vec3d{1, 2, 5}));
  // What is flat is left across it, and what has no extent somewhere.
  cube.vector[2] = {0, 0, 0};
  EXPECT_TRUE(normalOf({0, 0, 0}, {1, 0, 0}) == (Vec3d{0, 0, -1}));
  cube.vector[1] = {0, 0, 0};
  EXPECT_EQ(normalOf({0, 0, 0}, {1, 0, 0}).x, 0);
  cube.vector[0] = {0, 0, 0};
  EXPECT_EQ(normalOf({0, 0, 0}, {1, 0, 0}).x, 0);
  EXPECT_EQ(maxNorm(normalOf({0, 0, 0}, {0, 0, 0})), 1);
}

TEST(ObstacleContact, OfPlanesAndHalfspacesIsAtTheDeeperEnd) {
  // If this fails, a capsule leaves a floor too little, or a plane to the farther side.
  Random random(715);
  for (int i = 0; i < 50000; ++i) {
    const bool is_plane = i % 2 == 0;
    Obstacle plane =
        makeObstacle(is_plane ? Obstacle::Kind::kPlane : Obstacle::Kind::kHalfspace,
                     std::pow(10.0, random.between(-9, 9)) * fromEigen(random.inCube(1)),
                     fromEigen(random.direction()));
    const double size = std::pow(10.0, random.between(-9, 9));
    plane.offset = size * random.between(-1, 1);
    plane.margin = i % 5 == 0 ? 0.1 * size : 0;
    Segment s{size * fromEigen(random.inCube(3)), size * fromEigen(random.inCube(3)),
              size * random.unit()};
    if (i % 7 == 0) s.b = s.a;
    if (i % 7 == 1) {
      s.b = s.a + cross(plane.vector[0], s.b);
    }
    const ObstacleContact c = obstacleContact(s, plane, {0, 0, 0});
    const test::Point n = toPoint(plane.vector[0]).normalized();
    const auto height = [&](const Vec3d& p) {
      return n.dot(toPoint(p) - toPoint(plane.point)) -
             Real(plane.offset) / toPoint(plane.vector[0]).norm();
    };
    const Real low = std::min(height(s.a), height(s.b)), high = std::max(height(s.a), height(s.b));
    const Real axis = is_plane ? std::max(low, -high) : low;
    const Real most = 8 * Real(kEps) *
                      Real(norm1(s.a - plane.point) + norm1(s.b - plane.point) +
                           std::fabs(plane.offset) + s.radius);
    ASSERT_NEAR(double(c.distance - (axis - Real(s.radius) - Real(plane.margin))), 0, double(most));
    const Real rounding = most + 8 * Real(kEps) * Real(maxNorm(plane.point));
    ASSERT_NEAR(double(std::fabs(height(c.point_b)) - Real(plane.margin)), 0, double(rounding));
    const Vec3d off = c.point_b - c.point_a - c.distance * c.normal;
    ASSERT_LE(maxNorm(off), double(rounding)) << i;
    ASSERT_NEAR(double(std::fabs(n.dot(toPoint(c.normal)))), 1, 4 * kEps);
    // The way out is against the normal.
    const Vec3d out = std::min(c.distance, 0.0) * c.normal;
    const Real low_after = std::min(height(s.a + out), height(s.b + out)),
               high_after = std::max(height(s.a + out), height(s.b + out));
    const Real reach = Real(s.radius) + Real(plane.margin) - rounding;
    ASSERT_TRUE(low_after >= reach || (is_plane && -high_after >= reach)) << i;
    ASSERT_TRUE(i % 7 != 1 || c.s == 0.5);
    ASSERT_TRUE(i % 7 != 0 || c.s == 0);
  }
}

TEST(ObstacleContact, OfAxesIsThatOfCapsules) {
  // If this fails, a sphere or a capsule is met elsewhere than two capsules meet.
  Random random(716);
  for (int i = 0; i < 20000; ++i) {
    const Segment s{fromEigen(random.inCube(1)), fromEigen(random.inCube(1)), random.unit()};
    Obstacle axis = makeObstacle(Obstacle::Kind::kAxis, fromEigen(random.inCube(1)),
                                 (i % 3 == 0 ? 0.0 : 1.0) * fromEigen(random.inCube(1)));
    if (i % 5 == 0) axis.point = s.a + random.unit() * (s.b - s.a);
    axis.margin = random.unit();
    const Segment q = axis.capsule();
    const ObstacleContact c = obstacleContact(s, axis, {0, 0, 0});
    ASSERT_NEAR(c.distance, double(capsuleDistance(s, q)), 1e-14);
    ASSERT_LE(maxNorm(s.a + c.s * (s.b - s.a) + s.radius * c.normal - c.point_a), 1e-14);
    ASSERT_LE(maxNorm(q.a + c.t * (q.b - q.a) - q.radius * c.normal - c.point_b), 1e-14);
    ASSERT_LE(maxNorm(c.point_b - c.point_a - c.distance * c.normal), 1e-14);
    ASSERT_NEAR(norm(c.normal), 1, 1e-15);
  }
}

}  // namespace
}  // namespace fcl_fibers::geometry
