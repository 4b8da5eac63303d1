// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <initializer_list>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "support/managed.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

MANAGER_SUITE(UpdateContract, AllManagers);
MANAGER_SUITE(FiberUpdate, FiberManagers);

// Over many small steps, bounds would fall behind what they bound.
TYPED_TEST(UpdateContract, BoundsHoldOverManySmallMotions) {
  const auto scene = curledScene<typename TypeParam::Scalar>(110, 103);
  Random random(104);
  const Managed<TypeParam> manager(scene);
  for (int step = 0; step < 80; ++step) {
    jolt(scene.objects(), random, 0.004, 0.02);
    manager->update();
    EXPECT_TRUE(manager.answersSelf()) << "step " << step;
  }
}

// Objects that moved alone would be found where they were, or others would be lost.
TYPED_TEST(UpdateContract, UpdateOfOneObjectCounts) {
  const auto scene = soupScene<typename TypeParam::Scalar>(90, 0.8, 106);
  Random random(107);
  const Managed<TypeParam> manager(scene);
  for (int step = 0; step < 40; ++step) {
    auto* object = scene[random.below(scene.size())];
    jolt(*object, random, 0.7, 3);
    manager->update(object);
    EXPECT_TRUE(manager.answersSelf()) << "step " << step;
  }
}

// A list of moved objects would be taken too literally: empty, repeated and unmoved ones are
// normal.
TYPED_TEST(UpdateContract, UpdateOfAListAcceptsRepeatedAndUnmovedObjects) {
  const auto scene = strandScene<typename TypeParam::Scalar>(7, 13, 108);
  Random random(109);
  const Managed<TypeParam> manager(scene);
  auto list = scene.objects();
  for (int step = 0; step < 15; ++step) {
    list.clear();
    for (int i = 0; step > 0 && i < 12; ++i) {
      auto* object = scene[random.below(scene.size())];
      if (i % 3 != 0) jolt(*object, random, 0.4, 1);
      list.push_back(object);
      if (i % 4 == 0) list.push_back(object);
    }
    random.shuffle(list);
    manager->update(list);
    EXPECT_TRUE(manager.answersSelf()) << "step " << step;
  }
}

// A shape that grows or shrinks would keep its old bounds.
TYPED_TEST(UpdateContract, AChangeOfShapeTakesEffectAtUpdate) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = soupScene<S>(60, 0.4, 111);
  // Half of the objects share one shape.
  Random random(112);
  const auto capsule = std::make_shared<fcl::Capsule<S>>(S(0.05), S(0.3));
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d position = random.inCube(1);
    scene.add(capsule, makePose<S>(random.rotation(), position));
  }
  const Managed<TypeParam> manager(scene);
  EXPECT_TRUE(manager.answersSelf());
  for (const auto& [radius, length] :
       std::vector<std::pair<double, double>>{{0.2, 0.3}, {0.2, 1}, {0, 1}, {0, 0}, {0.1, 0.5}}) {
    capsule->radius = static_cast<S>(radius);
    capsule->lz = static_cast<S>(length);
    capsule->computeLocalAABB();
    for (auto* object : scene.objects()) object->computeAABB();
    manager->update();
    EXPECT_TRUE(manager.answersSelf()) << radius << ", " << length;
  }
  // A shape of one object, and the update of that object alone.
  fcl::Capsule<S>& own = scene.capsule(5);
  own.radius = S(0.6);
  own.computeLocalAABB();
  scene[5]->computeAABB();
  manager->update(scene[5]);
  EXPECT_TRUE(manager.answersSelf());
}

// An object that moved and was not updated could not be taken out.
TYPED_TEST(UpdateContract, AnObjectMayMoveAndLeaveWithoutUpdate) {
  const auto scene = soupScene<typename TypeParam::Scalar>(40, 0.8, 113);
  Managed<TypeParam> manager(scene);
  for (const std::size_t i : std::initializer_list<std::size_t>{30, 20, 10, 0}) {
    translate(*scene[i], Eigen::Vector3d(10, 10, 10));
    manager.unregister(i);
    EXPECT_TRUE(manager.answersSelf());
  }
}

