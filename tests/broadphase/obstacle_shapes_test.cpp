// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/object_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>

#include "broadphase/shape_samples.h"
#include "geometry/polytope_vertices.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

using geometry::Frame;
using geometry::Obstacle;
using geometry::Segment;
using Matrix = Eigen::Matrix<Real, 3, 3>;

/// @return whether more than the box counts
template <typename S>
bool readObstacle(const Object<S>& object, const Frame& frame, Bounds bounds, Obstacle& obstacle) {
  obstacle = obstacleOf(broadphase::readObject(object, bounds), frame);
  return obstacle.kind != Obstacle::Kind::kNone;
}

Point toPoint(const geometry::Vec3d& v) { return {v.x, v.y, v.z}; }

/// A point of a shape in the frame, up to 2^-64.
template <typename S>
Point posed(const fcl::Transform3<S>& pose, const Frame& frame, const Point& p) {
  const Matrix turn = pose.linear().template cast<Real>();
  const Point position = pose.translation().template cast<Real>();
  return Real(frame.scale) * ((position - toPoint(frame.origin)) + turn * p);
}

/// How far a point is outside of a box: the box grows by that length at least.
Real outside(const Obstacle& box, const Point& p) {
  Matrix axes;
  Point half;
  for (int i = 0; i < 3; ++i) {
    const Point v = toPoint(box.vector[i]);
    half[i] = v.norm();
    axes.col(i) = half[i] > 0 ? Point(v / half[i]) : Point::Zero();
  }
  // A side of length zero has no direction, so any that is across the others will do.
  for (int i = 0; i < 3; ++i) {
    if (half[i] > 0) continue;
    const Point &next = axes.col((i + 1) % 3), &last = axes.col((i + 2) % 3);
    if (next.norm() > 0 && last.norm() > 0) axes.col(i) = next.cross(last).normalized();
  }
  if (axes.determinant() == 0) return (p - toPoint(box.point)).norm() - half.norm();
  const Point x = axes.inverse() * (p - toPoint(box.point));
  return (x.cwiseAbs() - half).maxCoeff();
}

const Frame kFrames[] = {Frame{}, Frame{{0.3, -7, 100}, 0x1p12}, Frame{{1e3, 1e3, 1e3}, 0x1p-20}};

template <typename S>
class ObstacleShapes : public testing::Test {};
TYPED_TEST_SUITE(ObstacleShapes, Scalars, ScalarName);

// A shape would stick out of its obstacle, and capsules that touch it there be missed.
TYPED_TEST(ObstacleShapes, ContainTheShapeAndAreExactForBoxesTrianglesAndPolytopes) {
  using S = TypeParam;
  Random random(711);
  for (int kind = 0; kind < kBounded; ++kind) {
    for (std::size_t i = 0; i < 600; ++i) {
      const double size = std::pow(10.0, random.between(-6, 6));
      const double offset = i % 3 == 0 ? 1e3 : size;
      const Sample<S> sample = makeSample<S>(kind, size, random);
      const Object<S> object(sample.shape, makePose<S>(i, random, offset));
      const Frame& frame = kFrames[i % std::size(kFrames)];
      Obstacle obstacle;
      ASSERT_TRUE(readObstacle(object, frame, Bounds::kShapesAndMargins, obstacle));
      EXPECT_EQ(obstacle.margin, 0);
      ASSERT_EQ(obstacle.kind, kind == kTriangle ? Obstacle::Kind::kTriangle
                               : kind == kConvex ? Obstacle::Kind::kPolytope
                                                 : Obstacle::Kind::kBox);
      // A few ulp of the coordinates.
      const double largest =
          std::max({maxNorm(frame.fromWorld(geometry::Vec3d{offset, offset, offset})),
                    maxNorm(frame.fromWorld(geometry::Vec3d{-offset, -offset, -offset})),
                    frame.scale * size});
      EXPECT_LE(obstacle.error, 128 * std::numeric_limits<double>::epsilon() * largest);
      for (std::size_t k = 0; k < sample.points.size(); ++k) {
        const Point p = posed(object.getTransform(), frame, sample.points[k]);
        if (kind == kTriangle) {
          ASSERT_LE((toPoint(obstacle.vector[k]) - p).norm(), Real(obstacle.error)) << i;
          continue;
        }
        if (kind == kConvex) {
          Point vertex = toPoint(obstacle.point);
          const Point own = toPoint((*obstacle.vertices)[k]);
          for (int axis = 0; axis < 3; ++axis) vertex += own[axis] * toPoint(obstacle.vector[axis]);
          ASSERT_LE((vertex - p).norm(), Real(obstacle.error)) << i;
          continue;
        }
        ASSERT_LE(outside(obstacle, p), Real(obstacle.error)) << kind << ", " << i;
        if (kind != kBox && kind != kCube) continue;
        Point corner = toPoint(obstacle.point);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          corner += (k >> axis & 1u ? 1 : -1) * toPoint(obstacle.vector[axis]);
        }
        ASSERT_LE((corner - p).norm(), Real(obstacle.error)) << i;
      }
    }
  }
}

