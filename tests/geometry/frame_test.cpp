// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/frame.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/random.h"
#include "support/segments.h"

namespace fcl_fibers::geometry {
namespace {

using test::Point;
using test::Random;
using test::Real;

constexpr double kEps = std::numeric_limits<double>::epsilon();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

Frame randomFrame(Random& random) {
  const double size = std::pow(10.0, random.between(-4, 6));
  return {size * fromEigen(random.inCube(1)),
          std::ldexp(1.0, static_cast<int>(random.below(41)) - 20)};
}

/// Through the world, in long double.
Point moved(const Point& p, const Frame& from, const Frame& to) {
  return Real(to.scale) * (toPoint(from.origin) - toPoint(to.origin)) +
         Real(to.scale) / Real(from.scale) * p;
}

/// Two frames, and the size that things have in the first. Every third time the second frame's
/// origin lies among those things, so that coordinates cancel.
struct Change {
  Frame from, to;
  double size;
};
Change randomChange(Random& random, int i) {
  Change change{randomFrame(random), randomFrame(random), std::pow(10.0, random.between(-3, 3))};
  if (i % 3 == 0) {
    const Vec3d p = change.size * fromEigen(random.inCube(1));
    change.to.origin = change.from.origin + (1 / change.from.scale) * p;
  }
  return change;
}

TEST(Frame, FromWorldIsTheDifferenceScaled) {
  // If this fails, end points carry more than the one rounding that bounds allow for.
  const Frame frame{{10, 20, 30}, 0.25};
  const Vec3d q = frame.fromWorld(Vec3d{14, 12, 30});
  EXPECT_EQ(q.x, 1);
  EXPECT_EQ(q.y, -2);
  EXPECT_EQ(q.z, 0);
  const Vec3d same = Frame{}.fromWorld(Vec3d{1.5, -2.5, 1e300});
  EXPECT_EQ(same.x, 1.5);
  EXPECT_EQ(same.y, -2.5);
  EXPECT_EQ(same.z, 1e300);
  Random random(1);
  for (int i = 0; i < 20000; ++i) {
    const Frame any = randomFrame(random);
    const Vec3d p = std::pow(10.0, random.between(-4, 6)) * fromEigen(random.inCube(1));
    const Point exact = Real(any.scale) * (toPoint(p) - toPoint(any.origin));
    const Point got = toPoint(any.fromWorld(p));
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_LE(std::fabs(got[axis] - exact[axis]), 0.51L * Real(kEps) * std::fabs(exact[axis]));
    }
  }
}

TEST(Frame, DoesNotDependOnWhichOfEqualSegmentsIsTheMedian) {
  // If this fails, trees put -0 and 0 in another order with another standard library.
  const auto point = [](double x) { return Segment{{x, x, x}, {x, x, x}, 1}; };
  for (const double first : {0.0, -0.0}) {
    Segment samples[] = {point(first), point(-first), point(first)};
    const Frame frame = frameFor(samples, 3);
    for (const auto axis : kAxes) EXPECT_FALSE(std::signbit(frame.origin.*axis));
  }
}

TEST(Vec3, SafeNormIsTheNormAtAnyScale) {
  // If this fails, a mesh is bounded too tightly that is far larger or smaller than the fibers.
  for (const double scale : {1.0, 1e-320, 0x1p-1060, 1e300}) {
    EXPECT_NEAR(safeNorm({2 * scale, -3 * scale, 6 * scale}) / scale, 7,
                scale < 1e-300 ? 0.01 : 1e-14);
  }
  EXPECT_EQ(safeNorm({0, -0.0, 0}), 0);
  EXPECT_EQ(safeNorm({1, -std::numeric_limits<double>::infinity(), 2}), kInfinity);
}

TEST(FrameChange, ScaleIsLengthsOfTheSecondFramePerLengthOfTheFirst) {
  // If this fails, distances of two managers' scenes are compared in different units.
  EXPECT_EQ(FrameChange({{}, 4}, {{}, 0.5}).scale(), 0.125);
  EXPECT_EQ(FrameChange({{1, 2, 3}, 0.5}, {{4, 5, 6}, 4}).scale(), 8);
  EXPECT_EQ(SameFrame{}.scale(), 1);
}

TEST(FrameChange, MovesSegmentsWithinItsError) {
  // If this fails, pairs of two managers are judged at places that the stated error does not cover.
  Random random(2);
  for (int i = 0; i < 100000; ++i) {
    const Change c = randomChange(random, i);
    const FrameChange change(c.from, c.to);
    const Vec3d a = c.size * fromEigen(random.inCube(1));
    Segment segment{a, a + c.size * fromEigen(random.inCube(1)), c.size * random.unit()};
    if (i % 10 == 0) segment.radius = -1 - random.unit();  // a box, whose number stays
    const Segment result = change(segment);
    const Real error = change.error(result);
    ASSERT_LE((toPoint(result.a) - moved(toPoint(segment.a), c.from, c.to)).norm(), error) << i;
    ASSERT_LE((toPoint(result.b) - moved(toPoint(segment.b), c.from, c.to)).norm(), error) << i;
    ASSERT_EQ(result.radius, segment.radius * (segment.isBox() ? 1 : change.scale())) << i;
    ASSERT_EQ(result.isBox(), segment.isBox()) << i;
    ASSERT_LE(error,
              64 * kEps *
                  (maxNorm(result.a) + maxNorm(result.b) + maxNorm(c.to.fromWorld(c.from.origin))))
        << i;
  }
}

TEST(FrameChange, TheErrorCoversWhatTheShiftLoses) {
  // If this fails, a segment that lands near the origin of a far frame is taken for exact.
  const Frame from{{0x1p53 + 2, 0, 0}, 1}, to{{-1, 0, 0}, 1};
  const FrameChange change(from, to);
  const Segment segment{{-0x1p53, 0, 0}, {-0x1p53, 0, 0}, 0};
  const Segment result = change(segment);  // 3, or 4 where the shift has been rounded up
  EXPECT_GE(change.error(result), std::fabs(result.a.x - 3));
  EXPECT_NE(result.a.x, 3) << "the shift is representable after all, this test tests nothing";
}

double randomGrowth(Random& random, double size) {
  const double magnitude = size * std::pow(10.0, -random.between(0, 10));
  return random.below(3) == 0 ? 0 : random.below(2) == 0 ? magnitude : -magnitude;
}

TEST(FrameChange, BoxesContainTheExactlyMovedBox) {
  // If this fails, pairs of two managers are missed.
  Random random(3);
  for (int i = 0; i < 100000; ++i) {
    const Change c = randomChange(random, i);
    const double growth = randomGrowth(random, c.size * c.to.scale / c.from.scale);
    const FrameChange change(c.from, c.to, growth);
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] = static_cast<float>(c.size * random.between(-1, 1));
      box.high[axis] = box.low[axis] + static_cast<float>(c.size * random.unit());
    }
    const Box result = change(box);
    const Point low = moved(Point(box.low[0], box.low[1], box.low[2]), c.from, c.to);
    const Point high = moved(Point(box.high[0], box.high[1], box.high[2]), c.from, c.to);
    const Vec3d shift = c.to.fromWorld(c.from.origin);
    for (int axis = 0; axis < 3; ++axis) {
      const Real exact_low = low[axis] - Real(growth), exact_high = high[axis] + Real(growth);
      ASSERT_LE(Real(result.low[axis]), exact_low) << i;
      ASSERT_GE(Real(result.high[axis]), exact_high) << i;
      // And not by much.
      const Real slack = 1e-14L * Real(maxNorm(shift)) + 1e-37L;
      ASSERT_GE(Real(result.low[axis]), exact_low - slack - 3e-7L * std::fabs(exact_low)) << i;
      ASSERT_LE(Real(result.high[axis]), exact_high + slack + 3e-7L * std::fabs(exact_high)) << i;
    }
  }
}

