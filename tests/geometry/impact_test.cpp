// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/impact.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "geometry/touch.h"
#include "geometry/triangle_distance.h"
#include "support/random.h"
#include "support/scoped_target.h"
#include "support/segments.h"

// Random pairs of all kinds are judged by numerics/impact_decisions_test.cpp.
namespace fcl_fibers::geometry {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// The time of impact, or -1.
double impactTime(const MovingSegment& p, const MovingSegment& q, double margin = 0,
                  double error = 0, double from = 0) {
  Impact impact;
  return findImpact(p, q, margin, error, from, impact) ? impact.time : -1;
}
double approachTime(const MovingSegment& p, const MovingSegment& q, double margin = 0) {
  Impact impact;
  return findApproach(p, q, margin, 0, 0, impact) ? impact.time : -1;
}

MovingSegment moved(const Segment& s, const Vec3d& by) {
  return {s, {s.a + by, s.b + by, s.radius}};
}
MovingSegment resting(const Segment& s) { return {s, s}; }

const Segment kAlongX{{-1, 0, 0}, {1, 0, 0}, 0.25};
/// `height` above it, across it or along it.
Segment across(double height) { return {{0, -1, height}, {0, 1, height}, 0.25}; }
Segment along(double height) { return {{-1, 0, height}, {1, 0, height}, 0.25}; }

// The formula would be that of another problem.
TEST(Impact, TimesThatAreKnown) {
  const MovingSegment rest = resting(kAlongX);
  for (const Segment& s : {across(1.5), along(1.5)}) {
    EXPECT_NEAR(impactTime(rest, moved(s, {0, 0, -2})), 0.5, 1e-10);
    EXPECT_NEAR(impactTime(moved(s, {0, 0, -2}), rest), 0.5, 1e-10);
    EXPECT_NEAR(impactTime(rest, moved(s, {0, 0, -1})), 1, 1e-10) << "at the end";
    EXPECT_EQ(impactTime(rest, moved(s, {0, 0, -0.99})), -1);
    EXPECT_EQ(impactTime(rest, moved(s, {0, 0, 2})), -1);
    EXPECT_NEAR(impactTime(rest, moved(s, {0, 0, -2}), 0.5), 0.25, 1e-10) << "margin";
    EXPECT_NEAR(impactTime(rest, moved(s, {0, 0, -2}), 0, 0.5), 0.25, 1e-10) << "error";
    EXPECT_EQ(impactTime(rest, resting(s)), -1);
    EXPECT_EQ(impactTime(rest, resting(s), 1), 0);
  }
  // Through each other, far beyond within the step.
  EXPECT_NEAR(impactTime(rest, moved(across(1.5), {0, 0, -1000})), 0.001, 1e-10);
  // Radii grow by 0.5 in all.
  MovingSegment grown = resting(across(0.75));
  grown.end.radius = 0.75;
  EXPECT_NEAR(impactTime(rest, grown), 0.5, 1e-10);
  // A rod turns through the vertical onto another: its end is at (1 - 2 t, 0, t).
  const MovingSegment turning{{{0, 0, 0}, {1, 0, 0}, 0}, {{0, 0, 0}, {-1, 0, 1}, 0}};
  EXPECT_NEAR(impactTime(turning, resting({{0.25, -1, 0.25}, {0.25, 1, 0.25}, 0})), 1.0 / 3, 1e-9);
}

// Closest points at the time of impact would be those of another time.
TEST(Impact, ClosestPointsAreThoseAtTheTime) {
  Impact impact;
  const MovingSegment q = moved({{0.5, -1, 1}, {0.5, 3, 1}, 0}, {0, 0, -2});
  ASSERT_TRUE(findImpact(resting(kAlongX), q, 0, 0, 0, impact));
  EXPECT_NEAR(impact.time, 0.375, 1e-10);
  EXPECT_NEAR(impact.s, 0.75, 1e-12);
  EXPECT_NEAR(impact.t, 0.25, 1e-12);
}

// Zero radii leave no direction where axes cross.
TEST(Impact, AxesWithoutThicknessMeet) {
  const Segment x{{-1, 0, 0}, {1, 0, 0}, 0}, y{{0, -1, 1}, {0, 1, 1}, 0};
  EXPECT_NEAR(impactTime(resting(x), moved(y, {0, 0, -2})), 0.5, 1e-10);
  EXPECT_NEAR(impactTime(resting(x), moved({{0, 0, 1}, {0, 0, 1}, 0}, {0, 0, -2})), 0.5, 1e-10);
  const Segment point{{0, 0, 1}, {0, 0, 1}, 0};
  EXPECT_NEAR(impactTime(moved(point, {0, 0, -2}), moved(point, {0, 0, -2})), 0, 0);
  EXPECT_EQ(impactTime(moved(point, {1, 0, 0}), moved({{0, 0, 2}, {0, 0, 2}, 0}, {1, 0, 0})), -1);
}

// A bound on the time would be ignored, or be the answer.
TEST(Impact, SearchBeginsAtAKnownBound) {
  const MovingSegment p = resting(kAlongX), q = moved(across(1.5), {0, 0, -2});
  const double time = impactTime(p, q);
  for (const double from : {0.1, 0.4, 0.49999}) {
    EXPECT_NEAR(impactTime(p, q, 0, 0, from), time, 1e-10);
  }
  EXPECT_EQ(impactTime(p, resting(across(0.4)), 0, 0, 0.3), 0.3) << "within reach at once";
}

// A step would report other pairs at its start than a query of the start does.
TEST(Impact, AtTheStartIsWhatTouches) {
  test::Random random(1);
  int touching = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto point = [&] { return fromEigen(random.inCube(1)); };
    const MovingSegment p{{point(), point(), 0.1}, {point(), point(), 0.2}};
    MovingSegment q{{point(), point(), 0}, {point(), point(), 0.1}};
    const auto gap = static_cast<double>(capsuleDistance(p.start, q.start));
    // Often at contact to the last bit.
    if (i % 2 == 0) q.start.radius = std::max(0.0, gap * (1 + (i % 3 - 1) * 0x1p-52));
    const bool touches = touch(p.start, q.start, 0, 0);
    touching += touches;
    if (touches) {
      ASSERT_EQ(impactTime(p, q), 0);
    } else if (gap - q.start.radius > impactTolerance(p, q)) {
      ASSERT_NE(impactTime(p, q), 0);
    }
  }
  EXPECT_GT(touching, 5000);
}

