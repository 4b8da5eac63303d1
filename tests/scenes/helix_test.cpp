// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/helix.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "scene_support.h"

namespace fcl_fibers::scenes {
namespace {

// The point before both turns of the given frame: the helix axis is along z.
Point untwisted(const Point& p, int frame) {
  const double about_x = kPi / 4 + 0.01 * frame;
  const double y = std::cos(about_x) * p[1] + std::sin(about_x) * p[2];
  const double z = std::cos(about_x) * p[2] - std::sin(about_x) * p[1];
  const double about_y = kPi / 4;
  return {std::cos(about_y) * p[0] - std::sin(about_y) * z, y,
          std::sin(about_y) * p[0] + std::cos(about_y) * z};
}

// What a helix shows of itself in its first three points.
struct SeenHelix {
  Point root;
  double radius, angular_rate, phase, rise;
};

SeenHelix seeHelix(const FiberPolylines& scene, std::size_t fiber, int segments, int frame) {
  const Point* points = &scene.points[scene.point_begin[fiber]];
  const Point p = untwisted(points[0], frame);
  const Point q = untwisted(points[1], frame);
  const Point r = untwisted(points[2], frame);
  const double ds = 30.0 / segments;
  const double first = std::atan2(q[1] - p[1], q[0] - p[0]);
  const double second = std::atan2(r[1] - q[1], r[0] - q[0]);
  const double angle = std::remainder(second - first, 2 * kPi);
  SeenHelix helix;
  helix.root = p;
  helix.angular_rate = angle / ds;
  helix.radius = std::hypot(q[0] - p[0], q[1] - p[1]) / (2 * std::sin(angle / 2));
  helix.phase = std::remainder(first - angle / 2 - kPi / 2, 2 * kPi);
  helix.rise = (q[2] - p[2]) / ds;
  return helix;
}

std::vector<SeenHelix> seeHelices(const FiberPolylines& scene, int segments, int frame = 0) {
  std::vector<SeenHelix> helices;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    helices.push_back(seeHelix(scene, f, segments, frame));
  }
  return helices;
}

void expectDeviates(const std::vector<double>& numbers, double mean, double deviation) {
  const double n = static_cast<double>(numbers.size());
  double sum = 0, squares = 0;
  for (const double x : numbers) {
    sum += x - mean;
    squares += (x - mean) * (x - mean);
  }
  EXPECT_NEAR(sum / n, 0, 5 * deviation / std::sqrt(n));
  EXPECT_NEAR(squares / n, deviation * deviation, 5 * deviation * deviation * std::sqrt(2 / n));
}

TEST(Helix, RootsFillTheirEllipseUniformly) {
  // If this fails, fibers are denser or sparser somewhere than 325 a square centimetre.
  const int fibers = 20000;
  const FiberPolylines scene = makeHelix(parametersOf<HelixParameters>(fibers, 2));
  const double area = fibers / 325.0;
  const double minor = std::sqrt(area / (1.5 * kPi));
  const double major = 1.5 * minor;
  std::vector<double> shares, directions;
  for (const SeenHelix& helix : seeHelices(scene, 2)) {
    const double x = helix.root[0] / major;
    const double y = helix.root[1] / minor;
    EXPECT_NEAR(helix.root[2], 0, 1e-12);
    shares.push_back(x * x + y * y);
    directions.push_back(std::atan2(y, x));
  }
  expectUniform(shares, directions);
}

TEST(Helix, HelicesVaryAsDescribed) {
  // If this fails, turns, radius or phase are not those of the closed form.
  const int segments = 100;
  const FiberPolylines scene = makeHelix(parametersOf<HelixParameters>(4000, segments));
  std::vector<double> turns, radii, phases;
  for (const SeenHelix& helix : seeHelices(scene, segments)) {
    turns.push_back(helix.angular_rate * 30 / (2 * kPi));
    radii.push_back(helix.radius);
    phases.push_back(helix.phase);
  }
  expectDeviates(turns, 4, 0.08);
  expectDeviates(radii, 1, 0.02);
  expectDeviates(phases, 0, 0.02);
}

TEST(Helix, EveryPointIsOnItsHelix) {
  // If this fails, the fibers are no helices parametrised by arc length.
  const int segments = 60;
  auto parameters = parametersOf<HelixParameters>(50, segments);
  for (parameters.frame = 0; parameters.frame < 3; ++parameters.frame) {
    const FiberPolylines scene = makeHelix(parameters);
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      const SeenHelix helix = seeHelix(scene, f, segments, parameters.frame);
      const double slope = helix.radius * helix.angular_rate;
      EXPECT_NEAR(helix.rise, std::sqrt(1 - slope * slope), 1e-9);
      for (int i = 0; i <= segments; ++i) {
        const double s = 30.0 * i / segments;
        const double angle = helix.angular_rate * s + helix.phase;
        const Point expected = {
            helix.root[0] + helix.radius * (std::cos(angle) - std::cos(helix.phase)),
            helix.root[1] + helix.radius * (std::sin(angle) - std::sin(helix.phase)),
            helix.rise * s};
        const Point& point = scene.points[scene.point_begin[f] + static_cast<std::size_t>(i)];
        ASSERT_LE(distance(untwisted(point, parameters.frame), expected), 1e-9) << "fiber " << f;
      }
    }
  }
}