TEST(FrameChange, SpheresContainTheExactlyMovedSphere) {
  // If this fails, pairs of two managers are missed.
  Random random(4);
  for (int i = 0; i < 100000; ++i) {
    const Change c = randomChange(random, i);
    const double growth = randomGrowth(random, c.size * c.to.scale / c.from.scale);
    const FrameChange change(c.from, c.to, growth);
    Sphere sphere;
    for (float& x : sphere.center) x = static_cast<float>(c.size * random.between(-1, 1));
    sphere.radius = static_cast<float>(c.size * random.unit());
    const Sphere result = change(sphere);
    const Point center = moved(centerOf(sphere), c.from, c.to);
    const Real radius = Real(change.scale()) * Real(sphere.radius) + Real(growth);
    // A negative radius is as good, because that of a pair's other sphere is added.
    ASSERT_LE((center - centerOf(result)).norm() + radius, Real(result.radius)) << i;
    const Vec3d shift = c.to.fromWorld(c.from.origin);
    const Real size = center.cwiseAbs().maxCoeff() + std::fabs(radius);
    ASSERT_LE(Real(result.radius), radius + 5e-7L * size + 1e-13L * Real(maxNorm(shift)) + 1e-37L)
        << i;
  }
}

TEST(FrameChange, VolumesCoverWhatTheShiftLoses) {
  // If this fails, a volume that lands near the origin of a far frame is off by what the shift has
  // been rounded by, which float's own rounding does not cover there.
  const Frame to{{-1, -1, -1}, 1};
  for (const double x : {0x1p53 + 2, -0x1p53 + 2}) {
    const Frame from{{x, x, x}, 1};  // the shift is x + 1, which no double is
    const FrameChange change(from, to);
    const auto back = static_cast<float>(-x);
    const Real exact = Real(x) + 1 + Real(back);
    const Box box = change(Box{{back, back, back}, {back, back, back}});
    const Sphere sphere = change(Sphere{{back, back, back}, 0});
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_LE(Real(box.low[axis]), exact);
      EXPECT_GE(Real(box.high[axis]), exact);
    }
    EXPECT_LE((Point(exact, exact, exact) - centerOf(sphere)).norm(), Real(sphere.radius));
  }
}

