// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/triangle_distance.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "geometry/obstacle.h"
#include "geometry/triangle_contact.h"
#include "geometry/triangle_rows.h"
#include "support/exact_geometry.h"
#include "support/random.h"
#include "support/scoped_target.h"

// numerics/touch_decisions_test.cpp judges axisWithin().
namespace fcl_fibers::geometry {
namespace {

using test::Real;

test::Point exact(const Vec3d& p) { return {p.x, p.y, p.z}; }

Real distanceOf(const Segment& s, const Triangle& t) {
  return test::segmentTriangleDistance(exact(s.a), exact(s.b),
                                       {exact(t.a), exact(t.b), exact(t.c)});
}

/// The sum of the lengths by which rounding is bounded.
double sizeOf(const Segment& s, const Triangle& t) {
  return norm(s.a - t.a) + norm(s.b - s.a) + norm(t.b - t.a) + norm(t.c - t.a);
}

/// Segments and triangles of all kinds: on a coarse grid, where corners, edges and planes meet
/// exactly, in general position, nearly parallel, and without length or area.
struct Cases {
  explicit Cases(std::uint64_t seed) : random(seed) {}

  Vec3d point() {
    const Eigen::Vector3d p = random.inCube(2);
    if (!on_grid) return {p.x(), p.y(), p.z()};
    return {std::round(p.x()), std::round(p.y()), std::round(p.z())};
  }
  void next() {
    on_grid = random.below(2) == 0;
    segment = {point(), point(), 0};
    triangle = {point(), point(), point()};
    const auto kind = random.below(8);
    is_plain = !on_grid && kind == 7;
    switch (kind) {
      case 0:
        segment.b = segment.a;
        break;
      case 1:
        triangle.c = triangle.b;
        break;
      case 2:
        triangle.b = triangle.c = triangle.a;
        break;
      case 3:  // a needle
        triangle.c = triangle.a + 0.3 * (triangle.b - triangle.a) + needle_width * point();
        break;
      case 4:  // nearly parallel to an edge
        segment.b = segment.a + (triangle.b - triangle.a) + 1e-8 * point();
        break;
      case 5:  // in the plane
        segment = {triangle.a + 0.2 * (triangle.b - triangle.a),
                   triangle.a + 2.0 * (triangle.c - triangle.a), 0};
        break;
      case 6: {  // hair that lies on the triangle, or dips into it
        const Vec3d across = cross(triangle.b - triangle.a, triangle.c - triangle.a);
        const double height = std::pow(10, random.between(-16, -1));
        const auto near = [&] {
          const double x = 2 * random.unit() - 0.5, y = 2 * random.unit() - 0.5;
          return triangle.a + x * (triangle.b - triangle.a) + y * (triangle.c - triangle.a) +
                 height * random.between(-1, 1) * across;
        };
        segment = {near(), near(), 0};
        break;
      }
      default:
        break;
    }
  }