// Logs would depend on whether a program skips updates in which nothing moves.
TYPED_TEST(FiberUpdate, UpdateWithoutMotionChangesNothing) {
  using S = typename TypeParam::Scalar;
  const auto scene = curledScene<S>(80, 110);
  Scene<S> others;
  auto* const ball = others.addSphere({0, 0, 0}, 0.5);
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.02)) {
    SCOPED_TRACE(describe(options));
    const Managed<TypeParam> manager(scene, options);
    const Calls<S> pairs = selfPairs(*manager), with_one = pairsWith(*manager, *ball);
    EXPECT_GT(pairs.size(), 20u);
    EXPECT_GT(with_one.size(), 2u);
    for (int step = 0; step < 5; ++step) {
      manager->update();
      EXPECT_EQ(selfPairs(*manager), pairs) << step;
      EXPECT_EQ(pairsWith(*manager, *ball), with_one) << step;
    }
    // This may put the pairs into another order.
    manager->update(scene[3]);
    EXPECT_TRUE(manager.answersSelf());
  }
}

// Motions far from the origin that are small against the offset would be lost, as FCL's tree does.
TYPED_TEST(FiberUpdate, TinyMotionsAtLargeOffsetsCount) {
  using S = typename TypeParam::Scalar;
  // One unit in the last place of the coordinates.
  const double offset = 0x1p17;
  const double step = offset * static_cast<double>(std::numeric_limits<S>::epsilon());
  Scene<S> scene;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, std::pair{2 + step, 0.0}, std::pair{0.0, 40.0}}) {
    scene.addCapsule(makePose<S>(Eigen::Quaterniond::Identity(), {offset + x, offset + y, offset}),
                     1, 2);
  }
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0)) {
    const Managed<TypeParam> manager(scene, options);
    for (int i = 0; i < 4; ++i) {
      // In steps that end with touching, then apart again.
      translate(*scene[1], {i % 2 == 0 ? -step : step, 0, 0});
      i < 2 ? manager->update(scene[1]) : manager->update({scene[1], scene[2]});
      EXPECT_TRUE(manager.answersSelf(i % 2 == 0 ? 1 : 0)) << describe(options);
    }
  }
}

// Queries would read objects while another thread moves them for the next frame.
TYPED_TEST(FiberUpdate, ObjectsThatMoveCountWhereTheyWereUntilUpdate) {
  const auto scene = strandScene<typename TypeParam::Scalar>(7, 14, 118);
  const Managed<TypeParam> manager(scene);
  const auto before = selfPairs(*manager);
  EXPECT_FALSE(before.empty());
  Random random(119);
  jolt(scene.objects(), random, 1, 1);
  EXPECT_EQ(selfPairs(*manager), before);
  manager->setup();
  EXPECT_EQ(selfPairs(*manager), before);
  manager->update();
  EXPECT_TRUE(manager.answersSelf());
}

// A program that skips computeAABB() for capsules would be answered for where they were.
TYPED_TEST(FiberUpdate, CapsulesNeedNoComputeAABB) {
  using S = typename TypeParam::Scalar;
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.02)) {
    SCOPED_TRACE(describe(options));
    Scene<S> scene = strandScene<S>(6, 10, 108), probes;
    for (int i = 0; i < 5; ++i) scene.addSphere({0.1 * i, 0, 0}, 0.1);
    probes.addSphere({50, 50, 50}, 0.4);
    probes.addCapsule(Eigen::Vector3d(50, 50, 50), Eigen::Vector3d(51, 50, 50), 0.1);
    Random random(109);
    const auto move = [&](const std::vector<fcl::CollisionObject<S>*>& objects) {
      for (auto* object : objects) {
        const fcl::Vector3<S> place = object->getTranslation();
        object->setTranslation(place + random.inCube(0.3).template cast<S>());
      }
    };
    move(scene.objects());
    const Managed<TypeParam> manager(scene, options);
    EXPECT_TRUE(manager.answersSelf());
    for (auto* object : probes.objects()) {
      object->setTranslation(scene[17]->getTranslation());
      EXPECT_TRUE(manager.answersWith(object));
    }
    move(scene.objects());
    manager->update();
    EXPECT_TRUE(manager.answersSelf());
    move({scene[17]});
    manager->update(scene[17]);
    EXPECT_TRUE(manager.answersSelf());
    move({scene[3], scene[30], scene[59]});
    manager->update({scene[3], scene[30], scene[59]});
    EXPECT_TRUE(manager.answersSelf());
  }
}