// A plane would stand aslant, or at another place than its points.
TYPED_TEST(ObstacleShapes, ArePlanesThroughThePointsOfPlanes) {
  using S = TypeParam;
  Random random(712);
  for (std::size_t i = 0; i < 2000; ++i) {
    const double size = std::pow(10.0, random.between(-3, 3));
    const fcl::Vector3<S> normal =
        i % 5 == 0 ? fcl::Vector3<S>(fcl::Vector3<S>::Unit(i % 3) * S(i % 2 == 0 ? 1 : -1))
                   : fcl::Vector3<S>(random.direction().template cast<S>());
    const S d = static_cast<S>(random.below(4) == 0 ? 0 : size * random.between(-1, 1));
    std::shared_ptr<fcl::CollisionGeometry<S>> shape;
    Point n;
    Real offset = 0;
    const auto make = [&](auto&& plane) {
      // A program may give any length to the normal afterwards.
      if (i % 7 == 0) {
        plane->n *= S(1000);
        plane->d *= S(1000);
      }
      n = plane->n.template cast<Real>();
      offset = plane->d;
      shape = plane;
    };
    const bool is_plane = i % 2 == 0;
    is_plane ? make(std::make_shared<fcl::Plane<S>>(normal, d))
             : make(std::make_shared<fcl::Halfspace<S>>(normal, d));
    const Object<S> object(shape, makePose<S>(i, random, size));
    const Frame& frame = kFrames[i / 2 % std::size(kFrames)];
    Obstacle obstacle;
    ASSERT_TRUE(readObstacle(object, frame, Bounds::kShapesAndMargins, obstacle)) << i;
    ASSERT_EQ(obstacle.kind, is_plane ? Obstacle::Kind::kPlane : Obstacle::Kind::kHalfspace);
    const Point unit = toPoint(obstacle.vector[0]);
    EXPECT_NEAR(static_cast<double>(unit.norm()), 1, 4e-15);
    for (int k = 0; k < 4; ++k) {
      Point p = random.inCube(size).cast<Real>();
      p += (offset - n.dot(p)) / n.squaredNorm() * n;
      const Point below = p - Real(size) / n.norm() * n;
      const auto height = [&](const Point& x) {
        return unit.dot(posed(object.getTransform(), frame, x) - toPoint(obstacle.point)) -
               Real(obstacle.offset);
      };
      const Real slack = 64 * 0x1p-52L * Real(frame.scale) * Real(size);
      ASSERT_LE(std::fabs(height(p)), Real(obstacle.error) + slack) << i;
      EXPECT_NEAR(static_cast<double>(height(below) / (Real(frame.scale) * Real(size))), -1, 1e-2);
    }
  }
}

/// Whether FCL finds a capsule of this thickness in contact.
template <typename S>
bool touchesInFcl(double radius, double length, const fcl::Transform3<S>& pose,
                  const fcl::CollisionObject<S>& object) {
  const fcl::CollisionObject<S> capsule(
      std::make_shared<fcl::Capsule<S>>(static_cast<S>(radius), static_cast<S>(length)), pose);
  fcl::CollisionResult<S> result;
  return fcl::collide(&capsule, &object, fcl::CollisionRequest<S>(), result) > 0;
}

