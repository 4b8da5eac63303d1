// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/segment_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "support/random.h"
#include "support/segments.h"

namespace fcl_fibers::geometry {
namespace {

using test::Random;
using test::Real;

/// Two segments whose squared distance is known without error.
struct KnownPair {
  Segment p, q;
  double squared;
};

Vec3d cross(const Vec3d& p, const Vec3d& q) {
  return {p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
}

/// What rounding is relative to: the distance of two end points and both lengths.
double extentOf(const Segment& p, const Segment& q) {
  const auto norm1 = [](const Vec3d& d) {
    return std::fabs(d.x) + std::fabs(d.y) + std::fabs(d.z);
  };
  return norm1(p.a - q.a) + norm1(p.b - p.a) + norm1(q.b - q.a);
}

/// Where the distance exceeds the reach by more, the answer must be no: ten eps of the extent, "a
/// few ulp of the coordinates".
Real slackOf(const Segment& p, const Segment& q) { return 0x1.4p-49L * Real(extentOf(p, q)); }

double nextAbove(double x) { return std::nextafter(x, std::numeric_limits<double>::infinity()); }
double nextBelow(double x) { return std::nextafter(x, 0.0); }

void expectExactDecision(const KnownPair& pair, double reach) {
  // The sign of a fused multiply-add is that of the exact difference.
  if (std::fma(reach, reach, -pair.squared) >= 0) {
    EXPECT_TRUE(axesWithin(pair.p, pair.q, reach)) << pair.squared << ", reach " << reach;
    EXPECT_TRUE(axesWithin(pair.q, pair.p, reach)) << pair.squared << ", reach " << reach;
  } else if (std::sqrt(Real(pair.squared)) > Real(reach) + slackOf(pair.p, pair.q)) {
    EXPECT_FALSE(axesWithin(pair.p, pair.q, reach)) << pair.squared << ", reach " << reach;
    EXPECT_FALSE(axesWithin(pair.q, pair.p, reach)) << pair.squared << ", reach " << reach;
  }
}

void expectExactDecisions(const KnownPair& pair) {
  const double distance = std::sqrt(pair.squared);
  for (const double reach : {nextAbove(distance), distance, nextBelow(distance)}) {
    expectExactDecision(pair, reach);
  }
  for (const double change : {1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 0.5}) {
    expectExactDecision(pair, distance * (1 - change));
    expectExactDecision(pair, distance * (1 + change));
    expectExactDecision(pair, change * extentOf(pair.p, pair.q));
  }
  expectExactDecision(pair, 0);
}

// Segments between points with integer coordinates, so that all the products above are exact. Lines
// are given by a common point and their directions, segments by how far they go.

Vec3d integerVector(Random& random, double largest) {
  const auto integer = [&] { return std::round(random.between(-largest, largest)); };
  const double x = integer(), y = integer(), z = integer();
  return {x, y, z};
}
double integerUpTo(Random& random, double largest) {
  return std::round(random.between(0, largest));
}
Segment along(Random& random, const Vec3d& p, const Vec3d& direction, double longest) {
  const double before = integerUpTo(random, longest), after = integerUpTo(random, longest);
  return {p - before * direction, p + after * direction, 0};
}

KnownPair crossing(Random& random) {
  const Vec3d u = integerVector(random, 9), v = integerVector(random, 9);
  const Vec3d apart = integerUpTo(random, 3) * cross(u, v);
  const Vec3d p = integerVector(random, 100);
  return {along(random, p, u, 3), along(random, p + apart, v, 3), squaredNorm(apart)};
}

KnownPair parallel(Random& random) {
  const Vec3d u = integerVector(random, 9);
  const Vec3d apart = cross(u, integerVector(random, 9));
  const Vec3d p = integerVector(random, 100);
  const double ratio = integerUpTo(random, 8) - 4;
  return {along(random, p, u, 3), along(random, p + apart, ratio * u, 3), squaredNorm(apart)};
}

KnownPair endToInside(Random& random) {
  const Vec3d u = integerVector(random, 9);
  const Vec3d apart = cross(u, integerVector(random, 9));
  const Vec3d p = integerVector(random, 100);
  Vec3d v = integerVector(random, 9);
  if (dot(v, apart) < 0) v = -1.0 * v;
  const Segment q{p + apart, p + apart + v, 0};
  return {along(random, p, u, 3), q, squaredNorm(apart)};
}

KnownPair endToEnd(Random& random) {
  const Vec3d apart = integerVector(random, 9);
  const Vec3d p = integerVector(random, 100);
  Vec3d u = integerVector(random, 9), v = integerVector(random, 9);
  if (dot(u, apart) > 0) u = -1.0 * u;
  if (dot(v, apart) < 0) v = -1.0 * v;
  return {{p + u, p, 0}, {p + apart, p + apart + v, 0}, squaredNorm(apart)};
}

KnownPair endToEndOnOneLine(Random& random) {
  const Vec3d u = integerVector(random, 9);
  const Vec3d p = integerVector(random, 100);
  const double gap = integerUpTo(random, 4);
  const Segment q{p + gap * u, p + (gap + integerUpTo(random, 4)) * u, 0};
  return {{p - integerUpTo(random, 4) * u, p, 0}, q, gap * gap * squaredNorm(u)};
}

/// Two lines at an angle of about 2^-power in parallel planes `gap` apart, which cross within both.
KnownPair nearlyParallel(Random& random, int power, double gap) {
  const double unit = std::ldexp(1.0, -power);
  const Vec3d u{1, unit * integerUpTo(random, 2), 0};
  const Vec3d v{random.below(2) == 0 ? 1.0 : -1.0, -unit * (1 + integerUpTo(random, 2)), 0};
  Segment p = along(random, {0, 0, 0}, u, 3), q = along(random, {0, 0, gap}, v, 3);
  return {p, q, gap * gap};
}

template <class F>
void forEndPoints(KnownPair& pair, F&& f) {
  for (Vec3d* point : {&pair.p.a, &pair.p.b, &pair.q.a, &pair.q.b}) *point = f(*point);
}

KnownPair scaled(KnownPair pair, double power_of_two) {
  forEndPoints(pair, [&](const Vec3d& v) { return power_of_two * v; });
  pair.squared *= power_of_two * power_of_two;
  return pair;
}
KnownPair turned(KnownPair pair) {
  forEndPoints(pair, [](const Vec3d& v) { return Vec3d{v.z, v.x, v.y}; });
  return pair;
}

TEST(SegmentDistance, IsTrueToTheLastBitAndFalseAFewUlpFartherOff) {
  // If this fails, touching capsules are missed, or pairs are reported that are apart.
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    for (const auto make : {crossing, parallel, endToInside, endToEnd, endToEndOnOneLine}) {
      const KnownPair pair = make(random);
      expectExactDecisions(pair);
      expectExactDecisions({{pair.p.b, pair.p.a, 0}, pair.q, pair.squared});
      expectExactDecisions({pair.p, {pair.q.b, pair.q.a, 0}, pair.squared});
      if (HasFailure()) FAIL() << "case " << i;
    }
  }
}

TEST(SegmentDistance, HoldsForNearlyParallelSegments) {
  // If this fails, neighbouring hairs are misjudged: there the determinant is rounding noise.
  Random random(3);
  for (int power = 3; power <= 54; ++power) {
    for (int i = 0; i < 60; ++i) {
      const double gaps[] = {0,       1,       0.375,   std::ldexp(1.0 + random.unit(), -10),
                             0x1p-20, 0x1p-30, 0x1p-40, 0x1p-43,
                             0x1p-46};
      for (double gap : gaps) {
        gap = static_cast<double>(static_cast<float>(gap));  // its square is to be exact
        const KnownPair pair = nearlyParallel(random, power, gap);
        expectExactDecisions(pair);
        expectExactDecisions(turned(pair));
        expectExactDecisions(turned(turned(pair)));
      }
    }
    if (HasFailure()) FAIL() << "angle 2^-" << power;
  }
}

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
  EXPECT_FALSE(axesWithin(at_three, at_four, nextBelow(5)));
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

TEST(SegmentDistance, SurvivesAspectsOf1e12) {
  // If this fails, a short segment beside a very long one is lost in the rounding of the long one.
  Random random(4);
  const double longest = 0x1p40;
  for (int i = 0; i < 2000; ++i) {
    const Vec3d u = integerVector(random, 3), v = integerVector(random, 3);
    const Vec3d apart = integerUpTo(random, 3) * cross(u, v);
    const double before = std::floor(longest * random.unit()), after = longest - before;
    const Segment p{-before * u, after * u, 0};
    expectExactDecisions({p, along(random, apart, v, 3), squaredNorm(apart)});
    // Parallel, overlapping, and with the short one turned.
    const Vec3d beside = cross(u, integerVector(random, 3));
    expectExactDecisions({p, along(random, beside, u, 3), squaredNorm(beside)});
    if (HasFailure()) FAIL() << "case " << i;
  }
}

TEST(SegmentDistance, DecidesWhereProductsOfLengthsOverflowOrVanish) {
  // If this fails, a scene in very small or very large units is judged by products that are 0 or
  // infinite.
  Random random(5);
  for (int i = 0; i < 200; ++i) {
    for (const auto make : {crossing, parallel, endToInside, endToEnd, endToEndOnOneLine}) {
      const KnownPair pair = make(random);
      const double distance = std::sqrt(pair.squared), extent = extentOf(pair.p, pair.q);
      for (const int power : {-1000, -600, -260, -130, -90, 90, 130, 190, 260, 600, 960}) {
        const double scale = std::ldexp(1.0, power);
        const KnownPair image = scaled(pair, scale);  // its own squared distance is out of range
        EXPECT_TRUE(axesWithin(image.p, image.q, scale * nextAbove(distance))) << power;
        EXPECT_TRUE(axesWithin(image.p, image.q, scale * 2 * (distance + extent))) << power;
        if (distance > 0) {
          EXPECT_FALSE(axesWithin(image.p, image.q, scale * distance * (1 - 1e-12))) << power;
          EXPECT_FALSE(axesWithin(image.p, image.q, 0)) << power;
        }
      }
      if (HasFailure()) FAIL() << "case " << i;
    }
  }
}

/// Random segments: near each other or not, of like and unlike lengths, some at a small angle.
std::pair<Segment, Segment> anyPair(Random& random, int i) {
  const Vec3d p = fromEigen(random.inCube(1)), q = fromEigen(random.inCube(1));
  const Vec3d u = fromEigen(random.direction());
  Vec3d v = fromEigen(random.direction());
  if (i % 2 == 0) v = u + std::pow(10.0, -random.between(1, 16)) * v;
  if (i % 4 == 0) v = -1.0 * v;
  const double first = std::pow(10.0, random.between(-4, 0));
  const double second = i % 3 == 0 ? first : std::pow(10.0, random.between(-4, 0));
  const Vec3d start = i % 5 == 0 ? p + 0.01 * q : q;
  return {{p, p + first * u, 0}, {start, start + second * v, 0}};
}

TEST(SegmentDistance, AgreesWithAnEnumerationInLongDouble) {
  // If this fails, some region of the square of parameters is never looked at.
  Random random(6);
  for (int i = 0; i < 200000; ++i) {
    const auto [p, q] = anyPair(random, i);
    const Real distance = axisDistance(p, q);
    const double extent = extentOf(p, q);
    const Real error = 0x1p-57L * Real(extent);  // of the enumeration
    for (const double change : {-1e-3, -1e-12, -1e-14, 0.0, 1e-14, 1e-12, 1e-3}) {
      const auto reach = static_cast<double>(distance * (1 + Real(change)));
      const bool within = axesWithin(p, q, reach);
      if (distance + error <= Real(reach)) {
        ASSERT_TRUE(within) << i << ' ' << change;
      }
      if (distance - error > Real(reach) + slackOf(p, q)) {
        ASSERT_FALSE(within) << i << ' ' << change;
      }
    }
  }
}

TEST(AxesWithin, WhatIsNotFiniteIsNotRuledOut) {
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
