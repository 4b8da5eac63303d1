// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_objects.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/other_locale.h"
#include "support/scalars.h"

namespace fcl_fibers {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

// Two points a fiber.
FiberPolylines pairsOfPoints(const std::vector<Point>& points) {
  FiberPolylines scene;
  scene.points = points;
  for (std::size_t i = 2; i <= points.size(); i += 2) scene.point_begin.push_back(i);
  scene.radius = 0.25;
  return scene;
}

template <typename S>
const fcl::Capsule<S>& capsuleOf(const fcl::CollisionObject<S>& object) {
  return dynamic_cast<const fcl::Capsule<S>&>(*object.collisionGeometry());
}

template <typename S>
double ulp(double number) {
  const S magnitude = static_cast<S>(std::abs(number));
  return static_cast<double>(std::nextafter(magnitude, std::numeric_limits<S>::infinity())) -
         static_cast<double>(magnitude);
}

// Segments of every kind: any direction and size, short and far out, from a point to its mirror
// image, and along or nearly along an axis.
std::vector<Point> trickySegments() {
  std::vector<Point> points;
  std::mt19937_64 engine(11);
  const auto uniform = [&engine] {
    return static_cast<double>(engine() >> 11) * 0x1p-52 - 1;  // [-1, 1)
  };
  for (int i = 0; i < 20000; ++i) {
    const double size = std::exp2(std::floor(20 * uniform()));
    const Point a = {size * uniform(), size * uniform(), size * uniform()};
    points.push_back(a);
    points.push_back({size * uniform(), size * uniform(), size * uniform()});
    points.push_back(a);
    points.push_back({a[0] * (1 + 1e-5 * uniform()), a[1] * (1 + 1e-5 * uniform()),
                      a[2] * (1 + 1e-5 * uniform())});
    points.push_back(a);
    points.push_back({-a[0], -a[1], -a[2]});
  }
  for (const double tilt : {0.0, -0.0, 1e-300, 1e-20, 1e-9, 1e-4, 0.1}) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {-1.0, 1.0}) {
        for (const double size : {1e-30, 1.0, 1e30}) {
          Point tip = {size * tilt, size * tilt, size * tilt};
          tip[static_cast<std::size_t>(axis)] = size * sign;
          points.push_back({0, 0, 0});
          points.push_back(tip);
        }
      }
    }
  }
  return points;
}

template <typename S>
class FiberObjectsTest : public testing::Test {};

TYPED_TEST_SUITE(FiberObjectsTest, test::Scalars, test::ScalarName);

TYPED_TEST(FiberObjectsTest, CapsulesAreTheSegments) {
  // If this fails, capsules are not where the polyline is, neighbours do not share an end, or a
  // capsule is stretched, mirrored, thicker or longer, near -z for instance.
  using S = TypeParam;
  const double tolerance = 8 * static_cast<double>(std::numeric_limits<S>::epsilon());
  const FiberPolylines scene = pairsOfPoints(trickySegments());
  const auto objects = makeObjects<S>(scene);
  ASSERT_EQ(objects.size(), scene.segmentCount());
  std::set<const fcl::CollisionGeometry<S>*> capsules;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const Point& from = scene.points[2 * i];
    const Point& to = scene.points[2 * i + 1];
    double largest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      largest = std::max({largest, std::abs(from[k]), std::abs(to[k])});
    }
    ASSERT_EQ(objects[i]->getNodeType(), fcl::GEOM_CAPSULE);
    const fcl::Capsule<S>& capsule = capsuleOf(*objects[i]);
    capsules.insert(&capsule);
    const double length = std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
    ASSERT_EQ(capsule.radius, S(0.25));
    ASSERT_NEAR(static_cast<double>(capsule.lz), length, 4 * ulp<S>(length));
    const fcl::Transform3<S>& pose = objects[i]->getTransform();
    const fcl::Vector3<S> begin = pose * fcl::Vector3<S>(0, 0, -capsule.lz / 2);
    const fcl::Vector3<S> end = pose * fcl::Vector3<S>(0, 0, capsule.lz / 2);
    for (int k = 0; k < 3; ++k) {
      const auto c = static_cast<std::size_t>(k);
      ASSERT_NEAR(static_cast<double>(begin[k]), from[c], 2 * ulp<S>(largest)) << "segment " << i;
      ASSERT_NEAR(static_cast<double>(end[k]), to[c], 2 * ulp<S>(largest)) << "segment " << i;
    }
    const fcl::Matrix3<double> rotation = pose.linear().template cast<double>();
    const fcl::Matrix3<double> product = rotation.transpose() * rotation;
    ASSERT_LE((product - fcl::Matrix3<double>::Identity()).cwiseAbs().maxCoeff(), tolerance);
    ASSERT_NEAR(rotation.determinant(), 1, tolerance) << rotation;
    ASSERT_EQ(pose.matrix().row(3), (Eigen::Matrix<S, 1, 4>(0, 0, 0, 1)));
  }
  EXPECT_EQ(capsules.size(), objects.size()) << "changing one capsule changes others";
}