// Pairs of an overlapping scene would stop each step, or what comes nearer would stop none.
TEST(Impact, OnlyAnApproachCountsIfPairsTouchAtTheStart) {
  const MovingSegment rest = resting(kAlongX);
  EXPECT_EQ(approachTime(rest, resting(across(0.4))), -1);
  EXPECT_EQ(approachTime(rest, moved(across(0.4), {0, 0, 1})), -1) << "it leaves";
  EXPECT_EQ(approachTime(rest, moved(across(0.4), {0.5, 0, 0})), -1) << "it slides";
  EXPECT_EQ(approachTime(moved(kAlongX, {3, 2, 1}), moved(across(0.4), {3, 2, 1})), -1);
  const double time = approachTime(rest, moved(across(0.4), {0, 0, -0.1}));
  EXPECT_GT(time, 0);
  EXPECT_LT(time, 1e-8);
  // From 0.4 in front of the end, away from the axis and back to it: (1.4 - 2 t, 0, 2 t) is at
  // least 0.28 from the end; the distance is less than 0.4 from the first.
  EXPECT_LT(approachTime(rest, moved({{1.4, 0, 0}, {1.4, 0, 0}, 0.25}, {-1, 0, 1})), 1e-8);
  // One end leaves and the other comes near later: they are at 0.4 + t and 1 - t.
  const MovingSegment rocking{{{-1, 0, 0.4}, {1, 0, 1}, 0.25}, {{-1, 0, 1.4}, {1, 0, 0}, 0.25}};
  EXPECT_NEAR(approachTime(rest, rocking), 0.6, 1e-8);
  // It does not touch at the start.
  EXPECT_NEAR(approachTime(rest, moved(across(1.5), {0, 0, -2})), 0.5, 1e-10);
  // The radii grow.
  MovingSegment grown = resting(across(0.4));
  grown.end.radius = 0.5;
  EXPECT_LT(approachTime(rest, grown), 1e-8);
  EXPECT_GT(approachTime(rest, grown), 0);
  // A margin that is much larger hides neither growth nor shrinking.
  for (const double growth : {5e-8, -5e-8}) {
    grown.end.radius = grown.start.radius + growth;
    EXPECT_EQ(approachTime(rest, grown, 1e9) > 0, growth > 0);
  }
  // Axes that cross cannot come nearer.
  EXPECT_EQ(approachTime(rest, moved(across(0), {0, 0, -1})), -1);
}