  test::Random random;
  bool on_grid = false;
  bool is_plain = false;  ///< in general position
  double needle_width = 1e-9;
  Segment segment;
  Triangle triangle;
};

TEST(TriangleDistance, ClosestPointsAreClosestAtAllScales) {
  Cases cases(2);
  const int powers[] = {0, 0, 0, -900, -300, -100, 100, 300, 900};
  for (int i = 0; i < 100000; ++i) {
    cases.needle_width = std::pow(10, cases.random.between(-17, -7));
    cases.next();
    const Segment& s = cases.segment;
    const Triangle& t = cases.triangle;
    const double scale = std::ldexp(1.0, powers[i % 9]);
    const ClosestOnTriangle closest =
        closestPoints({scale * s.a, scale * s.b, 0}, {scale * t.a, scale * t.b, scale * t.c});
    const auto& [a, b, c] = closest.weight;
    ASSERT_TRUE(closest.s >= 0 && closest.s <= 1 && a >= 0 && b >= 0 && c >= 0);
    ASSERT_NEAR(a + b + c, 1, 1e-15);
    const Vec3d apart = a * t.a + b * t.b + c * t.c - (s.a + closest.s * (s.b - s.a));
    const Vec3d found = (1 / scale) * closest.apart;
    const double size = sizeOf(s, t);
    ASSERT_LE(norm(apart - found), 1e-14 * size) << i;
    ASSERT_NEAR(norm(found), static_cast<double>(distanceOf(s, t)), 1e-14 * size) << i;
  }
}

void setRows(const Segment& s, const Triangle& t, int lane, TriangleRows& rows) {
  const Vec3d vectors[] = {s.a - t.a, s.b - s.a, t.b - t.a, t.c - t.a};
  TriangleRows::Vectors* const all[] = {&rows.w, &rows.u, &rows.v1, &rows.v2};
  rows.size[lane] = 0;
  for (int v = 0; v < 4; ++v) {
    for (int axis = 0; axis < 3; ++axis) (*all[v])[axis][lane] = vectors[v].*kAxes[axis];
    rows.size[lane] += norm1(vectors[v]);
  }
}

// A certain pair would have other points than the vector between them, which moves the capsule; or
// most pairs of a mesh would take the way of many digits, which is ten times as long.
TEST(TriangleDistance, RowsAreCertainOfWhatTheyPromise) {
  constexpr double kEps = std::numeric_limits<double>::epsilon();
  constexpr int kLanes = TriangleRows::kLanes;
  Cases cases(6);
  int plain = 0, plain_and_certain = 0;
  for (int i = 0; i < 60000; ++i) {
    TriangleRows rows;
    bool is_plain[kLanes];
    for (int k = 0; k < kLanes; ++k) {
      // Triangles that are hardly wider than the rounding, besides all others.
      cases.needle_width = std::pow(10, cases.random.between(-17, -3));
      cases.next();
      setRows(cases.segment, cases.triangle, k, rows);
      is_plain[k] = cases.is_plain;
    }
    const simd::LaneMask certain = findClosest(rows, kLanes);
    for (int k = 0; k < kLanes; ++k) {
      const bool is_certain = (certain >> k & 1) != 0;
      plain += is_plain[k];
      plain_and_certain += is_plain[k] && is_certain;
      if (!is_certain) continue;
      double largest = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const Real between = Real(rows.w[axis][k]) + Real(rows.s[k]) * Real(rows.u[axis][k]) -
                             Real(rows.x[k]) * Real(rows.v1[axis][k]) -
                             Real(rows.y[k]) * Real(rows.v2[axis][k]);
        largest =
            std::max(largest, std::fabs(static_cast<double>(between - Real(rows.apart[axis][k]))));
      }
      ASSERT_LE(largest, 10 * kEps * rows.size[k]) << i;
    }
  }
  EXPECT_GT(plain, 20000);
  EXPECT_GT(plain_and_certain, 0.8 * plain) << plain_and_certain << " of " << plain;
}

// A capsule that nearly meets an edge would be pushed along it, or into the triangle; or all of
// what lies on a mesh would take the way of many digits.
TEST(TriangleDistance, TheWayOutIsRightHoweverNearTheTwoAre) {
  test::Random random(7);
  const auto vector = [&] {
    const Eigen::Vector3d p = random.inCube(1);
    return Vec3d{p.x(), p.y(), p.z()};
  };
  int near = 0, near_and_certain = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3d edge = vector(), along = vector(), across = cross(edge, along);
    if (norm(across) < 0.1 * norm(edge) * norm(along)) continue;
    const Vec3d normal = (1 / norm(across)) * across;
    const double height = std::pow(10, random.between(-10, -1));
    // The plane through the edge and along the axis parts the two.
    const Vec3d corner = vector();
    const double below = dot(normal, corner);
    const Vec3d c = below < 0 ? corner : corner - (2 * below + 0.1) * normal;
    const Vec3d a = 10.0 * vector(), met = a + random.between(0.1, 0.9) * edge + height * normal;
    const double start = random.between(0.1, 0.9);
    // The axis passes over the edge, or ends above it.
    const bool passes = i % 2 == 0;
    const Segment s = passes ? Segment{met - start * along, met + (1 - start) * along, 0}
                             : Segment{met + start * along + normal, met, 0};
    const Triangle t{a, a + edge, a + c};
    // Coordinates are rounded, so the exact way is that from these.
    const test::Point v = exact(t.b) - exact(t.a), u = exact(s.b) - exact(s.a),
                      q = exact(s.b) - exact(t.a);
    const test::Point way = passes ? test::Point(v.cross(u)) : q - q.dot(v) / v.dot(v) * v;
    const Vec3d expected{static_cast<double>(way[0]), static_cast<double>(way[1]),
                         static_cast<double>(way[2])};
    const Vec3d found = closestPoints(s, t).apart;
    ASSERT_LE(norm((1 / norm(found)) * found + (1 / norm(expected)) * expected), 1e-8)
        << i << ", " << height;
    if (height < 1e-5) continue;
    ++near;
    TriangleRows rows;
    setRows(s, t, 0, rows);
    near_and_certain += (findClosest(rows, 1) & 1) != 0;
  }
  EXPECT_GT(near, 1000);
  EXPECT_GT(near_and_certain, 0.9 * near) << near_and_certain << " of " << near;
}