TYPED_TEST(FiberObjectsTest, CapsulesHaveTheRadiusAtTheirFirstPoint) {
  // If this fails, hair with a thickness by point has one for all, or that of a neighbour.
  using S = TypeParam;
  FiberPolylines scene;
  scene.points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}};
  scene.point_begin = {0, 3, 5};
  scene.radius = 9;
  scene.radii = {1, 2, 3, 4, 5};
  const auto objects = makeObjects<S>(scene);
  ASSERT_EQ(objects.size(), 3U);
  EXPECT_EQ(capsuleOf(*objects[0]).radius, 1);
  EXPECT_EQ(capsuleOf(*objects[1]).radius, 2);
  EXPECT_EQ(capsuleOf(*objects[2]).radius, 4);
}

TYPED_TEST(FiberObjectsTest, CapsulesOfConesHaveTheLargerRadius) {
  // If this fails, a manager misses what touches the thick end of a segment that tapers.
  FiberPolylines scene = pairsOfPoints({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}});
  scene.radii = {1, 2, 4, 3};
  scene.radii_are = FiberArrays<double>::Radii::kPerPoint;
  const auto objects = makeObjects<TypeParam>(scene);
  EXPECT_EQ(capsuleOf(*objects.at(0)).radius, 2);
  EXPECT_EQ(capsuleOf(*objects.at(1)).radius, 4);
}

TYPED_TEST(FiberObjectsTest, SegmentsThatAreTinyOrVastKeepTheirDirection) {
  // If this fails, squared lengths underflow or overflow.
  using S = TypeParam;
  const double tiny = static_cast<double>(std::numeric_limits<S>::denorm_min()) * 8;
  const double vast = static_cast<double>(std::numeric_limits<S>::max()) / 4;
  for (const double size : {tiny, vast}) {
    const FiberPolylines scene = pairsOfPoints({{-size, size, 0}, {size, size, 0}});
    const auto objects = makeObjects<S>(scene);
    EXPECT_EQ(objects[0]->getTransform().linear().col(2), fcl::Vector3<S>(1, 0, 0));
    EXPECT_EQ(capsuleOf(*objects[0]).lz, static_cast<S>(2 * size));
    const FiberPolylines diagonal = pairsOfPoints({{-size, -size, -size}, {size, size, size}});
    const fcl::Vector3<S> axis = segmentPoses<S>(diagonal)[0].linear().col(2);
    EXPECT_LE((axis - fcl::Vector3<S>::Constant(std::sqrt(S(1) / 3))).cwiseAbs().maxCoeff(),
              4 * std::numeric_limits<S>::epsilon());
  }
}

