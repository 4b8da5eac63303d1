// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/cone_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <sstream>
#include <string>

#include "geometry/triangle_contact.h"
#include "geometry/triangle_distance.h"
#include "support/cone_oracle.h"
#include "support/random.h"
#include "support/segments.h"

namespace fcl_fibers::geometry {
namespace {

using test::Random;
using test::Real;

constexpr double kEps = std::numeric_limits<double>::epsilon();

struct Pair {
  Segment cone;
  Triangle triangle;

  /// Of coordinates and radii, by which rounding is bounded.
  double size() const {
    return norm1(cone.a - triangle.a) + norm1(cone.b - cone.a) + norm1(triangle.b - triangle.a) +
           norm1(triangle.c - triangle.a) + cone.radius;
  }
  Real axisDistance() const {
    return test::segmentTriangleDistance(
        toPoint(cone.a), toPoint(cone.b),
        {toPoint(triangle.a), toPoint(triangle.b), toPoint(triangle.c)});
  }
  Pair scaled(double scale) const {
    return {{scale * cone.a, scale * cone.b, scale * cone.radius, scale * cone.taper},
            {scale * triangle.a, scale * triangle.b, scale * triangle.c}};
  }
};

std::string described(const Pair& pair) {
  std::ostringstream out;
  out.precision(17);
  const auto& [s, t] = pair;
  for (const Vec3d& p : {s.a, s.b, t.a, t.b, t.c}) {
    out << "{" << p.x << ", " << p.y << ", " << p.z << "} ";
  }
  out << "radii " << s.radiusAtA() << ", " << s.radiusAtB();
  return out.str();
}

double magnitude(Random& random, double least) { return std::pow(least, random.unit()); }
Vec3d inCube(Random& random, double half = 1) { return fromEigen(random.inCube(half)); }

/// Cones and triangles of the kinds at which something may go wrong.
Pair randomPair(Random& random) {
  Pair pair;
  auto& [s, t] = pair;
  t = {inCube(random), inCube(random), inCube(random)};
  const double length = random.below(8) == 0 ? 0 : magnitude(random, 1e-6);
  Vec3d a = inCube(random), b = a + length * fromEigen(random.direction());
  switch (random.below(8)) {
    case 0:  // a needle
      t.c = t.a + 0.3 * (t.b - t.a) + magnitude(random, 1e-17) * inCube(random);
      break;
    case 1:
      t.c = t.b;
      break;
    case 2:
      t.b = t.c = t.a;
      break;
    case 3:  // nearly parallel to an edge
      b = a + random.between(-2, 2) * (t.b - t.a) + magnitude(random, 1e-16) * inCube(random);
      break;
    case 4: {  // hair that lies on the triangle, or dips into it
      const Vec3d across = cross(t.b - t.a, t.c - t.a);
      const double height = magnitude(random, 1e-16);
      const auto near = [&, corner = t.a, to_b = t.b - t.a, to_c = t.c - t.a] {
        const double x = 2 * random.unit() - 0.5, y = 2 * random.unit() - 0.5;
        return corner + x * to_b + y * to_c + height * random.between(-1, 1) * across;
      };
      a = near();
      b = near();
      break;
    }
    default:
      break;
  }
  const double radius = magnitude(random, 1e-4), span = norm(b - a);
  switch (random.below(6)) {
    case 0:  // one end is a point
      s = Segment::cone(a, b, 0, radius);
      break;
    case 1:  // one ball may hold the other
      s = Segment::cone(a, b, radius + 2 * span * random.unit(), radius);
      break;
    case 2:  // nearly that
      s = Segment::cone(a, b, radius, radius + span * (1 + kEps * random.between(-8, 8)));
      break;
    case 3:
      s = Segment::cone(a, b, radius, radius * (1 + kEps));
      break;
    default:
      s = Segment::cone(a, b, radius, radius * random.unit());
  }
  if (random.below(2) == 0) s = Segment::cone(s.b, s.a, s.radiusAtB(), s.radiusAtA());
  return pair;
}

TEST(ConeTriangleDistance, TouchIsDecidedAsByTheDefinition) {
  Random random(20260111);
  int apart = 0;
  for (int round = 0; round < 6000; ++round) {
    const Pair pair = randomPair(random);
    const auto& [cone, triangle] = pair;
    const double distance = static_cast<double>(test::coneDistance(cone, triangle));
    // touch() allows four roundings of the radii; the oracle and the radii at the ends have less.
    const double doubt = 16 * kEps * (pair.size() + std::fabs(distance));
    ASSERT_TRUE(touch(cone, triangle, std::max(distance + doubt, 0.0), 0)) << described(pair);
    ASSERT_TRUE(touch(cone, triangle, std::max(distance - doubt, 0.0), 2 * doubt));
    if (distance - doubt < 0) continue;
    ++apart;
    ASSERT_FALSE(touch(cone, triangle, distance - doubt, 0)) << described(pair);
  }
  EXPECT_GT(apart, 1000);
}

TEST(ConeTriangleDistance, ClosestPointsHaveTheDistanceAndTheWayOut) {
  Random random(20260112);
  int ways = 0;
  for (int round = 0; round < 6000; ++round) {
    const Pair pair = randomPair(random);
    const auto& [cone, t] = pair;
    if (!cone.isTapered()) continue;
    const double distance = static_cast<double>(test::coneDistance(cone, t));
    const ClosestOnTriangle closest = closestPoints(cone, t);
    const auto& [a, b, c] = closest.weight;
    ASSERT_TRUE(closest.s >= 0 && closest.s <= 1 && a >= 0 && b >= 0 && c >= 0);
    ASSERT_NEAR(a + b + c, 1, 1e-15);
    const double length = norm(closest.apart);
    ASSERT_NEAR(length - cone.radiusAt(closest.s), distance, 32 * kEps * pair.size())
        << described(pair);
    const Vec3d apart = a * t.a + b * t.b + c * t.c - (cone.a + closest.s * (cone.b - cone.a));
    ASSERT_LE(norm(apart - closest.apart), 16 * kEps * pair.size());
    if (length < 1e-10 * pair.size()) continue;
    // All of the triangle lies beyond all of the cone, by the distance.
    ++ways;
    const Vec3d n = (1 / length) * closest.apart;
    const auto beyond = [&n, end = cone.a](const Vec3d& corner) { return dot(n, corner - end); };
    const double gap = std::min({beyond(t.a), beyond(t.b), beyond(t.c)}) -
                       std::max(cone.radiusAtA(), dot(n, cone.b - cone.a) + cone.radiusAtB());
    // What closestOfCone() promises.
    ASSERT_NEAR(gap, distance, 64 * kEps * pair.size() * (1 + pair.size() / length))
        << described(pair);
  }
  EXPECT_GT(ways, 3000);
}

TEST(ConeTriangleDistance, TheLeastDistanceIsATightBound) {
  Random random(20260113);
  for (int round = 0; round < 6000; ++round) {
    const Pair pair = randomPair(random);
    const double size = pair.size();
    const Real distance = test::coneDistance(pair.cone, pair.triangle);
    const double least = leastDistance(pair.cone, pair.triangle);
    const Real of_capsule = distance + pair.cone.radius;
    ASSERT_GE(least, 0) << described(pair);
    // The radii at the ends carry a rounding each.
    ASSERT_LE(least, of_capsule + 1e-16L * pair.cone.radius) << described(pair);
    if (pair.axisDistance() <= 1e-15L * size) continue;
    ASSERT_GE(least, (1 - 1e-8L) * of_capsule - 1e-14L * size) << described(pair);
  }
}

TEST(ConeTriangleDistance, ScalesThatOverflowAndVanishAreNoDifferent) {
  Random random(20260114);
  for (int round = 0; round < 300; ++round) {
    const Pair pair = randomPair(random);
    const double distance = static_cast<double>(test::coneDistance(pair.cone, pair.triangle));
    const double doubt = 16 * kEps * (pair.size() + std::fabs(distance));
    for (const double scale : {0x1p-900, 0x1p-500, 0x1p-140, 0x1p140, 0x1p500, 0x1p900}) {
      const auto [cone, triangle] = pair.scaled(scale);
      const auto at = [&](double x) { return scale * std::max(x, 0.0); };
      ASSERT_TRUE(touch(cone, triangle, at(distance + doubt), 0)) << described(pair);
      if (distance > doubt) {
        ASSERT_FALSE(touch(cone, triangle, at(distance - doubt), 0)) << described(pair);
      }
      const ClosestOnTriangle closest = closestPoints(cone, triangle);
      ASSERT_NEAR((safeNorm(closest.apart) - cone.radiusAt(closest.s)) / scale, distance,
                  32 * kEps * pair.size());
      if (distance > 0) {
        ASSERT_NEAR((leastDistance(cone, triangle) - cone.radius) / scale, distance,
                    1e-8 * pair.size());
      }
    }
  }
}

TEST(ConeTriangleDistance, WhatIsNotFiniteIsNotRuledOut) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Triangle triangle{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  for (const double bad : {kInfinity, -kInfinity, std::nan("")}) {
    const Segment cone = Segment::cone({0, bad, 5}, {1, 0, 5}, 0.1, 0.2);
    EXPECT_TRUE(touch(cone, triangle, 1, 0));
    EXPECT_EQ(leastDistance(cone, triangle), 0);
    EXPECT_EQ(maxNorm(closestPoints(cone, triangle).apart), kInfinity);
  }
}

// A contact would not end by the motion that it tells, or tell one that is longer than it has to
// be.
TEST(ConeTriangleContact, SeparatesConeAndTriangle) {
  Random random(20260115);
  int crossing = 0, other = 0;
  for (int round = 0; round < 12000; ++round) {
    const Pair pair = randomPair(random);
    const auto& [cone, t] = pair;
    if (!cone.isTapered()) continue;
    const double size = pair.size();
    const TriangleContact contact = triangleContact(cone, t, {0, 0, 0});
    ASSERT_NEAR(norm(contact.normal), 1, 1e-14);
    const Vec3d on_axis = cone.a + contact.s * (cone.b - cone.a);
    const double radius = cone.radiusAt(contact.s);
    ASSERT_NEAR(norm(contact.point_a - on_axis - radius * contact.normal), 0, 1e-14 * size);
    const double axis_distance = static_cast<double>(pair.axisDistance());
    if (axis_distance > 1e-12 * size) {
      ASSERT_FALSE(contact.crosses) << described(pair);
    }
    if (axis_distance < 1e-17 * size && norm(cross(t.b - t.a, t.c - t.a)) > 1e-6) {
      ASSERT_TRUE(contact.crosses) << described(pair);
      // The whole cone moves to one side of the plane, by the shorter way.
      const Vec3d normal = unitNormal(t, {0, 0, 0});
      const double a = dot(normal, cone.a - t.a), b = dot(normal, cone.b - t.a);
      const double above = std::max(a + cone.radiusAtA(), b + cone.radiusAtB());
      const double below = std::max(cone.radiusAtA() - a, cone.radiusAtB() - b);
      ASSERT_NEAR(-contact.distance, std::min(above, below), 1e-12 * size) << described(pair);
    }
    if (!contact.crosses) {
      ASSERT_NEAR(contact.distance, static_cast<double>(test::coneDistance(cone, t)), 1e-14 * size);
      ASSERT_NEAR(norm(contact.point_b - contact.point_a - contact.distance * contact.normal), 0,
                  1e-14 * size);
    }
    if (contact.distance >= 0) continue;
    (contact.crosses ? crossing : other) += 1;
    const Vec3d move = contact.distance * contact.normal;
    const Segment moved{cone.a + move, cone.b + move, cone.radius, cone.taper};
    // A needle has a normal of the precision of its width.
    const double width = norm(cross(t.b - t.a, t.c - t.a));
    if (contact.crosses && width < 1e-6) continue;
    // What closestOfCone() promises of the normal, by which the motion is off.
    const double length = contact.distance + radius;
    const double off = contact.crosses ? 0 : 64 * kEps * size * (1 + size / length);
    ASSERT_GE(static_cast<double>(test::coneDistance(moved, t)), -1e-9 * size - off)
        << described(pair);
  }
  EXPECT_GT(crossing, 200);
  EXPECT_GT(other, 1000);
}

}  // namespace
}  // namespace fcl_fibers::geometry
