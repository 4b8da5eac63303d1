// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <initializer_list>
#include <string>
#include <vector>

#include "support/managed.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

// One by one: FCL's tree crashes if it is given unbounded boxes at once.
template <typename Config>
Managed<Config> registeredEach(const Scene<typename Config::Scalar>& scene,
                               const FiberManagerOptions& options) {
  Managed<Config> manager(options);
  manager.registerEach(scene.objects());
  manager->setup();
  return manager;
}

template <typename S>
void addUnbounded(Scene<S>& scene) {
  scene.addHalfspace({0, 0, 1}, -0.5);
  scene.addHalfspace({1, 0, 0}, -0.75);
  scene.addHalfspace({0, -1, 0}, -0.25);
  scene.addHalfspace({1, 2, 3}, 0);
  scene.addPlane({0, 1, 0}, 0.25);
  scene.addPlane({-1, 1, 0}, 0.25);
}

template <typename S>
Scene<S> fibersAndShapes(std::size_t shapes, std::uint64_t seed) {
  Scene<S> scene = strandScene<S>(5, 12, seed);
  addShapes(scene, shapes, 0.3, seed + 1);
  scene.addFiber({{-1, 0, 0}, {0, 0.1, 0}, {1, 0, 0.1}}, 0.02);
  return scene;
}

MANAGER_SUITE(MixedContract, AllManagers);
MANAGER_SUITE(FiberMixed, FiberManagers);

// Hair would pass through the head.
TYPED_TEST(MixedContract, ShapesBesideFibersAreFound) {
  for (const std::size_t shapes : std::initializer_list<std::size_t>{1, 5, 40, 300}) {
    const auto scene = fibersAndShapes<typename TypeParam::Scalar>(shapes, 161);
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
      SCOPED_TRACE(std::to_string(shapes) + " shapes, " + describe(options));
      EXPECT_TRUE(Managed<TypeParam>(scene, options).answersSelf());
    }
  }
}

// An unbounded or boxy object as the query, or in the other manager, would be lost.
TYPED_TEST(MixedContract, ShapesAsPartnersAreFound) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = fibersAndShapes<S>(12, 164);
  Scene<S> others;
  addShapes(others, 12, 0.8, 165);
  addUnbounded(others);
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
    SCOPED_TRACE(describe(options));
    const auto manager = registeredEach<TypeParam>(scene, options);
    const auto other = registeredEach<TypeParam>(others, options);
    manager.expectAnswersWith(others.objects());
    other.expectAnswersWith(scene.objects());
    EXPECT_TRUE(manager.answersWith(other));
    EXPECT_TRUE(other.answersWith(manager));
  }
}

// Registering everything at once would fail where one by one works, as in FCL's tree.
TYPED_TEST(FiberMixed, UnboundedShapesMayBeRegisteredAtOnce) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = fibersAndShapes<S>(10, 170);
  addUnbounded(scene);
  // Turned, an unbounded box has infinite sides.
  moveTo(*scene.objects().back(),
         makePose<S>(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX())),
                     {0, 0, 0.1}));
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
    SCOPED_TRACE(describe(options));
    const Managed<TypeParam> manager(scene, options);
    EXPECT_TRUE(manager.answersSelf());
    manager->update();
    EXPECT_TRUE(manager.answersSelf());
    manager.expectAnswersWith(scene.objects());
  }
}

// A scene of nothing but unbounded shapes, or of one, has no box to build on.
TYPED_TEST(FiberMixed, AnUnboundedShapeMayBeAlone) {
  Scene<typename TypeParam::Scalar> floor, capsule;
  floor.addHalfspace({0, 0, 1}, 0);
  capsule.addCapsule(Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(0, 0, 1), 0.1);
  Managed<TypeParam> manager(floor);
  EXPECT_TRUE(manager.answersSelf(0));
  EXPECT_TRUE(manager.answersWith(floor[0], 0));
  manager.registerObject(capsule[0]);
  EXPECT_TRUE(manager.answersSelf());
  manager.unregisterObject(capsule[0]);
  EXPECT_TRUE(manager.answersSelf(0));
}

// Distances between fibers and shapes would be wrong.
TYPED_TEST(FiberMixed, DistancesIncludeShapes) {
  Scene<typename TypeParam::Scalar> scene;
  Random random(172);
  for (int i = 0; i < 64; ++i) {
    const Eigen::Vector3d center = Eigen::Vector3d(i % 4, i / 4 % 4, i / 16) + random.inCube(0.1);
    const Eigen::Vector3d half = 0.2 * random.direction();
    const Eigen::Quaterniond turn = random.rotation();
    const double size = random.between(0.1, 0.2);
    if (i % 6 == 0) scene.addSphere(center, size);
    if (i % 6 == 1) scene.addBox(center, turn, Eigen::Vector3d::Constant(size));
    if (i % 6 == 2) scene.addMesh(center, size);
    if (i % 6 == 3) scene.addOctree(center, size);
    if (i % 6 == 4) scene.addConvex(center, size);
    if (i % 6 == 5) scene.addCapsule(center - half, center + half, 0.02);
  }
  for (const bool floor : {false, true}) {
    if (floor) scene.addHalfspace({0, 0, 1}, -0.5);
    const Managed<TypeParam> manager(scene);
    EXPECT_GT(manager.expectNearest(), 0);
    manager.expectEveryPair();
    for (auto* object : scene.objects()) manager.expectNearest(object);
  }
}

// Once a contact was found, everything would be tried against the floor all the same.
TYPED_TEST(FiberMixed, NoUnboundedShapeIsVisitedOnceTheDistanceIsZero) {
  auto scene = strandScene<typename TypeParam::Scalar>(4, 8, 173);
  scene.addHalfspace({0, 0, 1}, 0);
  EXPECT_LE(Managed<TypeParam>(scene).expectNearest(), 0);
}

}  // namespace
}  // namespace fcl_fibers::test