TYPED_TEST(FiberObjectsTest, SegmentOfLengthZeroIsAPointAtRest) {
  // If this fails, fibers with coinciding points are NaN.
  using S = TypeParam;
  const auto objects = makeObjects<S>(pairsOfPoints({{1, 2, 3}, {1, 2, 3}}));
  EXPECT_EQ(objects[0]->getTransform().linear(), fcl::Matrix3<S>(fcl::Matrix3<S>::Identity()));
  EXPECT_EQ(objects[0]->getTransform().translation(), fcl::Vector3<S>(1, 2, 3));
  EXPECT_EQ(capsuleOf(*objects[0]).lz, 0);
}

TYPED_TEST(FiberObjectsTest, SegmentsFollowFiberAfterFiber) {
  // If this fails, a segment joins two fibers, or segments are out of order.
  using S = TypeParam;
  FiberPolylines scene;
  scene.points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {9, 9, 9}, {3, 0, 0}, {4, 0, 0}};
  scene.point_begin = {0, 0, 3, 4, 4, 6, 6};  // Among these are a lone point and empty fibers.
  EXPECT_EQ(scene.fiberCount(), 6U);
  ASSERT_EQ(scene.segmentCount(), 3U);
  const auto poses = segmentPoses<S>(scene);
  const auto objects = makeObjects<S>(scene);
  ASSERT_EQ(poses.size(), 3U);
  ASSERT_EQ(objects.size(), 3U);
  const std::vector<S> middles = {S(0.5), S(1.5), S(3.5)};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(poses[i].translation(), fcl::Vector3<S>(middles[i], 0, 0));
    EXPECT_EQ(objects[i]->getTransform().matrix(), poses[i].matrix());
  }
}

TYPED_TEST(FiberObjectsTest, SceneWithoutFibersHasNoObjects) {
  // If this fails, the empty scene is an error, or worse.
  EXPECT_TRUE(segmentPoses<TypeParam>(FiberPolylines{}).empty());
  EXPECT_TRUE(makeObjects<TypeParam>(FiberPolylines{}).empty());
}

TYPED_TEST(FiberObjectsTest, RefusesFibersThatAreNoPartitionOfThePoints) {
  // If this fails, points are read that do not exist, or silently left out.
  FiberPolylines scene;
  scene.points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  const auto expectRefusal = [&scene](const char* reason) {
    EXPECT_THAT([&] { segmentPoses<TypeParam>(scene); },
                ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr("segmentPoses: point_begin"),
                                                           HasSubstr(reason), HasSubstr("must"))));
    EXPECT_THAT([&] { makeObjects<TypeParam>(scene); },
                ThrowsMessage<std::invalid_argument>(
                    AllOf(HasSubstr("makeObjects: point_begin"), HasSubstr(reason))));
  };
  scene.point_begin = {};
  expectRefusal("is empty");
  scene.point_begin = {1, 3};
  expectRefusal("starts at 1");
  scene.point_begin = {0, 2, 1, 3};
  expectRefusal("descends at fiber 1");
  scene.point_begin = {0, 2};
  expectRefusal("ends at 2, but there are 3 points");
  scene.point_begin = {0, 4};
  expectRefusal("ends at 4, but there are 3 points");
  scene.point_begin = {0};
  expectRefusal("ends at 0, but there are 3 points");
}

TYPED_TEST(FiberObjectsTest, RefusesCoordinatesThatTheScalarCannotHold) {
  // If this fails, poses are NaN or infinite.
  using Limits = std::numeric_limits<TypeParam>;
  const double too_large = static_cast<double>(Limits::max()) / 2;
  for (const double bad : {std::nan(""), double{Limits::infinity()}, too_large, -too_large}) {
    for (std::size_t k = 0; k < 3; ++k) {
      FiberPolylines scene = pairsOfPoints({{0, 0, 0}, {1, 1, 1}});
      scene.points[1][k] = bad;
      EXPECT_THAT([&] { segmentPoses<TypeParam>(scene); },
                  ThrowsMessage<std::invalid_argument>(
                      HasSubstr("segmentPoses: a coordinate of point 1 is ")));
      EXPECT_THAT([&] { makeObjects<TypeParam>(scene); },
                  ThrowsMessage<std::invalid_argument>(
                      HasSubstr("makeObjects: a coordinate of point 1 is ")));
    }
  }
}

