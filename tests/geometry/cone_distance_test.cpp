// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/cone_distance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <ostream>

#include "geometry/touch.h"
#include "support/cone_oracle.h"
#include "support/random.h"
#include "support/segments.h"

namespace fcl_fibers::geometry {

std::ostream& operator<<(std::ostream& out, const Segment& s) {
  out.precision(17);
  return out << "{{" << s.a.x << ", " << s.a.y << ", " << s.a.z << "}, {" << s.b.x << ", " << s.b.y
             << ", " << s.b.z << "}, " << s.radiusAtA() << ", " << s.radiusAtB() << "}";
}

namespace {

using test::Random;

constexpr double kEps = std::numeric_limits<double>::epsilon();

double magnitude(Random& random, double least) { return std::pow(least, random.unit()); }

/// A cone of one of the kinds at which something may go wrong.
Segment randomCone(Random& random) {
  const double length = random.below(8) == 0 ? 0 : magnitude(random, 1e-6);
  const Vec3d a = fromEigen(random.inCube(1)), along = fromEigen(random.direction());
  const double radius = magnitude(random, 1e-4);
  const double tiny = magnitude(random, std::numeric_limits<double>::denorm_min());
  const double least = random.below(2) == 0 ? 0 : radius;
  switch (random.below(6)) {
    case 5:  // a ball, or all but one
      return Segment::cone({0, 0, 0}, tiny * fromEigen(random.direction()), least,
                           least + tiny * random.between(0, 2));
    case 0:  // one end is a point
      return Segment::cone(a, a + length * along, 0, radius);
    case 1:  // one ball may hold the other
      return Segment::cone(a, a + length * along, radius + 2 * length * random.unit(), radius);
    case 2:  // nearly that
      return Segment::cone(a, a + length * along, radius,
                           radius + length * (1 + kEps * random.between(-8, 8)));
    case 3:
      return Segment::cone(a, a + length * along, radius, radius * (1 + kEps));
    default:
      return Segment::cone(a, a + length * along, radius, radius * random.unit());
  }
}

/// Another one at random, or in a place that makes the pair special.
Segment partnerOf(Random& random, const Segment& p) {
  Segment q = randomCone(random);
  const Vec3d along = p.b - p.a;
  const auto moveTo = [&q](const Vec3d& a) {
    q.b = q.b - q.a + a;
    q.a = a;
  };
  switch (random.below(6)) {
    case 0:  // parallel
      q.b = q.a + random.between(-2, 2) * along;
      break;
    case 1:  // nearly parallel
      q.b = q.a + random.between(-2, 2) * along + 1e-9 * fromEigen(random.direction());
      break;
    case 2:  // the axes meet
      moveTo(p.a + random.unit() * along);
      break;
    case 3:  // one after the other
      moveTo(p.b);
      break;
    default:
      break;
  }
  return q;
}

double sizeOf(const Segment& p, const Segment& q) {
  return norm1(p.a - q.a) + norm1(p.b - p.a) + norm1(q.b - q.a) + p.radius + q.radius;
}

TEST(ConeDistance, TouchIsDecidedAsByTheDefinition) {
  Random random(20260101);
  for (int round = 0; round < 1500; ++round) {
    const Segment p = randomCone(random), q = partnerOf(random, p);
    const double distance = static_cast<double>(test::coneDistance(p, q));
    for (const Segment& second : {q, Segment{q.b, q.a, q.radius, -q.taper}}) {
      // touch() allows four roundings of the radii; the oracle and the radii at the ends have less.
      const double doubt = 16 * kEps * (sizeOf(p, second) + std::fabs(distance));
      EXPECT_TRUE(coneWithin(p, second, distance + doubt, 0)) << p << " " << second;
      EXPECT_FALSE(coneWithin(p, second, distance - doubt, 0)) << p << " " << second;
      EXPECT_TRUE(coneWithin(second, p, distance + doubt, 0)) << p << " " << second;
      EXPECT_FALSE(coneWithin(second, p, distance - doubt, 0)) << p << " " << second;
    }
  }
}

TEST(ConeDistance, ClosestPointsHaveTheDistance) {
  Random random(20260102);
  for (int round = 0; round < 1500; ++round) {
    const Segment p = randomCone(random), q = partnerOf(random, p);
    const auto distance = static_cast<double>(test::coneDistance(p, q));
    const ClosestPoints closest = closestPoints(p, q);
    const double found = safeNorm(closest.apart) - p.radiusAt(closest.s) - q.radiusAt(closest.t);
    EXPECT_NEAR(found, distance, 32 * kEps * sizeOf(p, q)) << p << " " << q;
    const Vec3d apart =
        q.a + closest.t * (q.b - q.a) - (p.a + closest.s * (p.b - p.a)) - closest.apart;
    // The points are rounded like coordinates, which are at most 2 here.
    EXPECT_LE(maxNorm(apart), 8 * kEps) << p << " " << q;
  }
}

TEST(ConeDistance, ScalesThatOverflowAndVanishAreNoDifferent) {
  Random random(20260103);
  for (int round = 0; round < 200; ++round) {
    const Segment p = randomCone(random), q = partnerOf(random, p);
    const double distance = static_cast<double>(test::coneDistance(p, q));
    const double doubt = 16 * kEps * (sizeOf(p, q) + std::fabs(distance));
    for (const double scale : {0x1p-900, 0x1p-300, 0x1p300, 0x1p900}) {
      const auto scaled = [scale](const Segment& s) {
        return Segment{scale * s.a, scale * s.b, scale * s.radius, scale * s.taper};
      };
      EXPECT_TRUE(coneWithin(scaled(p), scaled(q), scale * (distance + doubt), 0)) << scale;
      EXPECT_FALSE(coneWithin(scaled(p), scaled(q), scale * (distance - doubt), 0)) << scale;
      const ClosestPoints closest = closestPoints(scaled(p), scaled(q));
      const double found =
          safeNorm(closest.apart) - scaled(p).radiusAt(closest.s) - scaled(q).radiusAt(closest.t);
      EXPECT_NEAR(found / scale, distance, 32 * kEps * sizeOf(p, q)) << scale;
    }
  }
}

TEST(ConeDistance, WhatIsNotFiniteIsNotRuledOut) {
  const double infinity = std::numeric_limits<double>::infinity();
  const Segment p = Segment::cone({0, 0, 0}, {1, 0, 0}, 0.1, 0.2);
  for (const double bad : {infinity, -infinity, std::nan("")}) {
    const Segment q{{bad, 0, 0}, {bad, 1, 0}, 0};
    EXPECT_TRUE(touch(p, q, 1, 0));
    EXPECT_TRUE(touch(q, p, 1, 0));
  }
}

}  // namespace
}  // namespace fcl_fibers::geometry
