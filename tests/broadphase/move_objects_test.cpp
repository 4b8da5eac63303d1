// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl_fibers/fiber_objects.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/scalars.h"

namespace fcl_fibers {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

template <typename S>
class MoveObjects : public testing::Test {};

TYPED_TEST_SUITE(MoveObjects, test::Scalars, test::ScalarName);

template <typename S>
const fcl::Capsule<S>& shapeOf(const fcl::CollisionObject<S>& object) {
  return dynamic_cast<const fcl::Capsule<S>&>(*object.collisionGeometry());
}

// Two fibers of different lengths and radii, and the same fibers after a motion that turns,
// stretches, shrinks and thins them.
FiberPolylines atRest() {
  FiberPolylines scene;
  scene.points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {9, 9, 9}, {3, 0, 1}, {4, 0, 1}};
  scene.point_begin = {0, 3, 4, 6};
  scene.radii = {0.5, 0.25, 0, 0, 0.125, 0};
  return scene;
}

FiberPolylines inMotion() {
  FiberPolylines scene = atRest();
  scene.points = {{0, 0, 0}, {0, 3, 0}, {0.25, 3, 0}, {8, 8, 8}, {0, 1, 0.5}, {0, 1, 0.5}};
  scene.radii = {0.25, 0.5, 0, 0, 0.375, 0};
  return scene;
}

template <typename S>
void expectSame(const std::vector<std::unique_ptr<fcl::CollisionObject<S>>>& objects,
                const FiberPolylines& scene) {
  const auto expected = makeObjects<S>(scene);
  ASSERT_EQ(objects.size(), expected.size());
  for (std::size_t i = 0; i < objects.size(); ++i) {
    SCOPED_TRACE(i);
    const fcl::Capsule<S>&capsule = shapeOf(*objects[i]), &right = shapeOf(*expected[i]);
    EXPECT_EQ(objects[i]->getTransform().matrix(), expected[i]->getTransform().matrix());
    EXPECT_EQ(capsule.lz, right.lz);
    EXPECT_EQ(capsule.radius, right.radius);
    EXPECT_EQ(capsule.aabb_radius, right.aabb_radius);
    EXPECT_TRUE(capsule.aabb_local.equal(right.aabb_local));
    EXPECT_TRUE(objects[i]->getAABB().equal(expected[i]->getAABB()));
  }
}

TYPED_TEST(MoveObjects, MakesThemThoseOfTheNewState) {
  // If this fails, fibers that stretch have gaps or overlap, or FCL's managers lose them.
  const auto objects = makeObjects<TypeParam>(atRest());
  const auto capsule = objects[0]->collisionGeometry();
  moveObjects(inMotion(), objects);
  expectSame(objects, inMotion());
  EXPECT_EQ(objects[0]->collisionGeometry(), capsule);
  moveObjects(atRest(), objects);
  expectSame(objects, atRest());
  moveObjects(FiberPolylines{}, makeObjects<TypeParam>(FiberPolylines{}));
}

TYPED_TEST(MoveObjects, RefusesWhatDoesNotFitAndMovesNothing) {
  // If this fails, some objects have moved and others have not, or memory is overwritten.
  using S = TypeParam;
  auto objects = makeObjects<S>(atRest());
  const auto expectRefusal = [&objects](const FiberPolylines& scene, const char* reason) {
    EXPECT_THAT(
        [&] { moveObjects(scene, objects); },
        ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr("moveObjects: "), HasSubstr(reason))));
  };
  FiberPolylines bad = inMotion();
  bad.points[5][1] = std::nan("");
  expectRefusal(bad, "a coordinate of point 5 is nan");
  bad = inMotion();
  bad.radii[4] = -1;
  expectRefusal(bad, "radius is -1");
  bad = inMotion();
  bad.point_begin.back() = 5;
  expectRefusal(bad, "point_begin ends at 5");
  bad.points.pop_back();
  bad.radii.pop_back();
  expectRefusal(bad, "there are 3 objects and 2 segments");
  expectSame(objects, atRest());

  const auto last = std::move(objects[2]);
  expectRefusal(inMotion(), "object 2 is null");
  objects[2] = std::make_unique<fcl::CollisionObject<S>>(std::make_shared<fcl::Sphere<S>>(S(1)));
  expectRefusal(inMotion(), "object 2 is not a capsule");
  EXPECT_EQ(objects[0]->getTransform().translation(), fcl::Vector3<S>(S(0.5), 0, 0));
}

}  // namespace
}  // namespace fcl_fibers