// Contacts would depend on which others are computed with them, or on the machine.
TEST(TriangleDistance, SeveralAtATimeAreThoseOfEachAlone) {
  Cases cases(5);
  const int powers[] = {0, 0, 0, 0, 0, -900, -100, 100, 900};
  int lanes = 0;
  for (int i = 0; i < 5000; ++i) {
    const std::size_t count = 1 + cases.random.below(kClosestAtOnce);
    Segment segments[kClosestAtOnce];
    Triangle triangles[kClosestAtOnce];
    ClosestOnTriangle alone[kClosestAtOnce];
    for (std::size_t k = 0; k < count; ++k) {
      cases.next();
      const double scale = std::ldexp(1.0, powers[(static_cast<std::size_t>(i) + k) % 9]);
      const Segment& s = cases.segment;
      const Triangle& t = cases.triangle;
      segments[k] = {scale * s.a, scale * s.b, 0};
      triangles[k] = {scale * t.a, scale * t.b, scale * t.c};
      alone[k] = closestPoints(segments[k], triangles[k]);
    }
    for (const std::int64_t target : simd::availableTargets()) {
      const simd::ScopedTarget scoped(target);
      ClosestOnTriangle closest[kClosestAtOnce];
      closestPoints(segments, triangles, count, closest);
      for (std::size_t k = 0; k < count; ++k, ++lanes) {
        ASSERT_EQ(closest[k].s, alone[k].s) << simd::targetName(target) << ", " << i;
        ASSERT_TRUE(std::equal(closest[k].weight, closest[k].weight + 3, alone[k].weight)) << i;
        ASSERT_EQ(closest[k].apart, alone[k].apart) << simd::targetName(target) << ", " << i;
      }
    }
  }
  EXPECT_GT(lanes, 10000);
}