// Objects that move between being registered and being set up, as MoveIt's do, would be left where
// they were created.
TYPED_TEST(FiberUpdate, TheFirstQueryAfterRegisteringReadsTheObjects) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(7, 14, 125);
  Random random(126);
  Managed<TypeParam> manager;
  for (const bool set_up : {false, true}) {
    SCOPED_TRACE(set_up ? "with setup()" : "without setup()");
    const auto expect_read = [&](const char* when) {
      if (set_up) manager->setup();
      EXPECT_TRUE(manager.answersSelf()) << when;
      // From then on they count where they were until an update.
      const auto pairs = selfPairs(*manager);
      std::vector<fcl::Transform3<S>> poses;
      for (auto* object : scene.objects()) poses.push_back(object->getTransform());
      jolt(scene.objects(), random, 1, 1);
      EXPECT_EQ(selfPairs(*manager), pairs) << when;
      for (std::size_t i = 0; i < scene.size(); ++i) moveTo(*scene[i], poses[i]);
    };
    manager.clear();
    manager.registerObjects(scene.objects());
    jolt(scene.objects(), random, 1, 1);
    expect_read("all registered");

    // Many of them, and all are read.
    const std::vector<fcl::CollisionObject<S>*> many(scene.objects().begin(),
                                                     scene.objects().begin() + 50);
    for (auto* object : many) manager.unregisterObject(object);
    manager.registerObjects(many);
    jolt(scene.objects(), random, 1, 1);
    expect_read("many registered");

    // Few of them, and these are read; the others count where they were, as in FCL's managers.
    manager.registerObject(manager.unregister(20));
    jolt(*manager.objects().back(), random, 1, 1);
    expect_read("one registered");
  }
}

// The sequence after updates would depend on addresses.
TYPED_TEST(FiberUpdate, TheSequenceAfterUpdatesDoesNotDependOnAddresses) {
  using S = typename TypeParam::Scalar;
  const auto sequence = [](const Scene<S>& scene) {
    const Managed<TypeParam> manager(scene);
    Random random(122);
    for (int step = 0; step < 4; ++step) {
      jolt(scene.objects(), random, 0.2, 0.5);
      manager->update();
    }
    return manager.numbered(selfPairs(*manager));
  };
  const Scene<S> scene = strandScene<S>(7, 14, 120);
  const Scene<S> copy = scene.reallocated(121);
  EXPECT_EQ(sequence(scene), sequence(copy));
}

// A scene that begins as a point and spreads out would keep the bounds' first reference and scale.
TYPED_TEST(FiberUpdate, ASceneMayChangeItsSizeAndPlaceByOrders) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = soupScene<S>(60, 0.6, 123, {Eigen::Vector3d::Zero(), 1e-3});
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0)) {
    const Managed<TypeParam> manager(scene, options);
    EXPECT_TRUE(manager.answersSelf());
    for (const double power : {1e3, 1e-3, 1e6, 1.0, 1e-6}) {
      const Scene<S> target =
          soupScene<S>(60, 0.6, 124, {Eigen::Vector3d::Constant(power * 100), power});
      for (std::size_t i = 0; i < scene.size(); ++i) {
        const auto& shape = dynamic_cast<const fcl::Capsule<S>&>(*target[i]->collisionGeometry());
        scene.capsule(i).radius = shape.radius;
        scene.capsule(i).lz = shape.lz;
        scene.capsule(i).computeLocalAABB();
        moveTo(*scene[i], target[i]->getTransform());
      }
      manager->update();
      EXPECT_TRUE(manager.answersSelf()) << power;
    }
  }
}

// A program that updates what it has just taken out would end.
TYPED_TEST(UpdateContract, UnknownObjectsArePassedOver) {
  using S = typename TypeParam::Scalar;
  const auto scene = strandScene<S>(5, 12, 121);
  Scene<S> unknown = soupScene<S>(3, 0.3, 122);
  Managed<TypeParam> manager(scene);
  manager->update(unknown[0]);
  EXPECT_TRUE(manager.answersSelf());
  fcl::CollisionObject<S>* const gone = manager.unregister(37);
  manager->update(gone);
  EXPECT_TRUE(manager.answersSelf());
  // Broken ones too, and beside others, which count.
  unknown[1]->setTranslation(fcl::Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN()));
  Random random(123);
  for (const std::size_t count : {1u, 5u, 50u}) {
    std::vector<fcl::CollisionObject<S>*> list = {unknown[1], gone};
    for (std::size_t i = 0; i < count; ++i) {
      jolt(*manager[i], random, 0.2, 0.5);
      list.push_back(manager[i]);
    }
    list.push_back(unknown[2]);
    manager->update(list);
    EXPECT_TRUE(manager.answersSelf()) << count;
  }
  manager->update({unknown[0], unknown[2]});
  EXPECT_TRUE(manager.answersSelf());
  Managed<TypeParam> empty;
  empty->update(unknown[0]);
  EXPECT_TRUE(empty.answersSelf(0));
}

}  // namespace
}  // namespace fcl_fibers::test
