// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/polytope_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "geometry/obstacle_impact.h"
#include "geometry/polytope_vertices.h"
#include "support/exact_box.h"
#include "support/polytope_oracle.h"
#include "support/random.h"
#include "support/scoped_target.h"
#include "support/segments.h"

namespace fcl_fibers::geometry {
namespace {

using test::Exact;
using test::exact;
using test::Integer;
using test::Random;
using test::Rational;
using test::rootOf;
using test::sum;
using test::Whole;

constexpr double kEps = std::numeric_limits<double>::epsilon();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Obstacle makePolytope(const std::vector<double>& coordinates) {
  Obstacle polytope;
  polytope.kind = Obstacle::Kind::kPolytope;
  for (int i = 0; i < 3; ++i) polytope.vector[i].*kAxes[i] = 1;
  polytope.vertices = std::make_shared<PolytopeVertices>(
      PointsOfProgram{coordinates.data(), nullptr, coordinates.size() / 3});
  return polytope;
}

/// Of the polytope as it is in memory, all of whose numbers count as exact.
Rational exactSquared(const Segment& s, const Obstacle& polytope) {
  const PolytopeVertices& vertices = *polytope.vertices;
  std::vector<Exact> differences;
  for (std::size_t i = 0; i < vertices.count(); ++i) {
    const Exact p = exact<Rational>(vertices[i]);
    Exact posed = exact<Rational>(polytope.point);
    for (std::size_t k = 0; k < 3; ++k) {
      posed = sum(posed, p[k], exact<Rational>(polytope.vector[k]));
    }
    for (const Vec3d& end : {s.a, s.b}) {
      differences.push_back(sum(exact<Rational>(end), Rational(-1), posed));
    }
  }
  Integer units = 1;
  for (const Exact& p : differences) {
    // Denominators are powers of two.
    for (const Rational& x : p) units = std::max(units, Integer(denominator(x)));
  }
  std::vector<Whole> points;
  for (const Exact& p : differences) {
    points.push_back({numerator(Rational(p[0] * units)), numerator(Rational(p[1] * units)),
                      numerator(Rational(p[2] * units))});
  }
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  const auto found = test::squaredDistanceToHull(points);
  return Rational(found.above, Integer(found.below * units * units));
}

/// Compares answers at the distance, one ulp from it, and as far beyond it as rounding may reach.
void expectExactDecisions(Segment s, const Obstacle& polytope) {
  const Rational squared = exactSquared(s, polytope);
  // The search goes to double-double, so what it leaves open is far less than an ulp of the size.
  const double distance = rootOf(squared), slack = kEps * sizeOfPair(s, polytope);
  for (const double reach :
       {distance, std::nextafter(distance, kInfinity), std::nextafter(distance, 0.0),
        distance - slack, distance - 2 * slack, distance / 2, 2 * distance, 0.0}) {
    if (reach < 0) continue;
    s.radius = reach;
    const bool answer = touch(s, polytope, 0, 0);
    if (Rational(reach) * Rational(reach) >= squared) {
      ASSERT_TRUE(answer) << distance << ", reach " << reach;
    }
    const Rational most = Rational(reach) + Rational(slack) + Rational(4 * kEps * reach) +
                          Rational(16 * std::numeric_limits<double>::min());
    if (most * most < squared) {
      ASSERT_FALSE(answer) << distance << ", reach " << reach;
    }
  }
}

/// Up to six points: anywhere, in a plane, on a line, in one place, or some of them twice.
std::vector<double> randomPoints(Random& random) {
  const std::size_t count = 1 + random.below(6);
  const std::size_t shape = random.below(5);
  Vec3d ways[3];
  for (Vec3d& way : ways) way = fromEigen(random.direction());
  if (shape == 4) ways[2] = std::pow(10.0, -random.between(1, 17)) * ways[2];
  std::vector<double> points;
  const Vec3d middle = random.below(3) == 0 ? 100.0 * ways[1] : Vec3d{0, 0, 0};
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0 && random.below(6) == 0) {
      points.insert(points.end(), points.begin(), points.begin() + 3);
      continue;
    }
    Vec3d p = middle;
    for (std::size_t k = 0; k < (shape == 0 ? 1 : shape == 1 ? 2 : 3); ++k) {
      p = p + random.between(-1, 1) * ways[k];
    }
    points.insert(points.end(), {p.x, p.y, p.z});
  }
  return points;
}

