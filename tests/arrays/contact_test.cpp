// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/contact.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/assembly.h"
#include "support/exact_geometry.h"
#include "support/random.h"
#include "support/scalars.h"

namespace fcl_fibers {
namespace {

using test::Assembly;
using test::Point;
using test::Random;
using test::Real;

constexpr Real kEps = std::numeric_limits<double>::epsilon();

Point toPoint(const std::array<double, 3>& v) { return Point(v[0], v[1], v[2]); }
std::array<double, 3> toArray(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

CapsuleShape capsule(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius) {
  return {toArray(from), toArray(to), radius};
}

Real trueAxisDistance(const CapsuleShape& a, const CapsuleShape& b) {
  return test::segmentDistance(toPoint(a.start), toPoint(a.end), toPoint(b.start), toPoint(b.end));
}

/// Distance of the axes and their lengths together, as 1-norms.
Real extentOf(const CapsuleShape& a, const CapsuleShape& b) {
  return (toPoint(b.start) - toPoint(a.start)).lpNorm<1>() +
         (toPoint(a.end) - toPoint(a.start)).lpNorm<1>() +
         (toPoint(b.end) - toPoint(b.start)).lpNorm<1>();
}

Real largestCoordinate(const CapsuleShape& a, const CapsuleShape& b) {
  return std::max(
      {toPoint(a.start).lpNorm<Eigen::Infinity>(), toPoint(a.end).lpNorm<Eigen::Infinity>(),
       toPoint(b.start).lpNorm<Eigen::Infinity>(), toPoint(b.end).lpNorm<Eigen::Infinity>()});
}

/// All that contact.h says of a contact.
void expectRight(const CapsuleShape& a, const CapsuleShape& b, const Contact& contact) {
  const Real distance = trueAxisDistance(a, b), extent = extentOf(a, b);
  const Real coordinates = largestCoordinate(a, b);
  const Real reach = Real(a.radius) + Real(b.radius);
  const Point p0 = toPoint(a.start), p1 = toPoint(a.end), q0 = toPoint(b.start),
              q1 = toPoint(b.end);

  ASSERT_TRUE(contact.s >= 0 && contact.s <= 1) << contact.s;
  ASSERT_TRUE(contact.t >= 0 && contact.t <= 1) << contact.t;
  if (p0 == p1) {
    EXPECT_EQ(contact.s, 0);
  }
  if (q0 == q1) {
    EXPECT_EQ(contact.t, 0);
  }
  const Point p = p0 + Real(contact.s) * (p1 - p0), q = q0 + Real(contact.t) * (q1 - q0);
  EXPECT_LE((q - p).norm(), distance + 16 * kEps * extent);
  EXPECT_LE(std::fabs(contact.distance - (distance - reach)), 32 * kEps * (extent + reach));

  const Point normal = toPoint(contact.normal);
  EXPECT_LE(std::fabs(normal.norm() - 1), 4 * kEps);
  // The normal is right if a slab perpendicular to it, as thick as the axes are apart, parts them.
  // Where they meet up to rounding, so does any slab of thickness zero.
  const Real thickness =
      std::min(normal.dot(q0 - p0), normal.dot(q1 - p0)) - std::max(Real(0), normal.dot(p1 - p0));
  const bool meet = distance <= 16 * kEps * coordinates;
  const Real slack = meet ? 32 * kEps * coordinates + 0x1p-40L * extent
                          : 64 * kEps * extent * (1 + std::min(extent / distance, Real(0x1p20L)));
  EXPECT_GE(thickness, distance - slack);

  const Real rounding = 8 * kEps * (coordinates + reach);
  EXPECT_LE((toPoint(contact.point_a) - (p + Real(a.radius) * normal)).norm(), rounding);
  EXPECT_LE((toPoint(contact.point_b) - (q - Real(b.radius) * normal)).norm(), rounding);
}

void expectRightBothWays(const CapsuleShape& a, const CapsuleShape& b) {
  expectRight(a, b, capsuleContact(a, b));
  expectRight(b, a, capsuleContact(b, a));
}

/// Random capsules: near each other or not, of like and unlike lengths, some at a small angle.
std::pair<CapsuleShape, CapsuleShape> anyPair(Random& random, int i) {
  const Eigen::Vector3d p = random.inCube(1), u = random.direction();
  Eigen::Vector3d v = random.direction();
  if (i % 2 == 0) v = u + std::pow(10.0, -random.between(1, 16)) * v;
  if (i % 4 == 0) v = -v;
  const double first = std::pow(10.0, random.between(-4, 0));
  const double second = i % 3 == 0 ? first : std::pow(10.0, random.between(-4, 0));
  const Eigen::Vector3d away = std::pow(10.0, random.between(-18, 0)) * random.direction();
  const Eigen::Vector3d q = i % 5 == 0 ? random.inCube(1) : p + random.unit() * first * u + away;
  const double before = i % 7 == 0 ? 0 : random.unit() * second;
  return {capsule(p, p + first * u, random.unit()),
          capsule(q - before * v, q + (second - before) * v, 0.1 * random.unit())};
}

TEST(CapsuleContact, AgreesWithAnEnumerationInLongDouble) {
  // If this fails, a contact is not where two capsules touch: hairs side by side have contacts
  // whose points are not the closest, as the determinant of Ericson's closed form is rounding noise
  // there, or products are 0 or infinite in very small or large units.
  Random random(1);
  const int powers[] = {0, 0, 0, 0, 0, 0, 0, 0, -960, -600, -200, -60, 60, 200, 600, 990};
  for (int i = 0; i < 40000; ++i) {
    auto [a, b] = anyPair(random, i);
    const int power = powers[random.below(16)];
    for (CapsuleShape* c : {&a, &b}) {
      for (auto* end : {&c->start, &c->end}) {
        for (double& x : *end) x = std::ldexp(x, power);
      }
      c->radius = std::ldexp(c->radius, power);
    }
    expectRightBothWays(a, b);
    if (HasFailure()) FAIL() << "case " << i << ", 2^" << power;
  }
}

TEST(CapsuleContact, HasANormalPerpendicularToAxesThatMeet) {
  // If this fails, capsules whose axes cross have a normal of noise, or none.
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    const auto integers = [&]() -> Eigen::Vector3d {
      return random.inCube(9).array().round() + Eigen::Array3d(0, 0, 0.5);
    };
    const Eigen::Vector3d p = integers(), u = integers(), v = integers();
    const CapsuleShape a = capsule(p - (i % 3) * u, p + u, 0.5);
    for (const CapsuleShape& b :
         {capsule(p - (i % 2) * v, p + v, 0.25),     // crosses, or shares an end
          capsule(p + u, p + 3 * u, 0.25),           // goes on along one line
          a, capsule(p + u, p - (i % 3) * u, 0.25),  // the same
          capsule(p, p, 0.25)}) {                    // a point of it
      const Contact contact = capsuleContact(a, b);
      expectRightBothWays(a, b);
      EXPECT_EQ(contact.distance, -a.radius - b.radius);
      const Point normal = toPoint(contact.normal);
      EXPECT_LE(std::fabs(normal.dot(toPoint(a.end) - toPoint(a.start))), 1e-13L);
      EXPECT_LE(std::fabs(normal.dot(toPoint(b.end) - toPoint(b.start))), 1e-13L);
    }
    if (HasFailure()) FAIL() << "case " << i;
  }
  const CapsuleShape point = capsule({1, 2, 3}, {1, 2, 3}, 0.5);
  expectRightBothWays(point, point);
}

TEST(CapsuleContact, IsAtAnEndThatBothHave) {
  // If this fails, adjacent segments of a fiber meet beside their point, or rounding of a distance
  // of 0 chooses the side of their normal.
  Random random(5);
  const int powers[] = {-960, -200, 0, 0, 0, 0, 30, 990};
  for (int i = 0; i < 20000; ++i) {
    const double size = std::ldexp(1, powers[random.below(8)]);
    CapsuleShape a = capsule(random.inCube(size), random.inCube(size), 0.1 * size);
    CapsuleShape b = capsule(random.inCube(size), random.inCube(size), 0);
    const bool is_end_of_a = i % 2 == 1, is_end_of_b = i % 4 > 1;
    (is_end_of_b ? b.end : b.start) = is_end_of_a ? a.end : a.start;
    const Contact forth = capsuleContact(a, b), back = capsuleContact(b, a);
    EXPECT_EQ(forth.s, is_end_of_a);
    EXPECT_EQ(forth.t, is_end_of_b);
    EXPECT_EQ(forth.distance, -a.radius);
    EXPECT_LE((toPoint(forth.normal) + toPoint(back.normal)).norm(), 1e-9L);
    expectRightBothWays(a, b);
    if (HasFailure()) FAIL() << "case " << i;
  }
  // A choice among many closest points.
  const Eigen::Vector3d p{0.1, 0.7, 0.3}, q{0.4, -0.2, 0.9};
  for (const CapsuleShape& a : {capsule(p, q, 1), capsule(q, p, 1), capsule(p, p, 1)}) {
    for (const CapsuleShape& b : {capsule(p, q, 2), capsule(q, p, 2), capsule(p, p, 2),
                                  capsule(p, p + 0.3 * (q - p), 2), capsule(p + q, p, 2)}) {
      expectRightBothWays(a, b);
    }
  }
}

TEST(CapsuleContact, TurnsTheNormalWithTheOrderOfThePair) {
  // If this fails, the force of a contact depends on which capsule came first.
  Random random(4);
  for (int i = 0; i < 10000; ++i) {
    const auto [a, b] = anyPair(random, 2 * i + 1);  // at any angle
    const Contact forth = capsuleContact(a, b), back = capsuleContact(b, a);
    // Both normals are as right as expectRight() says, which where axes all but meet is not much.
    if (trueAxisDistance(a, b) < 1e-6L) continue;
    EXPECT_LE((toPoint(forth.normal) + toPoint(back.normal)).norm(), 1e-7L) << i;
  }
  const CapsuleShape x = capsule({-1, 0, 0}, {1, 0, 0}, 0.5), y = capsule({0, -1, 0}, {0, 1, 0}, 1);
  EXPECT_EQ(toPoint(capsuleContact(x, y).normal), -toPoint(capsuleContact(y, x).normal));
}

TEST(CapsuleContact, RefusesWhatIsNoCapsule) {
  // If this fails, a NaN or an overflow becomes a contact.
  const CapsuleShape good = capsule({0, 0, 0}, {1, 0, 0}, 0.5);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const CapsuleShape& bad :
       {capsule({nan, 0, 0}, {1, 0, 0}, 1), capsule({0, 0, 0}, {0, 0, 1e308}, 1),
        capsule({0, 0, 0}, {1, 0, 0}, -1), capsule({0, 0, 0}, {1, 0, 0}, nan)}) {
    EXPECT_THROW(capsuleContact(good, bad), std::invalid_argument);
    EXPECT_THROW(capsuleContact(bad, good), std::invalid_argument);
  }
}

CapsuleShape shapeOf(const test::GivenCapsule& c) { return {c.a, c.b, c.radius}; }

/// Fibers of one to six points; one has none.
template <typename S>
Assembly<S> randomArrays(std::uint64_t seed) {
  Random random(seed);
  Assembly<S> arrays;
  for (std::size_t fiber = 0; fiber < 40; ++fiber) {
    Eigen::Vector3d p = random.inCube(0.5);
    for (std::size_t i = fiber == 5 ? 0 : 1 + random.below(6); i > 0; --i) {
      arrays.addPoint(toArray(p), 0.05 * random.unit());
      p += random.inCube(0.3);
    }
    arrays.endFiber();
  }
  return arrays;
}

template <typename S>
class ArrayContacts : public testing::Test {};
TYPED_TEST_SUITE(ArrayContacts, test::Scalars, );

TYPED_TEST(ArrayContacts, AreThoseOfThePairsThatTheTreeFinds) {
  // If this fails, a contact names another capsule, fiber, segment or radius than the pair's.
  using Radii = typename FiberArrays<TypeParam>::Radii;
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = 0;
  for (const Radii radii_are : {Radii::kOne, Radii::kPerFiber, Radii::kPerFirstPoint}) {
    Assembly<TypeParam> fibers = randomArrays<TypeParam>(7), others = randomArrays<TypeParam>(8);
    fibers.radii_are = others.radii_are = radii_are;
    FiberTree tree(options), other(options);
    tree.build(fibers.view());
    other.build(others.view());

    const auto expectRightPlaced = [](const Assembly<TypeParam>& a, const Assembly<TypeParam>& b,
                                      SegmentPair pair, const Contact& contact) {
      EXPECT_EQ(a.point_begin[contact.a.fiber] + contact.a.number, std::size_t(pair.a));
      EXPECT_LT(std::size_t(pair.a) + 1, a.point_begin[contact.a.fiber + 1]);
      EXPECT_EQ(b.point_begin[contact.b.fiber] + contact.b.number, std::size_t(pair.b));
      EXPECT_LT(std::size_t(pair.b) + 1, b.point_begin[contact.b.fiber + 1]);
      expectRight(shapeOf(a.capsule(std::size_t(pair.a))), shapeOf(b.capsule(std::size_t(pair.b))),
                  contact);
      EXPECT_LE(contact.distance, 1e-15);
    };
    std::size_t pairs = 0;
    tree.visit(Pairs{}, [&](SegmentPair pair) {
      expectRightPlaced(fibers, fibers, pair, capsuleContact(fibers.view(), pair));
      ++pairs;
    });
    tree.visit(Pairs{}, other, [&](SegmentPair pair) {
      expectRightPlaced(fibers, others, pair, capsuleContact(fibers.view(), others.view(), pair));
      ++pairs;
    });
    EXPECT_GT(pairs, 50u);
  }
}

TYPED_TEST(ArrayContacts, RefusePairsOfOtherArrays) {
  // If this fails, a pair is looked up beyond the arrays, or across the end of a fiber.
  const Assembly<TypeParam> fibers = randomArrays<TypeParam>(7);
  const auto points = static_cast<std::int32_t>(fibers.pointCount());
  const auto last = static_cast<std::int32_t>(fibers.point_begin[1]) - 1;
  for (const std::int32_t bad : {-1, last, points - 1, points}) {
    try {
      capsuleContact(fibers.view(), {bad, bad});
      ADD_FAILURE() << bad;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("point " + std::to_string(bad)));
    }
  }
}

