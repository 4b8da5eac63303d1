// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <ostream>
#include <vector>

#include <gtest/gtest.h>

#include "geometry/obstacle.h"
#include "geometry/obstacle_contact.h"
#include "geometry/polytope_distance.h"
#include "geometry/polytope_vertices.h"
#include "support/cone_oracle.h"
#include "support/random.h"
#include "support/segments.h"

// A rounded cone and an obstacle without a taper.
namespace fcl_fibers::geometry {

static std::ostream& operator<<(std::ostream& out, const Vec3d& v) {
  return out << "{" << v.x << ", " << v.y << ", " << v.z << "}";
}

static std::ostream& operator<<(std::ostream& out, const Segment& s) {
  out.precision(17);
  return out << "{" << s.a << ", " << s.b << ", " << s.radiusAtA() << ", " << s.radiusAtB() << "}";
}

namespace {

using test::Point;
using test::Random;
using test::Real;

constexpr double kEps = std::numeric_limits<double>::epsilon();

/// The distance of a point and a box of any edges: the least over its corners, edges, faces and
/// inside. Each of three coefficients is at one of its ends or between them.
Real distanceToBox(const Point& p, const Obstacle& box) {
  const Point w = p - toPoint(box.point);
  const Point v[3] = {toPoint(box.vector[0]), toPoint(box.vector[1]), toPoint(box.vector[2])};
  const auto inBounds = [](Real x) { return std::isfinite(x) ? std::clamp<Real>(x, -1, 1) : 0; };
  Real least = std::numeric_limits<Real>::infinity();
  for (int choice = 0; choice < 27; ++choice) {
    Point rest = w;
    std::vector<Point> free;
    for (int k = 0, digits = choice; k < 3; ++k, digits /= 3) {
      if (digits % 3 == 2) {
        free.push_back(v[k]);
      } else {
        rest += (digits % 3 == 0 ? Real(1) : Real(-1)) * v[k];
      }
    }
    if (free.size() == 1) {
      rest -= inBounds(free[0].dot(rest) / free[0].squaredNorm()) * free[0];
    } else if (free.size() == 2) {
      // The shares of both, without the normal that is left.
      const Point n = free[0].cross(free[1]);
      const Real squared = n.squaredNorm();
      const Real x = inBounds(rest.cross(free[1]).dot(n) / squared),
                 y = inBounds(free[0].cross(rest).dot(n) / squared);
      rest -= x * free[0] + y * free[1];
    } else if (free.size() == 3) {
      const Real volume = v[0].dot(v[1].cross(v[2]));
      const Real x[3] = {rest.dot(v[1].cross(v[2])) / volume, v[0].dot(rest.cross(v[2])) / volume,
                         v[0].dot(v[1].cross(rest)) / volume};
      const auto is_inside = [](Real c) { return std::fabs(c) <= 1; };
      if (std::all_of(x, x + 3, is_inside)) return 0;
    }
    least = std::min(least, rest.norm());
  }
  return least;
}

/// By its definition: the least over all balls.
Real distanceToBox(const Segment& cone, const Obstacle& box) {
  return test::leastOfConvex([&](Real s) {
    const Point center = (1 - s) * toPoint(cone.a) + s * toPoint(cone.b);
    return distanceToBox(center, box) - ((1 - s) * cone.radiusAtA() + s * cone.radiusAtB());
  });
}

/// By how much a cone has to move along a unit vector until all of it is beyond all of a box.
Real depthAlong(const Point& n, const Segment& cone, const Obstacle& box) {
  const Point middle = toPoint(box.point);
  Real depth = std::max(Real(cone.radiusAtA()) - n.dot(toPoint(cone.a) - middle),
                        Real(cone.radiusAtB()) - n.dot(toPoint(cone.b) - middle));
  for (const Vec3d& v : box.vector) depth += std::fabs(n.dot(toPoint(v)));
  return depth;
}

double sizeOf(const Segment& cone, const Obstacle& box) {
  double size = norm1(cone.a - box.point) + norm1(cone.b - box.point) + cone.radius;
  for (const Vec3d& v : box.vector) size += 2 * norm1(v);
  return size;
}

double magnitude(Random& random, double least) { return std::pow(least, random.unit()); }

/// A cone of one of the kinds at which something may go wrong.
Segment randomCone(Random& random) {
  const double length = random.below(8) == 0 ? 0 : magnitude(random, 1e-6);
  const Vec3d a = fromEigen(random.inCube(1.5)), b = a + 2 * length * fromEigen(random.direction());
  const double radius = magnitude(random, 1e-4);
  switch (random.below(5)) {
    case 0:  // one end is a point
      return Segment::cone(a, b, 0, radius);
    case 1:  // one ball may hold the other
      return Segment::cone(a, b, radius + 4 * length * random.unit(), radius);
    case 2:  // nearly that
      return Segment::cone(a, b, radius, radius + norm(b - a) * (1 + kEps * random.between(-8, 8)));
    case 3:
      return Segment::cone(a, b, radius, radius * (1 + kEps));
    default:
      return Segment::cone(a, b, radius, radius * random.unit());
  }
}

Obstacle obstacleOf(Obstacle::Kind kind, const Vec3d& point, const Vec3d& x, const Vec3d& y = {},
                    const Vec3d& z = {}) {
  Obstacle obstacle{kind, point};
  obstacle.vector[0] = x;
  obstacle.vector[1] = y;
  obstacle.vector[2] = z;
  return obstacle;
}

/// Turned, skew or along the axes of coordinates, and flat or thin at times.
Obstacle randomBox(Random& random) {
  const Eigen::Matrix3d turn =
      random.below(4) == 0 ? Eigen::Matrix3d::Identity() : random.rotation().toRotationMatrix();
  const double skew = random.below(3) == 0 ? 0.5 : 0;
  const auto side = [&](int i) {
    const double lengths[] = {1, 1, 1, 0.3, 0, 1e-9};
    const double length = lengths[random.below(6)] * random.between(0.2, 1);
    return length * fromEigen(turn.col(i) + skew * random.direction());
  };
  return obstacleOf(Obstacle::Kind::kBox, fromEigen(random.inCube(0.5)), side(0), side(1), side(2));
}

/// At random, or along or across something of the box.
Segment coneBeside(Random& random, const Obstacle& box) {
  Segment cone = randomCone(random);
  const Vec3d& edge = box.vector[random.below(3)];
  Vec3d on_box = box.point;
  for (const Vec3d& v : box.vector) on_box = on_box + random.between(-1.2, 1.2) * v;
  switch (random.below(6)) {
    case 0:
      cone.b = cone.a + random.between(-2, 2) * edge;
      break;
    case 1:
      cone.b = cone.a + random.between(-2, 2) * edge + 1e-9 * fromEigen(random.direction());
      break;
    case 2:
      cone.b = cone.b - cone.a + on_box;
      cone.a = on_box;
      break;
    case 3:
      cone.a = on_box - 2 * random.unit() * (cone.b - cone.a);
      cone.b = 2.0 * on_box - cone.a;
      break;
    default:
      break;
  }
  return cone;
}

Segment withMore(const Segment& cone, double radius) {
  return Segment::cone(cone.a, cone.b, cone.radiusAtA() + radius, cone.radiusAtB() + radius);
}
Segment reversed(const Segment& cone) { return {cone.b, cone.a, cone.radius, -cone.taper}; }

/// The same points as the box.
Obstacle polytopeOf(const Obstacle& box) {
  std::vector<double> corners;
  for (int k = 0; k < 8; ++k) {
    for (int bit = 0; bit < 3; ++bit) corners.push_back((k >> bit & 1) == 0 ? -1 : 1);
  }
  Obstacle polytope = box;
  polytope.kind = Obstacle::Kind::kPolytope;
  polytope.vertices =
      std::make_shared<PolytopeVertices>(PointsOfProgram{corners.data(), nullptr, 8});
  return polytope;
}

/// What polytope_distance.h promises of thin ones and others.
double doubtOfPolytope(const Obstacle& box, double doubt) {
  double thinnest = 1;
  for (const Vec3d& v : box.vector) thinnest = std::min(thinnest, maxNorm(v));
  return thinnest < 1e-8 ? doubt * 0x1p8 : 6 * doubt;
}

void expectDecisions(const Segment& cone, const Obstacle& obstacle, double distance, double doubt) {
  for (const Segment& c : {cone, reversed(cone)}) {
    if (distance + doubt >= 0) {
      EXPECT_TRUE(touch(c, obstacle, distance + doubt, 0)) << distance;
    }
    if (distance - doubt >= 0) {
      EXPECT_FALSE(touch(c, obstacle, distance - doubt, 0)) << distance;
    }
    // The radii decide as the margin does.
    const double least = std::min(c.radiusAtA(), c.radiusAtB());
    if (least + distance - doubt >= 0) {
      EXPECT_TRUE(touch(withMore(c, distance + doubt), obstacle, 0, 0)) << distance;
      EXPECT_FALSE(touch(withMore(c, distance - doubt), obstacle, 0, 0)) << distance;
    }
  }
}

TEST(ConeObstacle, TouchesABoxOrPolytopeAsByTheDefinition) {
  // If this fails, a cone at an edge, a face or a corner is missed, or counts as its capsule.
  Random random(20260201);
  int decided_by_margin = 0;
  for (int i = 0; i < 2500; ++i) {
    const Obstacle box = randomBox(random);
    const Segment cone = coneBeside(random, box);
    const auto distance = static_cast<double>(distanceToBox(cone, box));
    // touch() allows some ulp of the coordinates and radii.
    const double doubt = 16 * kEps * (sizeOf(cone, box) + std::fabs(distance));
    SCOPED_TRACE(testing::Message() << i << " " << cone);
    expectDecisions(cone, box, distance, doubt);
    expectDecisions(cone, polytopeOf(box), distance, doubtOfPolytope(box, doubt));
    decided_by_margin += distance > doubt;
  }
  EXPECT_GT(decided_by_margin, 600);
}

TEST(ConeObstacle, ScalesThatOverflowAndVanishAreNoDifferent) {
  // If this fails, products overflow or vanish.
  Random random(20260202);
  for (int i = 0; i < 150; ++i) {
    Obstacle box = randomBox(random);
    const Segment cone = coneBeside(random, box);
    const auto distance = static_cast<double>(distanceToBox(cone, box));
    const double doubt = 16 * kEps * (sizeOf(cone, box) + std::fabs(distance));
    for (const double scale : {0x1p-900, 0x1p-500, 0x1p-160, 0x1p160, 0x1p500, 0x1p900}) {
      const Segment c{scale * cone.a, scale * cone.b, scale * cone.radius, scale * cone.taper};
      const Obstacle scaled_box = scaled(box, scale);
      SCOPED_TRACE(i);
      expectDecisions(c, scaled_box, scale * distance, scale * doubt);
      expectDecisions(c, polytopeOf(scaled_box), scale * distance,
                      scale * doubtOfPolytope(box, doubt));
      const ObstacleContact big = obstacleContact(c, scaled_box, {0, 0, 0}),
                            plain = obstacleContact(cone, box, {0, 0, 0});
      EXPECT_NEAR(big.distance / scale, plain.distance, 4 * doubt);
    }
  }
}

TEST(ConeObstacle, ContactWithABoxIsTheNearestBallOrTheShortestWayOut) {
  // If this fails, a force pushes by the wrong depth, or along a way that is longer than another.
  Random random(20260203);
  int outside = 0, by_faces = 0, leaning = 0, beside = 0;
  for (int i = 0; i < 3000; ++i) {
    const Obstacle box = randomBox(random);
    const Segment cone = coneBeside(random, box);
    const double size = sizeOf(cone, box), most = 32 * kEps * size;
    const double rounding = 8 * kEps * (size + maxNorm(box.point));  // of points
    const ObstacleContact c = obstacleContact(cone, box, {0, 0, 0});
    SCOPED_TRACE(testing::Message() << i << " distance " << c.distance << " s " << c.s);
    const Point normal = toPoint(c.normal);
    EXPECT_NEAR(norm(c.normal), 1, 4 * kEps);
    EXPECT_TRUE(c.s >= 0 && c.s <= 1);
    // The points are what the other members say, and the second is on the box.
    const Vec3d on_axis = cone.a + c.s * (cone.b - cone.a);
    EXPECT_LE(maxNorm(on_axis + cone.radiusAt(c.s) * c.normal - c.point_a), rounding);
    EXPECT_LE(static_cast<double>(distanceToBox(toPoint(c.point_b), box)), most + rounding);

    const Segment axis{cone.a, cone.b, 0};
    const Real axis_distance = distanceToBox(axis, box), distance = distanceToBox(cone, box);
    const double center_distance = static_cast<double>(distanceToBox(toPoint(on_axis), box));
    if (axis_distance > 64 * kEps) {
      ++outside;
      EXPECT_NEAR(c.distance, static_cast<double>(distance), most);
      EXPECT_LE(maxNorm(c.point_b - c.point_a - c.distance * c.normal), most + rounding);
      // All of the cone is that far along the normal.
      EXPECT_NEAR(static_cast<double>(-depthAlong(-normal, cone, box)), c.distance,
                  most * (1 + size / center_distance));
      continue;
    }
    // The motion leads out, no other one is shorter, and then the two touch at the points.
    if (c.distance > -most) continue;
    const Real depth = depthAlong(-normal, cone, box);
    EXPECT_NEAR(static_cast<double>(depth), -c.distance, most);
    EXPECT_LE(maxNorm(c.point_b - c.point_a - c.distance * c.normal), 1e-7 * size);
    // The way to a ball beside the box has the error of a normal.
    const double longer = center_distance > 1e-6 ? most * (1 + size / center_distance) : most;
    for (int k = 0; k < 1500; ++k) {
      const Point any = random.direction().cast<Real>();
      const Real near = k % 3 == 0 ? 1 : std::pow(Real(10), -Real(k % 16));
      const Point n = k % 3 == 0 ? any : Point((near * any - normal).normalized());
      ASSERT_GE(static_cast<double>(depthAlong(n, cone, box)), -c.distance - longer)
          << k << " " << near;
    }
    const double across = std::fabs(dot(c.normal, cone.b - cone.a) + cone.taper);
    by_faces += across > 1e-6 * size;
    leaning += across <= 1e-12 * size && std::fabs(cone.taper) > 1e-3 * size;
    beside += distance < -1e-6L && depth < -distance * (1 + 1e-9L) && center_distance > 1e-6;
  }
  EXPECT_GT(outside, 500);
  EXPECT_GT(by_faces, 200);
  EXPECT_GT(leaning, 25);
  EXPECT_GT(beside, 20);
}

TEST(ConeObstacle, TouchesPlanesAndLeavesThemByTheEndThatReachesFarthest) {
  // If this fails, the thin end of a cone counts as thick, or the thick one is not looked at.
  Random random(20260204);
  for (int i = 0; i < 20000; ++i) {
    const bool is_plane = i % 2 == 0;
    const Vec3d n = fromEigen(random.direction());
    Obstacle flat = obstacleOf(is_plane ? Obstacle::Kind::kPlane : Obstacle::Kind::kHalfspace,
                               fromEigen(random.inCube(1)), n);
    flat.offset = random.between(-1, 1);
    Segment cone = randomCone(random);
    if (i % 7 == 0) cone.b = cone.a + cross(n, cone.b);
    const Point unit = toPoint(n).normalized();
    const auto height = [&](const Vec3d& p) {
      return (unit.dot(toPoint(p) - toPoint(flat.point)) - Real(flat.offset) / toPoint(n).norm());
    };
    const Real a = height(cone.a), b = height(cone.b), r_a = cone.radiusAtA(),
               r_b = cone.radiusAtB();
    const Real above = std::min(a - r_a, b - r_b), below = std::min(-a - r_a, -b - r_b);
    const auto distance = static_cast<double>(is_plane ? std::max(above, below) : above);
    const double size = norm1(cone.a - flat.point) + norm1(cone.b - flat.point) +
                        std::fabs(flat.offset) + cone.radius;
    SCOPED_TRACE(i);
    expectDecisions(cone, flat, distance, 64 * kEps * size);
    const ObstacleContact c = obstacleContact(cone, flat, {0, 0, 0});
    EXPECT_NEAR(c.distance, distance, 16 * kEps * size);
    const auto leaves = static_cast<double>(dot(c.normal, n) < 0 ? above : below);
    EXPECT_NEAR(leaves, distance, 16 * kEps * size);
    EXPECT_LE(maxNorm(c.point_b - c.point_a - c.distance * c.normal), 16 * kEps * size);
    const Vec3d on_axis = cone.a + c.s * (cone.b - cone.a);
    EXPECT_LE(maxNorm(on_axis + cone.radiusAt(c.s) * c.normal - c.point_a), 8 * kEps * size);
    EXPECT_NEAR(static_cast<double>(height(c.point_b)), 0, 16 * kEps * size);
  }
}

TEST(ConeObstacle, TouchesAxesAsConesDo) {
  // If this fails, a sphere or capsule is met by the capsule around the cone.
  Random random(20260205);
  int deep = 0;
  for (int i = 0; i < 2000; ++i) {
    const Segment cone = randomCone(random);
    Obstacle axis = obstacleOf(Obstacle::Kind::kAxis, fromEigen(random.inCube(1)),
                               (i % 3 == 0 ? 0.0 : 1.0) * fromEigen(random.inCube(1)));
    // The axes cross, one ends at the other, or both are on one line.
    if (i % 4 == 0) axis.point = cone.a + random.unit() * (cone.b - cone.a);
    if (i % 8 == 1) axis.vector[0] = random.between(-2, 2) * (cone.b - cone.a);
    if (i % 4 == 1) axis.point = cone.a + random.unit() * (cone.b - cone.a) + axis.vector[0];
    axis.margin = random.unit();
    const Segment q = axis.capsule();
    const auto distance = static_cast<double>(test::coneDistance(cone, q));
    const double size =
        norm1(cone.a - q.a) + norm1(cone.b - cone.a) + norm1(q.b - q.a) + cone.radius + q.radius;
    SCOPED_TRACE(i);
    expectDecisions(cone, axis, distance, 16 * kEps * (size + std::fabs(distance)));
    const ObstacleContact c = obstacleContact(cone, axis, {0, 0, 0});
    EXPECT_NEAR(c.distance, distance, 32 * kEps * size);
    EXPECT_LE(maxNorm(c.point_b - c.point_a - c.distance * c.normal),
              64 * kEps * size + 8 * kEps * maxNorm(q.a));
    const double centers = norm(q.a + c.t * (q.b - q.a) - (cone.a + c.s * (cone.b - cone.a)));
    // Along the normal one end of each is as far as that, and no other end is nearer.
    const auto along = [&](const Vec3d& p) { return dot(c.normal, p - cone.a); };
    const double gap = std::min(along(q.a), along(q.b)) - q.radius -
                       std::max(along(cone.a) + cone.radiusAtA(), along(cone.b) + cone.radiusAtB());
    const bool is_certain = centers < 1e-14 || centers > 1e-3;
    if (is_certain) {
      EXPECT_NEAR(gap, distance, 1e-12) << centers;
    }
    deep += centers < 1e-14;
  }
  EXPECT_GT(deep, 100);
}

TEST(ConeObstacle, WhatIsNotFiniteIsNotRuledOut) {
  // If this fails, NaN counts as apart.
  const double infinity = std::numeric_limits<double>::infinity();
  const Vec3d x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  const Obstacle box = obstacleOf(Obstacle::Kind::kBox, {0, 9, 0}, x, y, z);
  for (const double bad : {infinity, -infinity, std::nan("")}) {
    const Segment cone = Segment::cone({bad, 0, 0}, {1, 0, 0}, 0.1, 0.2);
    EXPECT_TRUE(touch(cone, box, 0, 0));
    EXPECT_TRUE(touch(cone, polytopeOf(box), 0, 0));
  }
  EXPECT_TRUE(touch(Segment::cone({0, 0, 0}, x, 0.1, 0.2), Obstacle{}, 0, 0));
}

}  // namespace
}  // namespace fcl_fibers::geometry