/// In a pose that may have drifted.
Obstacle randomPolytope(Random& random) {
  Obstacle polytope = makePolytope(randomPoints(random));
  polytope.point = fromEigen(random.inCube(1));
  const Eigen::Matrix3d turn = random.rotation().toRotationMatrix();
  const double skew = random.below(2) == 0 ? 0 : 1e-3;
  for (int i = 0; i < 3; ++i) {
    polytope.vector[i] = fromEigen(turn.col(i) + skew * random.direction());
  }
  return polytope;
}

Segment randomSegment(Random& random) {
  const double lengths[] = {0, 1e-12, 1e-3, 1, 1, 30};
  const Vec3d a = fromEigen(random.inCube(2));
  return {a, a + lengths[random.below(6)] * fromEigen(random.direction()), 0};
}

// Capsules beside a hull would be missed, or one that is clear of it would count.
TEST(PolytopeDistance, DecisionsAreExact) {
  Random random(1111);
  for (int i = 0; i < 400; ++i) {
    ASSERT_NO_FATAL_FAILURE(expectExactDecisions(randomSegment(random), randomPolytope(random)))
        << i;
  }
}

// Exact contact would be missed with a corner, an edge or a face, and where points are equal or in
// one plane.
TEST(PolytopeDistance, DecisionsAreExactForWholeNumbers) {
  Random random(1112);
  const auto whole = [&] { return static_cast<double>(random.below(5)) - 2; };
  for (int i = 0; i < 600; ++i) {
    std::vector<double> points(3 * (1 + random.below(7)));
    for (double& x : points) x = whole();
    const Obstacle polytope = makePolytope(points);
    const Segment s{{2 * whole(), whole(), whole()}, {whole(), whole(), 2 * whole()}, 0};
    ASSERT_NO_FATAL_FAILURE(expectExactDecisions(s, polytope)) << i;
  }
}

// The search would end too early where many points are about equally near.
TEST(PolytopeDistance, DecisionsAreExactAlongFacesAndEdges) {
  Random random(1113);
  for (int i = 0; i < 400; ++i) {
    Obstacle prism =
        makePolytope({-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0, 0.3, 0.1, -1, -0.5, 0.2, -1});
    const Eigen::Matrix3d turn = random.rotation().toRotationMatrix();
    for (int k = 0; k < 3; ++k) prism.vector[k] = fromEigen(turn.col(k));
    prism.point = fromEigen(random.inCube(1));
    const double tilt = std::pow(10.0, -random.between(1, 17));
    const double height = std::pow(10.0, -random.between(0, 16));
    const Vec3d way = random.between(-1, 1) * prism.vector[0] + double(i % 2) * prism.vector[1];
    const Vec3d middle = prism.point + random.between(-1.5, 1.5) * prism.vector[0] +
                         random.between(-1.5, 1.5) * prism.vector[1] + height * prism.vector[2];
    const Vec3d along = way + tilt * fromEigen(random.direction());
    ASSERT_NO_FATAL_FAILURE(expectExactDecisions({middle - along, middle + along, 0}, prism)) << i;
  }
}

// In a scene of 1e-285 the pose has huge numbers and the vertices tiny ones: pairs would be missed.
TEST(PolytopeDistance, DecisionsAreExactIfThePoseIsHugeAndVerticesAreTiny) {
  Random random(1119);
  for (int i = 0; i < 200; ++i) {
    Obstacle polytope = randomPolytope(random);
    const int power = 880 + static_cast<int>(random.below(100)), sign = i % 2 == 0 ? 1 : -1;
    std::vector<double> points;
    for (std::size_t k = 0; k < polytope.vertices->count(); ++k) {
      const Vec3d p = std::ldexp(1.0, -sign * power) * (*polytope.vertices)[k];
      points.insert(points.end(), {p.x, p.y, p.z});
    }
    polytope.vertices = makePolytope(points).vertices;
    const double unit = std::ldexp(1.0, 40);
    for (Vec3d& v : polytope.vector) v = std::ldexp(unit, sign * power) * v;
    polytope.point = unit * polytope.point;
    const Segment s = randomSegment(random);
    ASSERT_NO_FATAL_FAILURE(expectExactDecisions({unit * s.a, unit * s.b, 0}, polytope)) << i;
  }
}