TEST(Helix, WideHelicesAreNarrowedSoThatTheyRise) {
  // If this fails, helices of unlucky seeds are flat or NaN.
  auto parameters = parametersOf<HelixParameters>(26, 100);
  parameters.seed = 20970;  // Fiber 25 draws turns and radius with R w = 0.9617.
  const SeenHelix helix = seeHelix(makeHelix(parameters), 25, 100, 0);
  EXPECT_NEAR(helix.radius * helix.angular_rate, 0.95, 1e-9);
  EXPECT_NEAR(helix.rise, std::sqrt(1 - 0.95 * 0.95), 1e-9);
}

TEST(Helix, MoreFibersKeepTheHelicesOfTheFirst) {
  // If this fails, the random numbers of a fiber depend on the fibers after it.
  const std::vector<SeenHelix> few =
      seeHelices(makeHelix(parametersOf<HelixParameters>(9, 50)), 50);
  const std::vector<SeenHelix> many =
      seeHelices(makeHelix(parametersOf<HelixParameters>(36, 50)), 50);
  for (std::size_t f = 0; f < few.size(); ++f) {
    EXPECT_NEAR(many[f].radius, few[f].radius, 1e-9);
    EXPECT_NEAR(many[f].angular_rate, few[f].angular_rate, 1e-9);
    EXPECT_NEAR(many[f].phase, few[f].phase, 1e-9);
    // Four times the area, twice the axes.
    EXPECT_NEAR(many[f].root[0], 2 * few[f].root[0], 1e-9);
    EXPECT_NEAR(many[f].root[1], 2 * few[f].root[1], 1e-9);
  }
}

TEST(Helix, FramesTurnPhaseAndHelixAndNothingElse) {
  // If this fails, the motion is not the one that updates are measured with.
  const int segments = 50;
  auto parameters = parametersOf<HelixParameters>(40, segments);
  const FiberPolylines still = makeHelix(parameters);
  const std::vector<SeenHelix> before = seeHelices(still, segments);
  for (const int frame : {-3, 1, 10}) {
    parameters.frame = frame;
    const FiberPolylines moved = makeHelix(parameters);
    ASSERT_EQ(moved.point_begin, still.point_begin);
    const std::vector<SeenHelix> after = seeHelices(moved, segments, frame);
    for (std::size_t f = 0; f < still.fiberCount(); ++f) {
      EXPECT_LE(distance(after[f].root, before[f].root), 1e-12);
      EXPECT_NEAR(after[f].radius, before[f].radius, 1e-9);
      EXPECT_NEAR(after[f].angular_rate, before[f].angular_rate, 1e-9);
      EXPECT_NEAR(after[f].phase, before[f].phase + 0.01 * frame, 1e-9);
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::scenes