// Numbers that overflow would lose an impact, or never end.
TEST(Impact, WhatIsNotFiniteTouches) {
  for (const double bad : {kInfinity, -kInfinity, kNaN}) {
    EXPECT_EQ(impactTime(resting({{bad, 0, 0}, {1, 0, 0}, 0}), resting(across(9))), 0);
    EXPECT_EQ(impactTime({kAlongX, {{0, 0, 0}, {0, bad, 0}, 0}}, resting(across(9)), 0, 0, 0.5),
              0.5);
    EXPECT_EQ(approachTime(resting({{bad, 0, 0}, {1, 0, 0}, 0}), resting(across(9))), 0);
  }
  EXPECT_EQ(impactTime(resting(kAlongX), resting(across(9)), kNaN), 0);
  EXPECT_EQ(impactTime(resting(kAlongX), resting(across(9)), kInfinity), 0);
  // Their difference overflows, they do not.
  const Segment far{{1e308, 0, 0}, {1e308, 1e307, 0}, 0};
  EXPECT_NEAR(impactTime(resting({{-1e308, 0, 0}, {-1e308, 1e307, 0}, 0}),
                         {far, {{-1e308, 0, 0}, {-1e308, 1e307, 0}, 0}}),
              1, 1e-9);
}

// --- Boxes ---

// A box that moves would be lost between its positions, or meet what it passes before or after.
TEST(Impact, BoxesMeetAtACommonTime) {
  const MovingSegment box = resting(Segment::box({0, 0, 0}, {1, 1, 1}));
  const auto passing = [](const Vec3d& from, const Vec3d& to) {
    const Vec3d size{1, 1, 1};
    return MovingSegment{Segment::box(from, from + size), Segment::box(to, to + size)};
  };
  EXPECT_NEAR(impactTime(box, passing({3, 0, 0}, {-5, 0, 0})), 0.25, 1e-12);
  EXPECT_NEAR(impactTime(box, passing({3, 3, 2}, {-3, -1, -1})), 0.5, 1e-12) << "in y at last";
  EXPECT_EQ(impactTime(box, passing({3, 0, 0}, {1.5, 0, 0})), -1);
  EXPECT_EQ(impactTime(box, passing({3, 0, 0}, {1, 0, 0})) > 0.999, true) << "at the end";
  EXPECT_EQ(impactTime(box, passing({0, 0, 3}, {0, 3, 0})), -1) << "past an edge";
  EXPECT_EQ(impactTime(box, passing({0.5, 0, 0}, {9, 9, 9})), 0);
  EXPECT_EQ(impactTime(box, passing({0.5, 0, 0}, {9, 9, 9}), 0, 0, 0.9), -1) << "too late";
  EXPECT_NEAR(impactTime(box, passing({3, 0, 0}, {-5, 0, 0}), 1), 0.125, 1e-12) << "margin";
  // A capsule counts by its box.
  EXPECT_NEAR(impactTime(box, moved({{3, 0, 0}, {4, 1, 0}, 0.5}, {-3, 0, 0})), 0.5, 1e-12);
  EXPECT_EQ(impactTime(box, {Segment::box({kNaN, 0, 0}, {1, 1, 1}), box.end}), 0);
}

TEST(Impact, BoxesMayBeUnbounded) {
  const MovingSegment below{
      Segment::box({-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, 0}),
      Segment::box({-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, 1})};
  EXPECT_NEAR(impactTime(below, resting(Segment::box({0, 0, 0.5}, {1, 1, 1}))), 0.5, 1e-12);
  EXPECT_EQ(impactTime(below, resting(Segment::box({0, 0, 1.5}, {1, 1, 2}))), -1);
  EXPECT_EQ(impactTime(below, resting(Segment::box({0, 0, -7}, {1, 1, -6}))), 0);
}