TEST(FrameChange, UnboundedVolumesStayUnbounded) {
  // If this fails, a volume out of float's range shrinks on its way into another frame.
  const FrameChange change({{1, 2, 3}, 4}, {{-5, 0, 1}, 0.25}, -0.5);
  const Box box = change(Box{{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, 1}});
  EXPECT_EQ(box.low[0], -kInfinity);
  EXPECT_EQ(box.high[1], kInfinity);
  EXPECT_LT(box.high[2], 1);
  EXPECT_EQ(change(Sphere{{1, 1, 1}, kInfinity}).radius, kInfinity);
}

TEST(FrameChange, VolumesOutOfRangeBecomeUnbounded) {
  // If this fails, infinity minus infinity takes a far larger scene for apart from a tiny one.
  const Frame tiny{{0, 0, 0}, 0x1p1000}, huge{{0x1p1000, -0x1p1000, 1}, 0x1p-900};
  const FrameChange to_tiny(huge, tiny), to_huge(tiny, huge);
  EXPECT_TRUE(std::isfinite(to_tiny.scale()));
  const Box box = to_tiny(Box{{-0x1p100f, 0, -1}, {0x1p100f, 0x1p100f, 1}});
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(box.low[axis], -kInfinity) << axis;
    EXPECT_EQ(box.high[axis], kInfinity) << axis;
  }
  const Sphere sphere = to_tiny(Sphere{{-0x1p100f, 0x1p100f, 0}, 1});
  EXPECT_EQ(sphere.radius, kInfinity);
  EXPECT_TRUE(std::isfinite(sphere.center[0]));
  const Box point = to_huge(Box{{1, 1, 1}, {1, 1, 1}});
  EXPECT_LE(point.low[0], -0x1p100f);
  EXPECT_GE(point.high[0], -0x1p100f);
  EXPECT_LT(point.high[0], -0x1p99f);
}

TEST(SameFrame, ChangesNothing) {
  // If this fails, a self-query is one between two frames.
  const Box box{{1, 2, 3}, {4, 5, 6}};
  EXPECT_EQ(&SameFrame{}(box), &box);
}

}  // namespace
}  // namespace fcl_fibers::geometry