TYPED_TEST(ArrayContacts, RefuseArraysThatDoNotFitEachOther) {
  // If this fails, point_begin is read beyond its end, or a null array is.
  using Radii = typename FiberArrays<TypeParam>::Radii;
  const std::vector<TypeParam> points(30);
  const std::vector<TypeParam> radii(10);
  const auto refused = [](const FiberArrays<TypeParam>& bad, SegmentPair pair,
                          const std::string& text) {
    const auto refusal = testing::ThrowsMessage<std::invalid_argument>(
        testing::HasSubstr("capsuleContact: " + text));
    EXPECT_THAT([&] { capsuleContact(bad, pair); }, refusal);
    EXPECT_THAT([&] { capsuleContact(bad, bad, pair); }, refusal);
  };
  for (const Radii radii_are : {Radii::kOne, Radii::kPerFiber, Radii::kPerFirstPoint}) {
    const std::vector<std::size_t> all = {0, 10};
    const FiberArrays<TypeParam> good{points.data(), 10, all.data(), 1, radii.data(), radii_are};
    EXPECT_EQ(capsuleContact(good, {0, 8}).b.number, 8u);

    FiberArrays<TypeParam> bad = good;
    for (const auto& begin : std::vector<std::vector<std::size_t>>{{0, 5}, {0, 0}, {0}, {2, 10}}) {
      bad.point_begin = begin.data();
      bad.fiber_count = begin.size() - 1;
      refused(bad, {7, 0}, "point_begin runs from");
    }
    // That the middle descends shows only where it is read.
    const std::vector<std::size_t> descending = {0, 100, 10};
    bad.point_begin = descending.data();
    bad.fiber_count = 2;
    refused(bad, {9, 0}, "point 9 is the last");

    bad = good;
    bad.fiber_count = static_cast<std::size_t>(-1);
    refused(bad, {0, 1}, std::to_string(bad.fiber_count) + " fibers are more than 2^27");
    bad = good;
    bad.points = nullptr;
    refused(bad, {0, 1}, "points are null");
    bad = good;
    bad.radii = nullptr;
    refused(bad, {0, 1}, "radii are null");
    refused({}, {0, 1}, "point_begin is null");
  }
}

}  // namespace
}  // namespace fcl_fibers
