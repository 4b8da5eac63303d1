// SPDX-License-Identifier: BSD-3-Clause
#include "judge/exact_contact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>

#include "support/touch_oracle.h"

namespace fcl_fibers::benchmarks {
namespace {

using fcl::Vector3d;
using test::GivenCapsule;
using test::TouchOracle;

GivenCapsule given(const PosedCapsule& c) {
  const auto array = [](const Vector3d& x) -> std::array<double, 3> {
    return {x.x(), x.y(), x.z()};
  };
  return {array(c.centre), array(c.centre), c.radius, c.length, array(c.axis)};
}

/// Along x about the origin, and along y above it.
PosedCapsule first() { return {{0, 0, 0}, {1, 0, 0}, 4, 0.5}; }
PosedCapsule crossing() { return {{0.5, 0, 0.75}, {0, 1, 0}, 2, 0.5}; }

ExactContact exactly(const PosedCapsule& a, const PosedCapsule& b) {
  const std::optional<ExactContact> exact = ExactContact::of(a, b);
  EXPECT_TRUE(exact.has_value());
  return exact.value();
}

/// If this failed, the table of narrow phases would blame or praise them for the judge's errors.
TEST(ExactContact, TouchesWhereIntegersSaySo) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto direction = [&] {
    return Vector3d(normal(random), normal(random), normal(random)).normalized();
  };
  int touching = 0, left_out = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3d u = direction(), across = u.cross(direction()).normalized();
    // Parallel, nearly parallel, and at any angle; near contact down to its last bits.
    const double angle = i % 3 == 0 ? 0 : i % 3 == 1 ? std::pow(10, -12 * uniform(random)) : 1;
    const double excess = std::pow(10, -16 * uniform(random)) * (i % 2 == 0 ? 1 : -1);
    const Vector3d v = (u + angle * across.cross(u)).normalized();
    const PosedCapsule a{direction(), u, 2 * uniform(random), uniform(random)};
    const double radius = uniform(random);
    const PosedCapsule b{
        a.centre + (a.radius + radius) * (1 + excess) * across + uniform(random) * a.length * u, v,
        2 * uniform(random), radius};
    const bool truth = TouchOracle::touchExactly(given(a), given(b), 0);
    const std::optional<ExactContact> exact = ExactContact::of(a, b);
    ASSERT_EQ(exact && exact->touching(), truth) << i;
    touching += truth ? 1 : 0;
    left_out += exact ? 0 : 1;
  }
  EXPECT_GT(touching, 5000);
  EXPECT_LT(touching, 15000);
  EXPECT_GT(left_out, 100);
}

/// If this failed, depths, normals and points would be measured from a wrong place.
TEST(ExactContact, IsThatOfTwoAxesThatCross) {
  const ExactContact exact = exactly(first(), crossing());
  EXPECT_TRUE(exact.touching());
  EXPECT_EQ(exact.axisDistance(), Exact(0.75));
  EXPECT_EQ(exact.distance(), Exact(-0.25));
  EXPECT_EQ(exact.angleTo({0, 0, 1}), 0);
  EXPECT_NEAR(static_cast<double>(exact.angleTo({0, 1, 1})), std::atan(1), 1e-15);
  EXPECT_NEAR(static_cast<double>(exact.angleTo({0, 0, -1})), std::acos(-1), 1e-15);
  // Where many places count as nearest up to rounding, they are within a millionth.
  EXPECT_NEAR(static_cast<double>(exact.distanceTo({0.5, 0, 0.375})), 0, 1e-15);
  EXPECT_NEAR(static_cast<double>(exact.distanceTo({0.5, 0, 0.5})), 0.125, 1e-12);
  EXPECT_NEAR(static_cast<double>(exact.distanceTo({0.75, 0, 0.375})), 0.25, 1e-6);
}

/// If this failed, a normal would be right that leads nowhere.
TEST(ExactContact, KnowsTheWayUntilBothAreApart) {
  const ExactContact exact = exactly(first(), crossing());
  EXPECT_EQ(exact.wayBeyond({0, 0, 1}), 0);
  // Upside down b has to pass through a: by 1.75 in place of 0.25.
  EXPECT_EQ(exact.wayBeyond({0, 0, -1}), Exact(1.5));
  // Along the axis of a to its end, which is 1.5 away.
  EXPECT_EQ(exact.wayBeyond({1, 0, 0}), Exact(1.5 + 0.75));
}

/// If this failed, a solver would be blamed for its choice among right answers.
TEST(ExactContact, OfParallelCapsulesHasManyPoints) {
  PosedCapsule beside = first();
  beside.centre = {3, 0, 0.75};
  for (const double sense : {1.0, -1.0}) {
    beside.axis = {sense, 0, 0};
    const ExactContact exact = exactly(first(), beside);
    EXPECT_EQ(exact.distance(), Exact(-0.25));
    for (const double x : {1.0, 1.3, 2.0}) {  // where both axes are
      EXPECT_NEAR(static_cast<double>(exact.distanceTo({x, 0, 0.375})), 0, 1e-15);
    }
    EXPECT_NEAR(static_cast<double>(exact.distanceTo({2.5, 0, 0.375})), 0.5, 1e-6);
    EXPECT_NEAR(static_cast<double>(exact.distanceTo({0, 0, 0.375})), 1, 1e-6);
  }
}

/// If this failed, the thicker of two capsules would have its contact in a wrong place.
TEST(ExactContact, LiesNearerToTheSurfaceOfTheThicker) {
  PosedCapsule thick = first();
  thick.radius = 1;
  const ExactContact exact = exactly(thick, crossing());
  EXPECT_EQ(exact.distance(), Exact(-0.75));  // from z = 0.25 to z = 1
  EXPECT_NEAR(static_cast<double>(exact.distanceTo({0.5, 0, 0.625})), 0, 1e-15);
  // On one axis, to any side: from z = 1 to z = -0.5 along z.
  PosedCapsule inside = first();
  inside.length = 2;
  const ExactContact nested = exactly(thick, inside);
  EXPECT_EQ(nested.distance(), Exact(-1.5));
  for (const Vector3d& point : {Vector3d(0.5, 0, 0.25), Vector3d(-1, -0.25, 0)}) {
    EXPECT_NEAR(static_cast<double>(nested.distanceTo(point)), 0, 1e-15);
  }
  EXPECT_NEAR(static_cast<double>(nested.distanceTo({0, 0, 0})), 0.25, 1e-15);
}

/// If this failed, capsules far from the origin would be judged by the rounding of their places.
TEST(ExactContact, LosesNothingFarFromTheOrigin) {
  PosedCapsule a = first(), b = crossing();
  for (PosedCapsule* const c : {&a, &b}) c->centre += Vector3d::Constant(0x1p40);
  const ExactContact exact = exactly(a, b);
  EXPECT_EQ(exact.distance(), Exact(-0.25));
  EXPECT_EQ(exact.angleTo({0, 0, 1}), 0);
}

/// If this failed, spheres would be judged as something else.
TEST(ExactContact, TakesCapsulesWithoutLength) {
  const PosedCapsule a{{0, 0, 0}, {0, 0, 1}, 0, 1}, b{{0, 1.5, 0}, {1, 0, 0}, 0, 1};
  const ExactContact exact = exactly(a, b);
  EXPECT_EQ(exact.distance(), Exact(-0.5));
  EXPECT_EQ(exact.angleTo({0, 1, 0}), 0);
  EXPECT_EQ(exact.distanceTo({0, 0.75, 0.25}), Exact(0.25));
}

}  // namespace
}  // namespace fcl_fibers::benchmarks