// The first of all times at which boxes overlap would be another.
TEST(Impact, BoxesAgreeWithAnEnumerationOfTimes) {
  test::Random random(2);
  int found = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto whole = [&] { return std::round(random.between(-6, 6)); };
    const auto box = [&] {
      const Vec3d low{whole(), whole(), whole()};
      return Segment::box(low, low + Vec3d{2, 3, 4});
    };
    const MovingSegment p{box(), box()}, q{box(), box()};
    constexpr double Vec3d::*kXyz[] = {&Vec3d::x, &Vec3d::y, &Vec3d::z};
    // They begin to overlap at the start or where two faces meet.
    std::vector<double> times = {0};
    for (const auto axis : kXyz) {
      for (const bool above : {false, true}) {
        const auto gap = [&](const Segment& s, const Segment& t) {
          return above ? s.a.*axis - t.b.*axis : t.a.*axis - s.b.*axis;
        };
        const double from = gap(p.start, q.start), to = gap(p.end, q.end);
        if (from != to) times.push_back(from / (from - to));
      }
    }
    const auto overlap = [&](double time) {
      return std::all_of(std::begin(kXyz), std::end(kXyz), [&](auto axis) {
        const auto at = [&](double x, double y) { return x + time * (y - x); };
        constexpr double kRounding = 1e-12;
        return at(p.start.a.*axis, p.end.a.*axis) <=
                   at(q.start.b.*axis, q.end.b.*axis) + kRounding &&
               at(q.start.a.*axis, q.end.a.*axis) <= at(p.start.b.*axis, p.end.b.*axis) + kRounding;
      });
    };
    double expected = -1;
    std::sort(times.begin(), times.end());
    for (const double time : times) {
      if (expected < 0 && time >= 0 && time <= 1 && overlap(time)) expected = time;
    }
    const double time = impactTime(p, q);
    found += time >= 0;
    ASSERT_NEAR(time, expected, 1e-9) << i;
    ASSERT_LE(time, expected) << "it has to lean outward";
  }
  EXPECT_GT(found, 500);
  EXPECT_LT(found, 1800);
}

bool operator==(const Impact& i, const Impact& j) {
  return i.time == j.time && i.s == j.s && i.t == j.t;
}

// Boxes, what is not finite and what is out of range are found one by one.
TEST(Impact, ManyAreFoundAsOneByOne) {
  test::Random random(5);
  int found = 0, apart = 0;
  for (int i = 0; i < 2000; ++i) {
    ImpactQuery<Segment> queries[kImpactsAtOnce];
    const int count = 1 + static_cast<int>(random.below(kImpactsAtOnce));
    for (int k = 0; k < count; ++k) {
      const double sizes[] = {1, 1, 1, 1e-200, 1e200, kNaN};
      const double size = sizes[random.below(6)];
      const auto segment = [&] {
        const auto point = [&] { return fromEigen(Eigen::Vector3d(size * random.inCube(1))); };
        return Segment{point(), point(), size * 0.05 * random.unit()};
      };
      queries[k] = {{segment(), segment()}, {segment(), segment()}, 0, 0, 0};
      if (random.below(8) == 0) queries[k].p.end = Segment::box({0, 0, 0}, {1, 1, 1});
    }
    Impact impacts[kImpactsAtOnce]{};
    const std::uint32_t bits = findImpacts(queries, count, impacts);
    for (int k = 0; k < count; ++k) {
      const auto& [p, q, margin, error, from] = queries[k];
      Impact impact{};
      const bool expected = findImpact(p, q, margin, error, from, impact);
      ASSERT_EQ(bits >> k & 1u, expected ? 1u : 0u) << i;
      ++(expected ? found : apart);
      if (!expected) continue;
      ASSERT_NEAR(impacts[k].time, impact.time, 1e-7) << i;
    }
    ASSERT_EQ(bits >> count, 0u);
    for (const std::int64_t target : simd::availableTargets()) {
      const simd::ScopedTarget scoped(target);
      Impact again[kImpactsAtOnce]{};
      ASSERT_EQ(findImpacts(queries, count, again), bits) << simd::targetName(target);
      for (int k = 0; k < count; ++k) {
        const bool is_same = (bits >> k & 1u) == 0 || again[k] == impacts[k];
        ASSERT_TRUE(is_same) << simd::targetName(target);
      }
    }
  }
  EXPECT_GT(found, 2000);
  EXPECT_GT(apart, 500);
}