// Squares would overflow or vanish, or a place far from the origin would cost digits.
TEST(PolytopeDistance, DecisionsAreExactAtAllScalesAndOffsets) {
  Random random(1114);
  for (int i = 0; i < 200; ++i) {
    Obstacle polytope = randomPolytope(random);
    Segment s = randomSegment(random);
    if (i % 2 == 0) {
      const int powers[] = {-1000, -500, -200, 200, 500, 1000};
      const double scale = std::ldexp(1.0, powers[random.below(6)]);
      s = {scale * s.a, scale * s.b, 0};
      polytope.point = scale * polytope.point;
      if (i % 4 == 0) {
        for (Vec3d& v : polytope.vector) v = scale * v;
      } else {
        std::vector<double> points;
        for (std::size_t k = 0; k < polytope.vertices->count(); ++k) {
          const Vec3d p = scale * (*polytope.vertices)[k];
          points.insert(points.end(), {p.x, p.y, p.z});
        }
        polytope.vertices = makePolytope(points).vertices;
      }
    } else {
      const double offset = std::pow(10.0, random.between(0, 15));
      const Vec3d by{offset, -offset, offset};
      s = {s.a + by, s.b + by, 0};
      polytope.point = polytope.point + by;
    }
    ASSERT_NO_FATAL_FAILURE(expectExactDecisions(s, polytope)) << i;
  }
}

/// Points on a ball of radius 1.
std::vector<double> ball(Random& random, std::size_t count) {
  std::vector<double> points;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d p = random.direction();
    points.insert(points.end(), {p.x(), p.y(), p.z()});
  }
  return points;
}

// Vertices at the end would be left out, or a search among thousands would not end.
TEST(PolytopeDistance, CountsEveryOfManyVertices) {
  for (const std::int64_t target : simd::availableTargets()) {
    SCOPED_TRACE(simd::targetName(target));
    const simd::ScopedTarget scoped(target);
    Random random(1115);
    for (const std::size_t count : {4u, 7u, 8u, 9u, 200u, 5000u}) {
      for (int i = 0; i < 50; ++i) {
        std::vector<double> points = ball(random, count);
        // A tip over which the distance is known.
        const std::size_t tip = random.below(count);
        const Vec3d up = fromEigen(random.direction());
        for (std::size_t k = 0; k < 3; ++k) points[3 * tip + k] = 2 * up.*kAxes[k];
        const Vec3d across = fromEigen(random.direction()), side = cross(up, across);
        const double height = random.between(0, 2);
        const Vec3d middle = (2 + height) * up;
        const Segment s{middle - random.between(0, 3) * side, middle + random.between(0, 3) * side,
                        height};
        const Obstacle polytope = makePolytope(points);
        EXPECT_TRUE(touch(s, polytope, 1e-14, 0)) << count << ", " << i;
        EXPECT_FALSE(touch(Segment{s.a, s.b, height - 1e-13}, polytope, 0, 0))
            << count << ", " << i;
        EXPECT_TRUE(touch(Segment{{0, 0, 0}, 3.0 * up, 0}, polytope, 1e-14, 0));
      }
    }
  }
}

// A margin or an error would not count, or count twice.
TEST(PolytopeDistance, RadiusMarginsAndErrorsAddUp) {
  Obstacle polytope = makePolytope({0, 0, 0, -1, 1, 0, -1, -1, 0, -1, 0, 1});
  polytope.point = {1, 0, 0};
  const Segment s{{5, -4, 0}, {5, 4, 0}, 1};
  polytope.margin = 0.5;
  polytope.error = 0.25;
  EXPECT_TRUE(touch(s, polytope, 2, 0.25));
  EXPECT_FALSE(touch(s, polytope, 2, 0.25 - 1e-12));
  EXPECT_FALSE(touch(s, polytope, 2 - 1e-12, 0.25));
  const double most = std::numeric_limits<double>::max();
  EXPECT_TRUE(touch(s, polytope, most, 0));
  EXPECT_TRUE(touch(s, polytope, kInfinity, 0));
  polytope.point = {most, most, most};
  EXPECT_TRUE(touch(Segment{-1.0 * polytope.point, s.b, 0}, polytope, 0, 0)) << "it overflows";
}