// The sense of a normal, half sides in place of sides, or an axis would be mistaken: FCL, which
// reads the same shapes by itself, would see something else. It is trusted up to 2 % of the radius,
// and does not test triangles.
TEST(ObstacleShapesAndCapsules, TouchAsFclFinds) {
  using S = double;
  Random random(713);
  int touching[kBounded + 2] = {}, apart[kBounded + 2] = {};
  for (std::size_t i = 0; i < 6000; ++i) {
    const int kind = static_cast<int>(i % (kBounded + 2));
    if (kind == kTriangle) continue;
    auto shape = makeSample<S>(kind, 2, random).shape;
    const Eigen::Vector3d normal = random.direction();
    const double offset = random.between(-1, 1);
    if (kind == kBounded) shape = std::make_shared<fcl::Plane<S>>(normal, offset);
    if (kind == kBounded + 1) shape = std::make_shared<fcl::Halfspace<S>>(normal, offset);
    const Object<S> object(shape, makePose<S>(kAnyTurn, random, 1));
    const double radius = random.between(0.1, 0.5), length = random.between(0.1, 2);
    const fcl::Transform3<S> pose = makePose<S>(kAnyTurn, random, 2);
    const fcl::CollisionObject<S> capsule(std::make_shared<fcl::Capsule<S>>(radius, length), pose);
    const Frame& frame = kFrames[i % std::size(kFrames)];
    Obstacle obstacle;
    ASSERT_TRUE(readObstacle(object, frame, Bounds::kShapes, obstacle));
    Segment segment;
    ASSERT_EQ(broadphase::readSegment(capsule, frame, Bounds::kShapes, segment), nullptr);
    const bool answer = touch(segment, obstacle, 0, endPointError(segment));
    if (touchesInFcl(0.98 * radius, length, pose, object)) {
      EXPECT_TRUE(answer) << "kind " << kind << ", " << i;
    }
    const bool is_exact = kind == kBox || kind == kCube || kind == kConvex || kind >= kBounded;
    if (is_exact && !touchesInFcl(1.02 * radius, length, pose, object)) {
      EXPECT_FALSE(answer) << "kind " << kind << ", " << i;
    }
    ++(answer ? touching : apart)[kind];
  }
  for (int kind = 0; kind < kBounded + 2; ++kind) {
    if (kind == kTriangle) continue;
    EXPECT_GT(touching[kind], kind == kConvex ? 10 : 50) << kind;
    EXPECT_GT(apart[kind], 50) << kind;
  }
}

// What a program adds to a box would be lost, or be in none of the two obstacles.
TYPED_TEST(ObstacleShapes, HaveTheMarginOfTheProgramOrAreNone) {
  using S = TypeParam;
  Random random(714);
  for (int kind = 0; kind < kBounded; ++kind) {
    // A margin around a cube may be taken for FCL's cube in another pose.
    if (kind == kCube) continue;
    for (std::size_t i = 0; i < 40; ++i) {
      Sample<S> sample = makeSample<S>(kind, 1, random);
      Object<S> object(sample.shape, makePose<S>(i, random, 1));
      object.aabb.expand(fcl::Vector3<S>::Constant(S(0.25)));
      const Frame& frame = kFrames[i % std::size(kFrames)];
      Obstacle obstacle;
      ASSERT_TRUE(readObstacle(object, frame, Bounds::kShapesAndMargins, obstacle));
      EXPECT_NEAR(obstacle.margin / frame.scale, 0.25, 1e-4);
      EXPECT_GE(obstacle.margin / frame.scale, 0.25 * (1 - 1e-6));
      ASSERT_TRUE(readObstacle(object, frame, Bounds::kShapes, obstacle));
      EXPECT_EQ(obstacle.margin, 0);
      EXPECT_FALSE(readObstacle(object, frame, Bounds::kObjects, obstacle));
      EXPECT_EQ(obstacle.kind, Obstacle::Kind::kNone);
      object.aabb.max_[1] += 1;
      ASSERT_TRUE(readObstacle(object, frame, Bounds::kShapesAndMargins, obstacle));
      // FCL gives a shape that is hardly turned the box of one that is not.
      EXPECT_GE(obstacle.margin / frame.scale, 1.25 * (1 - 1e-5)) << "not the most of any side";
      EXPECT_TRUE(readObstacle(object, frame, Bounds::kShapes, obstacle));
      object.aabb.max_[1] = std::numeric_limits<S>::infinity();
      EXPECT_FALSE(readObstacle(object, frame, Bounds::kShapesAndMargins, obstacle));
    }
  }
}