// --- Triangles ---

double impactTime(const MovingSegment& p, const MovingTriangle& q, double margin = 0) {
  TriangleImpact impact;
  return findImpact(p, q, margin, 0, 0, impact) ? impact.time : -1;
}

// An axis without thickness would fall through a triangle.
TEST(TriangleImpact, TimesThatAreKnown) {
  const Triangle triangle{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
  const MovingTriangle rest{triangle, triangle};
  const auto lift = [](const Triangle& t, double z) -> Triangle {
    return {t.a + Vec3d{0, 0, z}, t.b + Vec3d{0, 0, z}, t.c + Vec3d{0, 0, z}};
  };
  const Segment over{{1, 1, 3}, {1, 1, 1}, 0};
  EXPECT_NEAR(impactTime(moved(over, {0, 0, -2}), rest), 0.5, 1e-10);
  EXPECT_NEAR(impactTime(resting(over), {triangle, lift(triangle, 2)}), 0.5, 1e-10);
  EXPECT_NEAR(impactTime(moved(over, {0, 0, -2}), rest, 0.5), 0.25, 1e-10);
  EXPECT_EQ(impactTime(moved(over, {0, 0, 2}), rest), -1);
  // Through an edge from aside, and a flat one onto the inside.
  EXPECT_NEAR(impactTime(moved({{1, -1, 1}, {1, -1, -1}, 0}, {0, 2, 0}), rest), 0.5, 1e-10);
  EXPECT_NEAR(impactTime(moved({{1, 1, 1}, {2, 1, 1}, 0}, {0, 0, -4}), rest), 0.25, 1e-10);
  EXPECT_EQ(impactTime(resting({{1, 1, 1}, {1, 1, -1}, 0}), rest), 0) << "passes through";
  TriangleImpact impact;
  ASSERT_TRUE(findImpact(moved(over, {0, 0, -2}), rest, 0, 0, 0, impact));
  EXPECT_NEAR(impact.s, 1, 1e-12);
  EXPECT_NEAR(impact.weight[0], 0.5, 1e-12);
  EXPECT_NEAR(impact.weight[1], 0.25, 1e-12);
  EXPECT_NEAR(impact.weight[2], 0.25, 1e-12);
  // Touching at the start.
  const Segment thick{{1, 1, 3}, {1, 1, 1}, 1.5};
  EXPECT_FALSE(findApproach(moved(thick, {0, 0, 1}), rest, 0, 0, 0, impact));
  EXPECT_TRUE(findApproach(moved(thick, {0, 0, -1}), rest, 0, 0, 0, impact));
}

TEST(TriangleImpact, AtTheStartIsWhatTouches) {
  test::Random random(3);
  int touching = 0;
  for (int i = 0; i < 5000; ++i) {
    const auto point = [&] { return fromEigen(random.inCube(1)); };
    const MovingTriangle q{{point(), point(), point()}, {point(), point(), point()}};
    MovingSegment p{{point(), point(), 0}, {point(), point(), 0}};
    if (i % 2 == 0) p.start.radius = norm(closestPoints(p.start, q.start).apart);
    if (!touch(p.start, q.start, 0, 0)) continue;
    ++touching;
    ASSERT_EQ(impactTime(p, q), 0);
  }
  EXPECT_GT(touching, 2000);
}

TEST(TriangleImpact, WhatIsNotFiniteTouches) {
  const Triangle triangle{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, bad{{0, 0, kNaN}, {4, 0, 0}, {0, 4, 0}};
  EXPECT_EQ(impactTime(resting(across(9)), MovingTriangle{triangle, bad}), 0);
  EXPECT_EQ(impactTime(resting({{0, 0, kInfinity}, {0, 0, 0}, 0}), {triangle, triangle}), 0);
}

}  // namespace
}  // namespace fcl_fibers::geometry