// What moves as far as is safe would pass through a triangle, or stop far from it.
TEST(TriangleDistance, TheLeastDistanceIsATightBound) {
  Cases cases(3);
  const int powers[] = {0, 0, 0, -900, -300, -100, 100, 300, 900};
  for (int i = 0; i < 100000; ++i) {
    cases.next();
    const Segment& s = cases.segment;
    const Triangle& t = cases.triangle;
    const double scale = std::ldexp(1.0, powers[i % 9]);
    const double least =
        leastDistance({scale * s.a, scale * s.b, 0}, {scale * t.a, scale * t.b, scale * t.c}) /
        scale;
    const Real exact = distanceOf(s, t);
    const double size = sizeOf(s, t);
    ASSERT_GE(least, 0) << i;
    ASSERT_LE(least, exact + 1e-17L * size) << i;
    ASSERT_GE(least, (1 - 1e-8L) * exact - 1e-14L * size) << i;
  }
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Triangle triangle{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_EQ(leastDistance({{0, 0, 5}, {kInfinity, 0, 5}, 0}, triangle), 0);
  EXPECT_EQ(leastDistance({{0, 0, 5}, {1e308, -1e308, 5}, 0}, triangle), 0);
}

TEST(TriangleDistance, WhatIsNotFiniteTouches) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Triangle triangle{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_TRUE(axisWithin({{0, 0, 5}, {kInfinity, 0, 5}, 0}, triangle, 0));
  EXPECT_TRUE(axisWithin({{0, 0, 5}, {1e308, -1e308, 5}, 0}, triangle, kInfinity));
  EXPECT_FALSE(touch({{0, 0, 5}, {1, 0, 5}, 1}, triangle, 3, 0));
  EXPECT_TRUE(touch({{0, 0, 5}, {1, 0, 5}, 1}, triangle, 3, 1));
}

TEST(TriangleDistance, WhatIsNotFiniteIsInfinitelyFar) {
  // If this fails, no scale makes coordinates finite, and the stack overflows.
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Triangle triangle{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  for (const double bad : {kInfinity, -kInfinity, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(maxNorm(closestPoints({{0, bad, 5}, {1, 0, 5}, 0}, triangle).apart), kInfinity);
    EXPECT_EQ(
        maxNorm(
            closestPoints({{0, 0, 5}, {1, 0, 5}, 0}, {{0, 0, 0}, {1, 0, 0}, {0, 1, bad}}).apart),
        kInfinity);
  }
  // The sum of these lengths is infinite, and none of them.
  const Segment far{{0, 0, 1e308}, {1e308, 0, 1e308}, 0};
  EXPECT_DOUBLE_EQ(closestPoints(far, triangle).apart.z, -1e308);
}

TEST(TriangleContact, SeparatesCapsuleAndTriangle) {
  Cases cases(4);
  int crossing = 0, apart = 0;
  for (int i = 0; i < 50000; ++i) {
    cases.next();
    Segment s = cases.segment;
    const Triangle& t = cases.triangle;
    s.radius = 0.5 * cases.random.unit();
    const TriangleContact contact = triangleContact(s, t, {0, 0, 0});
    const double size = sizeOf(s, t) + s.radius;
    ASSERT_NEAR(norm(contact.normal), 1, 1e-14);
    ASSERT_NEAR(norm(contact.point_b -
                     (contact.weight[0] * t.a + contact.weight[1] * t.b + contact.weight[2] * t.c)),
                0, 1e-14 * size);
    const Vec3d on_axis = s.a + contact.s * (s.b - s.a);
    ASSERT_NEAR(norm(contact.point_a - on_axis - s.radius * contact.normal), 0, 1e-14 * size);
    if (!contact.crosses) {
      ++apart;
      ASSERT_NEAR(contact.distance, static_cast<double>(distanceOf(s, t)) - s.radius, 1e-14 * size);
      ASSERT_NEAR(norm(contact.point_b - contact.point_a - contact.distance * contact.normal), 0,
                  1e-14 * size);
    }
    if (contact.distance >= 0) continue;
    crossing += contact.crosses ? 1 : 0;
    // The motion by the depth leaves the two touching or apart. A needle of width 1e-9 has a normal
    // of that precision.
    const Vec3d move = contact.distance * contact.normal;
    const Segment moved{s.a + move, s.b + move, s.radius};
    ASSERT_GE(static_cast<double>(distanceOf(moved, t)), s.radius - 1e-9 * size) << i;
  }
  EXPECT_GT(crossing, 5000);
  EXPECT_GT(apart, 10000);
}

}  // namespace
}  // namespace fcl_fibers::geometry