// A manager's hull would be wrong as another manager sees it.
TEST(PolytopeDistance, IsThatOfAnotherFrame) {
  Random random(1116);
  const Frame from{{0.3, -7, 100}, 0x1p3}, to{{5, 1, -3}, 0x1p-4};
  const FrameChange change(from, to);
  for (int i = 0; i < 300; ++i) {
    const Obstacle polytope = randomPolytope(random), moved = inFrame(change, polytope);
    Segment s = randomSegment(random);
    const double distance = rootOf(exactSquared(s, polytope));
    s.radius = 0.9 * distance;
    EXPECT_EQ(touch(change(s), moved, 0, 1e-12), distance == 0);
    s.radius = 1.1 * distance;
    EXPECT_TRUE(touch(change(s), moved, 0, 1e-12));
    const Segment around = aroundOf(moved);
    for (std::size_t k = 0; k < polytope.vertices->count(); ++k) {
      const Vec3d p = (*polytope.vertices)[k];
      const Vec3d(&v)[3] = moved.vector;
      const Vec3d q = moved.point + p.x * v[0] + p.y * v[1] + p.z * v[2];
      EXPECT_TRUE(min(q, around.a) == around.a && max(q, around.b) == around.b);
    }
  }
}

// A capsule would pass through a hull during a step, or stop before it has reached it.
TEST(PolytopeImpact, IsTheFirstTimeAtWhichTheyTouch) {
  Random random(1117);
  int found = 0, missed = 0;
  for (int i = 0; i < 1500; ++i) {
    Obstacle polytope = randomPolytope(random);
    if (i % 3 == 0) polytope.vertices = makePolytope(ball(random, 60)).vertices;
    polytope.margin = random.below(2) == 0 ? 0 : 0.1;
    MovingSegment moving{randomSegment(random), randomSegment(random)};
    if (i % 2 == 0) {
      const Vec3d way = 3.0 * fromEigen(random.direction());
      moving.end = {moving.start.a + way, moving.start.b + way, 0};
    }
    moving.start.radius = random.between(0, 0.2);
    moving.end.radius = random.between(0, 0.2);
    if (i % 50 == 0) {
      const double scale = i % 100 == 0 ? 0x1p-300 : 0x1p300;
      for (Segment* s : {&moving.start, &moving.end}) {
        *s = {scale * s->a, scale * s->b, scale * s->radius};
      }
      polytope = scaled(polytope, scale);
      polytope.margin *= scale;
    }
    const double size =
        std::max(sizeOfPair(moving.start, polytope), sizeOfPair(moving.end, polytope)) +
        0.2 * polytope.margin;
    Impact impact;
    const bool hits = findImpact(moving, polytope, 0, 0, /*only_nearer=*/false, impact);
    EXPECT_EQ(touch(moving, polytope, 0, 0), hits);
    (hits ? found : missed)++;
    const auto touchesAt = [&](double time, double margin) {
      return touch(at(moving, time), polytope, margin, 0);
    };
    for (int k = 0; k <= 100; ++k) {
      const double time = k / 100.0;
      if (hits && time >= impact.time) break;
      ASSERT_FALSE(touchesAt(time, 0)) << i << ": missed at " << time;
    }
    if (!hits) continue;
    ASSERT_TRUE(touchesAt(impact.time, 0x1p-36 * (size + 1))) << i;
    // It comes no nearer than the place where it is let in only if it moves on.
    Impact approach;
    if (touchesAt(0, 0) && findImpact(moving, polytope, 0, 0, /*only_nearer=*/true, approach)) {
      EXPECT_GT(approach.time, 0) << i;
    }
  }
  EXPECT_GT(found, 100);
  EXPECT_GT(missed, 100);
}

// Deformed vertices would be taken for those that were copied.
TEST(PolytopeVerticesTest, KnowWhetherTheyAreCopies) {
  for (const std::int64_t target : simd::availableTargets()) {
    SCOPED_TRACE(simd::targetName(target));
    const simd::ScopedTarget scoped(target);
    for (std::size_t count = 1; count < 20; ++count) {
      std::vector<float> floats;
      for (std::size_t i = 0; i < 3 * count; ++i) floats.push_back(float(i) - 9.5f);
      std::vector<double> doubles(floats.begin(), floats.end());
      const PointsOfProgram points{nullptr, floats.data(), count},
          same{doubles.data(), nullptr, count};
      const PolytopeVertices vertices(points);
      EXPECT_TRUE(vertices.isCopyOf(points) && vertices.isCopyOf(same));
      EXPECT_FALSE(vertices.isCopyOf({doubles.data(), nullptr, count - 1}));
      EXPECT_EQ(vertices.largest().x, std::max(9.5, double(3 * count) - 12.5));
      for (double& x : doubles) {
        x += 1;
        ASSERT_FALSE(vertices.isCopyOf(same)) << count;
        x -= 1;
      }
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::geometry