TYPED_TEST(FiberObjectsTest, RefusesARadiusThatIsNone) {
  // If this fails, capsules have a radius that no query can answer for.
  FiberPolylines scene = pairsOfPoints({{0, 0, 0}, {1, 1, 1}});
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {-1.0, std::nan(""), infinity, std::numeric_limits<double>::max()}) {
    scene.radius = bad;
    EXPECT_THAT([&] { makeObjects<TypeParam>(scene); },
                ThrowsMessage<std::invalid_argument>(
                    AllOf(HasSubstr("makeObjects: radius is "), HasSubstr("give a finite"))));
    FiberPolylines by_point = pairsOfPoints({{0, 0, 0}, {1, 1, 1}});
    by_point.radii = {1, bad};
    EXPECT_THAT([&] { makeObjects<TypeParam>(by_point); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("makeObjects: radius is ")));
  }
  scene.radius = 0;
  scene.radii = {1};
  EXPECT_THAT(
      [&] { makeObjects<TypeParam>(scene); },
      ThrowsMessage<std::invalid_argument>(HasSubstr("the number of radii is 1; give one")));
  scene.radii = {};
  EXPECT_EQ(capsuleOf(*makeObjects<TypeParam>(scene)[0]).radius, 0);
}

TYPED_TEST(FiberObjectsTest, TextsAreTheSameInAnyLocale) {
  // If this fails, a number in an error is another one where the host writes 1.234,5.
  const test::OtherLocale locale;
  FiberPolylines scene = pairsOfPoints({{0, 0, 0}, {1, 1, 1}});
  scene.radius = -1234.5;
  EXPECT_THAT([&] { makeObjects<TypeParam>(scene); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("radius is -1234.5;")));
}

TYPED_TEST(FiberObjectsTest, ObjectsAreThoseOfTheirFibers) {
  // If this fails, a manager takes segments of several fibers for one, or a ring for a hair.
  FiberPolylines scene;
  scene.points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {5, 5, 5}, {0, 1, 0},
                  {1, 1, 0}, {1, 2, 0}, {0, 2, 0}, {0, 1, 0}};
  scene.point_begin = {0, 3, 4, 4, 9};
  scene.closed = {0, 0, 0, 1};
  const auto owned = makeObjects<TypeParam>(scene);
  std::vector<fcl::CollisionObject<TypeParam>*> objects;
  for (const auto& object : owned) objects.push_back(object.get());

  const auto expectRight = [&](const auto& fibers) {
    ASSERT_EQ(fibers.size(), 4U);
    EXPECT_THAT(fibers[0].objects, testing::ElementsAre(objects[0], objects[1]));
    EXPECT_THAT(fibers[1].objects, testing::IsEmpty());
    EXPECT_THAT(fibers[2].objects, testing::IsEmpty());
    EXPECT_THAT(fibers[3].objects,
                testing::ElementsAre(objects[2], objects[3], objects[4], objects[5]));
    EXPECT_EQ(fibers[0].ends, FiberEnds::kOpen);
    EXPECT_EQ(fibers[3].ends, FiberEnds::kClosed);
  };
  expectRight(objectsByFiber(scene, owned));
  expectRight(objectsByFiber(scene, objects));

  objects.pop_back();
  EXPECT_THAT([&] { objectsByFiber(scene, objects); },
              ThrowsMessage<std::invalid_argument>(
                  HasSubstr("objectsByFiber: there are 5 objects and 6 segments")));
  EXPECT_TRUE(objectsByFiber(FiberPolylines{}, makeObjects<TypeParam>(FiberPolylines{})).empty());
}

}  // namespace
}  // namespace fcl_fibers
