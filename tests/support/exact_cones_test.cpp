// SPDX-License-Identifier: BSD-3-Clause
#include "support/exact_cones.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "support/cone_oracle.h"
#include "support/exact_geometry.h"
#include "support/random.h"
#include "support/touch_oracle.h"

namespace fcl_fibers::test {
namespace {

using Numbers = std::array<double, 3>;

Numbers numbers(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

GivenCapsule cone(const Numbers& a, const Numbers& b, double at_a, double at_b) {
  GivenCapsule cone{a, b, at_a};
  cone.radius_of_second = at_b;
  return cone;
}
GivenCapsule turned(const GivenCapsule& c) { return cone(c.b, c.a, c.radiusAtB(), c.radius); }

/// The lengths by which the errors of a distance are bounded.
double sizeOf(const GivenCapsule& p, const GivenCapsule& q) {
  double size = p.radius + p.radiusAtB() + q.radius + q.radiusAtB();
  for (std::size_t i = 0; i < 3; ++i) {
    size += std::fabs(p.a[i] - q.a[i]) + std::fabs(p.b[i] - p.a[i]) + std::fabs(q.b[i] - q.a[i]);
  }
  return size;
}

/// Needles, balls, cones wider than long, and others.
GivenCapsule randomCone(Random& random) {
  const Eigen::Vector3d a = random.inCube(1);
  const double length = random.below(8) == 0 ? 0 : random.unit();
  const auto radius = [&] {
    return random.below(3) == 0 ? 0 : std::ldexp(random.unit(), -static_cast<int>(random.below(8)));
  };
  const double at_a = radius(), at_b = random.below(6) == 0 ? at_a + length : radius();
  return cone(numbers(a), numbers(a + length * random.direction()), at_a, at_b);
}

/// One in two is parallel to the first, or nearly so, or begins on it.
GivenCapsule partnerOf(Random& random, const GivenCapsule& p) {
  GivenCapsule q = randomCone(random);
  const std::size_t kind = random.below(6);
  if (kind < 2) {
    const double tilt = kind == 0 ? 0 : std::ldexp(1.0, -static_cast<int>(random.below(60)));
    for (std::size_t k = 0; k < 3; ++k) q.b[k] = q.a[k] + (p.b[k] - p.a[k]) + tilt * random.unit();
  } else if (kind == 2) {
    const double s = random.unit();
    for (std::size_t k = 0; k < 3; ++k) q.a[k] = p.a[k] + s * (p.b[k] - p.a[k]);
  }
  return q;
}

Real definition(const GivenCapsule& p, const GivenCapsule& q) {
  const auto segment = [](const GivenCapsule& c) {
    const auto at = [](const Numbers& x) { return geometry::Vec3d{x[0], x[1], x[2]}; };
    return geometry::Segment::cone(at(c.a), at(c.b), c.radius, c.radiusAtB());
  };
  return coneDistance(segment(p), segment(q));
}

// Every test of extremes of cones would be judged by a wrong distance.
TEST(ExactCones, HaveTheDistanceOfTheDefinition) {
  Random random(61);
  for (int i = 0; i < 1000; ++i) {
    const GivenCapsule p = randomCone(random), q = partnerOf(random, p);
    // The radii of a segment carry two roundings.
    const Real distance = definition(p, q), error = 0x1p-51L * sizeOf(p, q);
    for (const GivenCapsule& second : {q, turned(q)}) {
      const ExactCapsule a = roundedCapsule(p), b = roundedCapsule(second);
      ASSERT_LE(std::fabs(surfaceDistance(a, b) - distance), error) << i;
      ASSERT_LE(std::fabs(surfaceDistance(b, a) - distance), error) << i;
      if (!p.isTapered() && !q.isTapered()) continue;
      const auto just = static_cast<double>(distance), doubt = static_cast<double>(2 * error);
      ASSERT_TRUE(TouchOracle::touchExactly(p, second, just + doubt)) << i;
      ASSERT_FALSE(TouchOracle::touchExactly(p, second, just - doubt)) << i;
    }
  }
}

// The filter would decide what only more digits can; at any size, and whatever the angle.
TEST(ExactCones, TheFilterNeverContradictsTheDigits) {
  Random random(62);
  std::size_t filtered = 0, total = 0;
  for (int i = 0; i < 5000; ++i) {
    GivenCapsule p = randomCone(random), q = partnerOf(random, p);
    if (!p.isTapered() && !q.isTapered()) continue;
    const auto distance =
        static_cast<double>(surfaceDistance(roundedCapsule(p), roundedCapsule(q)));
    const double off = std::ldexp(random.unit() - 0.5, -static_cast<int>(i % 66));
    const double scale = std::ldexp(1.0, static_cast<int>(random.below(1900)) - 950);
    const double margin = scale * (distance + sizeOf(p, q) * off);
    for (GivenCapsule* c : {&p, &q}) {
      for (double& x : c->a) x *= scale;
      for (double& x : c->b) x *= scale;
      c->radius *= scale;
      c->radius_of_second *= scale;
    }
    const TouchOracle::Verdict verdict = TouchOracle::judge(p, q, margin);
    ASSERT_EQ(verdict.touching, TouchOracle::touchExactly(p, q, margin)) << i;
    ASSERT_EQ(verdict.touching, TouchOracle::judge(turned(q), p, margin).touching) << i;
    if (margin >= 0) {
      ASSERT_EQ(TouchOracle({p, q}).touch(0, 1, margin), verdict.touching) << i;
    }
    filtered += !verdict.exact;
    ++total;
  }
  EXPECT_GT(filtered, total / 2);
  EXPECT_LT(filtered, total);
}

// Contact would be missed, or a hair's breadth be taken for contact. The axis of the upper cone
// rises by as much as its radius grows, so it touches the plane below along a line.
TEST(ExactCones, ContactIsKnownToTheLastBit) {
  const GivenCapsule upper = cone({-1, 0, -2}, {1, 0.5, 2}, 0.25, 0.75);
  const GivenCapsule partners[] = {
      cone({1, -1, -2}, {-1, -1.5, 2}, 0.75, 1.25), cone({-2, -1, -4}, {1, -1.5, 2}, 0.75, 1.25),
      cone({0, -1, 0}, {0, -1, 0}, 0.75, 0.75), cone({0, -1, 0}, {0, -1.5, 0}, 0.75, 1.25)};
  const auto up = [](double x) { return std::nextafter(x, 2 * x); };
  const auto down = [](double x) { return std::nextafter(x, 0); };
  for (GivenCapsule q : partners) {
    for (const auto& [at, touching] : {std::pair{q.a[1], true}, {up(q.a[1]), false}}) {
      const double moved = at - q.a[1];
      GivenCapsule lower = q;
      lower.a[1] += moved;
      lower.b[1] += moved;
      EXPECT_EQ(TouchOracle::judge(upper, lower, 0).touching, touching);
      EXPECT_EQ(TouchOracle::touchExactly(turned(lower), upper, 0), touching);
    }
    q.radius = down(q.radius);
    q.radius_of_second = down(q.radius_of_second);
    EXPECT_FALSE(TouchOracle::judge(upper, q, 0).touching);
    EXPECT_TRUE(TouchOracle::judge(upper, q, 0x1p-52).touching);
  }
}

}  // namespace
}  // namespace fcl_fibers::test
