// SPDX-License-Identifier: BSD-3-Clause
#include "support/touch_oracle.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "support/exact_geometry.h"
#include "support/random.h"

namespace fcl_fibers::test {
namespace {

using Numbers = std::array<double, 3>;

Numbers numbers(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }
Point point(const Numbers& p) { return Point(p[0], p[1], p[2]); }

GivenCapsule capsule(const Numbers& a, const Numbers& b, double radius) { return {a, b, radius}; }

Real distanceOf(const GivenCapsule& p, const GivenCapsule& q) {
  return segmentDistance(point(p.a), point(p.b), point(q.a), point(q.b));
}

GivenCapsule randomCapsule(Random& random, double length, double radius) {
  const Eigen::Vector3d a = random.inCube(1);
  return capsule(numbers(a), numbers(a + length * random.direction()), radius);
}

double up(double x) { return std::nextafter(x, std::numeric_limits<double>::infinity()); }
double down(double x) { return std::nextafter(x, -std::numeric_limits<double>::infinity()); }

void expectBoth(const GivenCapsule& p, const GivenCapsule& q, bool touching) {
  EXPECT_EQ(TouchOracle::touchExactly(p, q, 0), touching);
  EXPECT_EQ(TouchOracle::touchExactly(q, p, 0), touching);
  EXPECT_EQ(TouchOracle::judge(p, q, 0).touching, touching);
  EXPECT_EQ(TouchOracle({p, q}).touch(0, 1), touching);
}

// Contact would be missed, or a hair's breadth be taken for contact: every test of extremes would.
TEST(TouchOracleTest, KnowsContactToTheLastBit) {
  const GivenCapsule p = capsule({0, 0, 0}, {1, 0, 0}, 0.25);
  const GivenCapsule parallel = capsule({3, 1, 0}, {0, 1, 0}, 0.75);
  const GivenCapsule crossing = capsule({0.5, -1, 1}, {0.5, 1, 1}, 0.75);
  const GivenCapsule end_to_end = capsule({2, 0, 0}, {5, 0, 0}, 0.75);
  const GivenCapsule ball = capsule({-0.6, 0.8, 0}, {-0.6, 0.8, 0}, 0.75);
  for (GivenCapsule q : {parallel, crossing, end_to_end}) {
    expectBoth(p, q, true);
    q.radius = down(0.75);
    expectBoth(p, q, false);
    q.radius = up(0.75);
    expectBoth(p, q, true);
  }
  // 0.6^2 + 0.8^2 is not 1 in double; exactly, the two are 1.3e-17 further apart.
  const Real distance = std::hypot(Real(0.6), Real(0.8));
  expectBoth(p, ball, distance <= 1);
  EXPECT_NE(distance, 1);
  expectBoth(capsule({0, 0, 0}, {0, 0, 0}, 2), capsule({3, 4, 0}, {3, 4, 0}, 3), true);
  expectBoth(capsule({0, 0, 0}, {0, 0, 0}, 2), capsule({3, 4, 0}, {3, 4, 0}, down(3)), false);
}

/// One time in three nearly parallel to p, or exactly.
void layAlong(Random& random, int i, const GivenCapsule& p, GivenCapsule& q) {
  if (i % 3 != 0) return;
  const double tilt = i % 2 == 0 ? 0 : std::ldexp(1.0, -static_cast<int>(random.below(60)));
  for (std::size_t k = 0; k < 3; ++k) q.b[k] = q.a[k] + (p.b[k] - p.a[k]) + tilt * random.unit();
}

// A slip in one of the cases: at an end, within one segment, within both.
TEST(TouchOracleTest, IntegersAgreeWithTheDistance) {
  Random random(21);
  for (int i = 0; i < 3000; ++i) {
    GivenCapsule p = randomCapsule(random, i % 7 == 0 ? 0 : 1, 0);
    GivenCapsule q = randomCapsule(random, i % 11 == 0 ? 0 : 1, 0);
    layAlong(random, i, p, q);
    const Real distance = distanceOf(p, q);
    p.radius = static_cast<double>(distance) * (1 + 1e-14);
    ASSERT_TRUE(TouchOracle::touchExactly(p, q, 0)) << i;
    p.radius = static_cast<double>(distance) * (1 - 1e-14);
    ASSERT_FALSE(TouchOracle::touchExactly(p, q, 0)) << i;
    ASSERT_TRUE(TouchOracle::touchExactly(p, q, static_cast<double>(distance) * 1e-13)) << i;
  }
}

// The filter would decide what only integers can; at any size, and whatever the angle.
TEST(TouchOracleTest, TheFilterNeverContradictsIntegers) {
  Random random(22);
  std::size_t filtered = 0, total = 0;
  for (int i = 0; i < 20000; ++i) {
    const double scale = std::ldexp(1.0, static_cast<int>(random.below(1000)) - 500);
    GivenCapsule p = randomCapsule(random, 1, 0), q = randomCapsule(random, 1, 0);
    layAlong(random, i, p, q);
    const auto distance = static_cast<double>(distanceOf(p, q));
    p.radius = distance * (1 + std::ldexp(random.unit() - 0.5, -static_cast<int>(i % 55)));
    for (GivenCapsule* c : {&p, &q}) {
      for (double& x : c->a) x *= scale;
      for (double& x : c->b) x *= scale;
      c->radius *= scale;
    }
    const TouchOracle::Verdict verdict = TouchOracle::judge(p, q, 0);
    ASSERT_EQ(verdict.touching, TouchOracle::touchExactly(p, q, 0)) << i;
    ASSERT_EQ(TouchOracle({p, q}).touch(0, 1), verdict.touching) << i;
    ASSERT_NEAR(verdict.excess / scale, distance - p.radius / scale, 1e-13) << i;
    filtered += !verdict.exact;
    ++total;
  }
  EXPECT_GT(filtered, total / 2);
}

// What an FCL object holds, a centre, an axis and a length, would be rounded before it is judged.
TEST(TouchOracleTest, TakesEndPointsOfObjectsAsExact) {
  // 1 + 2^-60 is no double, but centre and half length add up to it.
  GivenCapsule p{{1, 0, 0}, {1, 0, 0}, 0, 0x1p-59, {1, 0, 0}};
  const GivenCapsule ball = capsule({2, 0, 0}, {2, 0, 0}, down(1));
  EXPECT_FALSE(TouchOracle::touchExactly(p, ball, 0));
  p.length = 0x1p-52;
  EXPECT_TRUE(TouchOracle::touchExactly(p, ball, 0));

  Random random(23);
  for (int i = 0; i < 2000; ++i) {
    const Numbers center = numbers(random.inCube(1)), axis = numbers(random.direction());
    const GivenCapsule object{center, center, random.between(0, 0.5), random.unit(), axis};
    GivenCapsule ends = capsule(center, center, object.radius);
    for (std::size_t k = 0; k < 3; ++k) {
      ends.a[k] -= object.length / 2 * axis[k];
      ends.b[k] += object.length / 2 * axis[k];
    }
    const GivenCapsule other = randomCapsule(random, 1, 0.1);
    if (std::fabs(distanceOf(ends, other) - ends.radius - other.radius) < 1e-14L) continue;
    const bool touching = TouchOracle::judge(ends, other, 0).touching;
    ASSERT_EQ(TouchOracle::judge(object, other, 0).touching, touching) << i;
    ASSERT_EQ(TouchOracle::touchExactly(object, other, 0), touching) << i;
    ASSERT_EQ(TouchOracle({object, other}).touch(0, 1), touching) << i;
  }
}

// Subnormal and huge numbers would be judged by what has underflowed or overflowed.
TEST(TouchOracleTest, HoldsToTheEndsOfTheRange) {
  const double least = std::numeric_limits<double>::denorm_min();
  const double most = std::numeric_limits<double>::max();
  const auto row = [](double x, double gap, double radius) {
    const GivenCapsule p = capsule({0, 0, 0}, {x, 0, 0}, radius);
    return std::array{p, capsule({0, gap, 0}, {x, gap, 0}, radius)};
  };
  for (const auto& [pair, touching] :
       {std::pair{row(10 * least, 4 * least, 2 * least), true},
        std::pair{row(10 * least, 5 * least, 2 * least), false},
        std::pair{row(most, most, most / 2), true},
        std::pair{row(most, most, down(most / 2)), false}, std::pair{row(most, least, 0), false},
        std::pair{row(most, least, least), true}}) {
    expectBoth(pair[0], pair[1], touching);
  }
  expectBoth(capsule({-most, 0, 0}, {most, 0, 0}, 0), capsule({1, 1, 0}, {1, 1, 0}, 1), true);
  expectBoth(capsule({-most, 0, 0}, {most, 0, 0}, 0), capsule({1, 1, 0}, {1, 1, 0}, down(1)),
             false);
}

}  // namespace
}  // namespace fcl_fibers::test
