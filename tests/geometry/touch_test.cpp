// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/touch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "support/random.h"
#include "support/segments.h"

namespace fcl_fibers::geometry {
namespace {

using test::ExactBox;
using test::Random;
using test::Real;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kEps = std::numeric_limits<double>::epsilon();

ExactBox exactBox(const Segment& s) {
  return test::boxOf({toPoint(s.a), toPoint(s.b), Real(s.thickness())});
}

/// Largest finite coordinate of the two, radii included.
double sizeOf(const Segment& p, const Segment& q) {
  double size = p.thickness() + q.thickness();
  for (const Vec3d& v : {p.a, p.b, q.a, q.b}) {
    for (const double x : {v.x, v.y, v.z}) {
      if (std::isfinite(x)) size = std::max(size, std::fabs(x));
    }
  }
  return size;
}

Segment randomCapsule(Random& random) {
  const Vec3d p = fromEigen(random.inCube(1)), direction = fromEigen(random.direction());
  return {p, p + random.between(0, 0.5) * direction, random.between(0, 0.2)};
}

/// A random box, every side infinite with the given probability.
Segment randomBox(Random& random, double unbounded) {
  const Vec3d p = fromEigen(random.inCube(1)), q = fromEigen(random.inCube(1));
  Segment box = Segment::box(min(p, q), max(p, q));
  for (double* low : {&box.a.x, &box.a.y, &box.a.z}) {
    if (random.unit() < unbounded) *low = -kInfinity;
  }
  for (double* high : {&box.b.x, &box.b.y, &box.b.z}) {
    if (random.unit() < unbounded) *high = kInfinity;
  }
  return box;
}

TEST(Touch, AgreesWithTheDistanceOfCapsules) {
  // If this fails, a radius, the margin or the error of end points is not counted, or counted
  // twice.
  Random random(1);
  for (int i = 0; i < 100000; ++i) {
    const Segment p = randomCapsule(random), q = randomCapsule(random);
    const Real distance = capsuleDistance(p, q);
    for (const double change : {-1e-3, -1e-13, 1e-13, 1e-3}) {
      const auto reach = static_cast<double>(distance + Real(change));
      if (reach < 0) continue;
      for (const double error : {0.0, reach / 4}) {
        ASSERT_EQ(touch(p, q, reach - error, error), change > 0) << i << ' ' << change;
        ASSERT_EQ(touch(q, p, reach - error, error), change > 0) << i << ' ' << change;
      }
    }
    ASSERT_TRUE(touch(p, q, std::max(0.0, static_cast<double>(distance)) + 4 * kEps, 0)) << i;
    ASSERT_EQ(touch(p, q, 0, 0), distance <= 0) << i;
  }
}

TEST(Touch, WhereOneIsABoxTheirBoxesDecide) {
  // If this fails, a box beside the fibers is treated as a line, or by its Euclidean distance.
  Random random(2);
  for (int i = 0; i < 100000; ++i) {
    const Segment box = randomBox(random, i % 2 == 0 ? 0 : 0.3);
    const Segment other =
        i % 3 == 0 ? randomBox(random, i % 2 == 0 ? 0 : 0.3) : randomCapsule(random);
    const Real gap = test::boxGap(exactBox(box), exactBox(other));
    for (const double margin : {0.0, 0.25}) {
      ASSERT_EQ(touch(box, other, margin, 0), gap <= Real(margin)) << i;
      ASSERT_EQ(touch(other, box, margin, 0), gap <= Real(margin)) << i;
      ASSERT_EQ(boxesTouch(other, box, margin), gap <= Real(margin)) << i;
    }
    if (gap > 1e-12L) {
      const auto error = static_cast<double>(gap);
      ASSERT_TRUE(touch(box, other, 0, error * (1 + 1e-13))) << i;
      ASSERT_FALSE(touch(box, other, 0, error * (1 - 1e-12) - 1e-13)) << i;
    }
  }
}

TEST(BoxesTouch, ErrsOnTheSideOfTouchingByAFewUlp) {
  // If this fails, boxes in exact contact are missed on some axis, or the slack is not of rounding.
  Random random(3);
  for (int i = 0; i < 100000; ++i) {
    const double scale = std::ldexp(1.0, static_cast<int>(random.below(200)) - 100);
    Segment p = randomCapsule(random), q = randomCapsule(random);
    for (Segment* s : {&p, &q}) *s = {scale * s->a, scale * s->b, scale * s->radius};
    const Real gap = test::boxGap(exactBox(p), exactBox(q));
    if (gap < 0) {
      ASSERT_TRUE(boxesTouch(p, q, 0)) << i;
      continue;
    }
    const double slack = 32 * kEps * sizeOf(p, q);
    ASSERT_TRUE(boxesTouch(p, q, static_cast<double>(gap))) << i;
    ASSERT_TRUE(boxesTouch(q, p, static_cast<double>(gap))) << i;
    ASSERT_FALSE(boxesTouch(p, q, static_cast<double>(gap - Real(slack)))) << i;
    ASSERT_FALSE(boxesTouch(q, p, static_cast<double>(gap - Real(slack)))) << i;
  }
}

TEST(BoxesTouch, UnboundedSidesReachEverything) {
  // If this fails, infinity minus infinity decides: a half-space misses, or catches everything.
  const Segment all =
      Segment::box({-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity});
  const Segment below =
      Segment::box({-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, 0});
  const Segment above =
      Segment::box({-kInfinity, -kInfinity, 2}, {kInfinity, kInfinity, kInfinity});
  const Segment slab = Segment::box({-kInfinity, -kInfinity, 3}, {kInfinity, kInfinity, 4});
  const Segment column = Segment::box({7, 5, -kInfinity}, {8, 8, kInfinity});
  const Segment capsule{{5, 5, 2}, {5, 6, 3}, 0.5};

  for (const Segment& other : {all, below, above, slab, column, capsule}) {
    EXPECT_TRUE(boxesTouch(all, other, 0));
    EXPECT_TRUE(boxesTouch(other, all, 0));
  }
  const auto expectApart = [](const Segment& p, const Segment& q, double distance) {
    EXPECT_FALSE(boxesTouch(p, q, distance - 1e-9));
    EXPECT_FALSE(boxesTouch(q, p, distance - 1e-9));
    EXPECT_TRUE(boxesTouch(p, q, distance));
    EXPECT_TRUE(boxesTouch(q, p, distance));
  };
  expectApart(below, above, 2);
  expectApart(below, slab, 3);
  expectApart(below, capsule, 1.5);
  expectApart(column, capsule, 1.5);
  EXPECT_TRUE(boxesTouch(above, slab, 0));
  EXPECT_TRUE(boxesTouch(column, below, 0));
  EXPECT_TRUE(boxesTouch(above, capsule, 0));
}

TEST(IsBounded, LooksAtAllSixSides) {
  // If this fails, an unbounded shape is put into the tree.
  EXPECT_TRUE(isBounded(Segment::box({-1, -2, -3}, {1e300, 2, 3})));
  const auto sides = [](Segment& s) {
    return std::array{&s.a.x, &s.a.y, &s.a.z, &s.b.x, &s.b.y, &s.b.z};
  };
  for (std::size_t i = 0; i < 6; ++i) {
    Segment box = Segment::box({-1, -2, -3}, {1, 2, 3});
    *sides(box)[i] = i < 3 ? -kInfinity : kInfinity;
    EXPECT_FALSE(isBounded(box)) << i;
  }
}

}  // namespace
}  // namespace fcl_fibers::geometry