// A program's larger box of a half-space would count no more.
TYPED_TEST(ObstacleShapes, AreNoneForPlanesThatAreWidened) {
  using S = TypeParam;
  const auto read = [](const Object<S>& object, Bounds bounds) {
    Obstacle obstacle;
    return readObstacle(object, Frame{}, bounds, obstacle);
  };
  for (const bool is_plane : {false, true}) {
    const auto make = [&]() -> std::shared_ptr<fcl::CollisionGeometry<S>> {
      const fcl::Vector3<S> up(0, 0, 1);
      if (is_plane) return std::make_shared<fcl::Plane<S>>(up, S(2));
      return std::make_shared<fcl::Halfspace<S>>(up, S(2));
    };
    fcl::Transform3<S> pose = fcl::Transform3<S>::Identity();
    pose.translation() = fcl::Vector3<S>(S(0.1), S(0.2), S(0.3));
    Object<S> object(make(), pose);
    EXPECT_TRUE(read(object, Bounds::kShapesAndMargins));
    // In a lower place without computeAABB(), and in a higher one.
    pose.translation()[2] = S(-5);
    object.setTransform(pose);
    EXPECT_FALSE(read(object, Bounds::kShapesAndMargins));
    EXPECT_TRUE(read(object, Bounds::kShapes));
    object.computeAABB();
    EXPECT_TRUE(read(object, Bounds::kShapesAndMargins));
    object.aabb.max_[2] += S(0.5);
    EXPECT_FALSE(read(object, Bounds::kShapesAndMargins));
    object.computeAABB();
    object.shape().aabb_local.max_[2] += S(0.5);
    EXPECT_FALSE(read(object, Bounds::kShapesAndMargins));
    EXPECT_TRUE(read(object, Bounds::kShapes));
    // FCL's box of a turned one is open on all sides.
    Object<S> turned(make(), pose);
    pose.linear() = Eigen::AngleAxis<S>(S(0.5), fcl::Vector3<S>(1, 0, 0)).toRotationMatrix();
    turned.setTransform(pose);
    turned.computeAABB();
    EXPECT_TRUE(read(turned, Bounds::kShapesAndMargins));
  }
}

// What is no obstacle would be one of NaN, which touches nothing, or of another shape.
TYPED_TEST(ObstacleShapes, AreNoneIfNumbersAreNot) {
  using S = TypeParam;
  const auto kind = [](const std::shared_ptr<fcl::CollisionGeometry<S>>& shape) {
    const Object<S> object(shape, fcl::Transform3<S>::Identity());
    Obstacle obstacle;
    obstacle.kind = Obstacle::Kind::kBox;
    EXPECT_FALSE(readObstacle(object, Frame{}, Bounds::kShapes, obstacle));
    return obstacle.kind;
  };
  const S nan = std::numeric_limits<S>::quiet_NaN(), infinity = std::numeric_limits<S>::infinity();
  const fcl::Vector3<S> up(0, 0, 1);
  constexpr auto kNone = Obstacle::Kind::kNone;
  EXPECT_EQ(kind(std::make_shared<fcl::Plane<S>>(up, nan)), kNone);
  EXPECT_EQ(kind(std::make_shared<fcl::Halfspace<S>>(up, infinity)), kNone);
  const auto no_normal = std::make_shared<fcl::Halfspace<S>>(up, S(1));
  no_normal->n.setZero();
  EXPECT_EQ(kind(no_normal), kNone);
  EXPECT_EQ(kind(std::make_shared<fcl::Box<S>>(S(1), nan, S(1))), kNone);
  EXPECT_EQ(kind(std::make_shared<fcl::Sphere<S>>(S(1))), kNone);
  EXPECT_EQ(kind(std::make_shared<fcl::Capsule<S>>(S(1), S(1))), kNone);
}

}  // namespace
}  // namespace fcl_fibers::test
