// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "support/distance_search.h"
#include "support/managers_under_test.h"
#include "support/pair_oracle.h"
#include "support/pair_queries.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

template <typename Config, typename S>
testing::AssertionResult answers(const fcl::BroadPhaseCollisionManager<S>& manager,
                                 const Scene<S>& scene, const FiberManagerOptions& options = {}) {
  const PairOracle<S> oracle(scene.objects(), rulesOf<Config>(options));
  return oracle.answersSelf(selfPairs(manager), scene.objects(), kOrder<Config>);
}

template <typename Config>
class UpdateContract : public testing::Test {};
TYPED_TEST_SUITE(UpdateContract, AllManagers, ManagerNames);

template <typename Config>
class FiberUpdate : public testing::Test {};
TYPED_TEST_SUITE(FiberUpdate, FiberManagers, ManagerNames);

// After a motion, pairs would be those of a frame ago.
TYPED_TEST(UpdateContract, UpdateFollowsRandomMotions) {
  using S = typename TypeParam::Scalar;
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.02)) {
    SCOPED_TRACE(describe(options));
    const Scene<S> scene = strandScene<S>(8, 16, 101);
    Random random(102);
    const auto manager = TypeParam::make(options);
    manager->registerObjects(scene.objects());
    manager->setup();
    for (int step = 0; step < 15; ++step) {
      const double distance = step % 5 == 4 ? 1.5 : 0.05;
      for (fcl::CollisionObject<S>* object : scene.objects()) jolt(*object, random, distance, 0.3);
      manager->update();
      EXPECT_TRUE(answers<TypeParam>(*manager, scene, options)) << "step " << step;
    }
  }
}

// Over many small steps, bounds would fall behind what they bound.
TYPED_TEST(UpdateContract, BoundsHoldOverManySmallMotions) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = curledScene<S>(110, 103);
  Random random(104);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  for (int step = 0; step < 80; ++step) {
    for (fcl::CollisionObject<S>* object : scene.objects()) jolt(*object, random, 0.004, 0.02);
    manager->update();
    EXPECT_TRUE(answers<TypeParam>(*manager, scene)) << "step " << step;
  }
}

// A scene that contracts, expands, turns or travels as a whole would lose pairs or keep false ones.
TYPED_TEST(UpdateContract, UpdateFollowsTheSceneAsAWhole) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = unequalScene<S>(105);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  const auto apply = [&](const Eigen::Quaterniond& turn, double scale,
                         const Eigen::Vector3d& shift) {
    for (fcl::CollisionObject<S>* object : scene.objects()) {
      const Eigen::Matrix3d rotation = object->getRotation().template cast<double>();
      const Eigen::Vector3d position = object->getTranslation().template cast<double>();
      moveTo(*object,
             makePose<S>(turn * Eigen::Quaterniond(rotation), turn * (scale * position) + shift));
    }
    manager->update();
  };
  const Eigen::Quaterniond none = Eigen::Quaterniond::Identity();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  for (int step = 0; step < 3; ++step) {
    apply(none, 0.5, Eigen::Vector3d::Zero());
    EXPECT_TRUE(answers<TypeParam>(*manager, scene)) << "contracted, " << step;
    apply(turn, 1, Eigen::Vector3d::Zero());
    EXPECT_TRUE(answers<TypeParam>(*manager, scene)) << "turned, " << step;
    apply(none, 3, Eigen::Vector3d::Zero());
    EXPECT_TRUE(answers<TypeParam>(*manager, scene)) << "expanded, " << step;
    apply(none, 1, Eigen::Vector3d(100, -300, 50));
    EXPECT_TRUE(answers<TypeParam>(*manager, scene)) << "shifted, " << step;
  }
}

// Objects that moved alone would be found where they were, or others would be lost.
TYPED_TEST(UpdateContract, UpdateOfOneObjectCounts) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = soupScene<S>(90, 0.8, 106);
  Random random(107);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  for (int step = 0; step < 40; ++step) {
    fcl::CollisionObject<S>* object = scene[random.below(scene.size())];
    jolt(*object, random, 0.7, 3);
    manager->update(object);
    EXPECT_TRUE(answers<TypeParam>(*manager, scene)) << "step " << step;
  }
}

// A list of moved objects would be taken too literally: empty, repeated and unmoved ones are
// normal.
TYPED_TEST(UpdateContract, UpdateOfAListAcceptsRepeatedAndUnmovedObjects) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(7, 13, 108);
  Random random(109);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  manager->update(std::vector<fcl::CollisionObject<S>*>{});
  EXPECT_TRUE(answers<TypeParam>(*manager, scene));
  for (int step = 0; step < 15; ++step) {
    std::vector<fcl::CollisionObject<S>*> list;
    for (int i = 0; i < 12; ++i) {
      fcl::CollisionObject<S>* object = scene[random.below(scene.size())];
      if (i % 3 != 0) jolt(*object, random, 0.4, 1);
      list.push_back(object);
      if (i % 4 == 0) list.push_back(object);
    }
    random.shuffle(list);
    manager->update(list);
    EXPECT_TRUE(answers<TypeParam>(*manager, scene)) << "step " << step;
  }
}

// A scene in which nothing moved would be answered differently.
TYPED_TEST(UpdateContract, UpdateWithoutMotionChangesNothing) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = curledScene<S>(80, 110);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  for (int step = 0; step < 5; ++step) {
    manager->update();
    EXPECT_TRUE(answers<TypeParam>(*manager, scene));
    manager->update(scene[3]);
    EXPECT_TRUE(answers<TypeParam>(*manager, scene));
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
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  EXPECT_TRUE(answers<TypeParam>(*manager, scene));
  for (const auto& [radius, length] :
       std::vector<std::pair<double, double>>{{0.2, 0.3}, {0.2, 1}, {0, 1}, {0, 0}, {0.1, 0.5}}) {
    capsule->radius = static_cast<S>(radius);
    capsule->lz = static_cast<S>(length);
    capsule->computeLocalAABB();
    for (fcl::CollisionObject<S>* object : scene.objects()) object->computeAABB();
    manager->update();
    EXPECT_TRUE(answers<TypeParam>(*manager, scene)) << radius << ", " << length;
  }
  // A shape of one object, and the update of that object alone.
  fcl::Capsule<S>& own = scene.capsule(5);
  own.radius = S(0.6);
  own.computeLocalAABB();
  scene[5]->computeAABB();
  manager->update(scene[5]);
  EXPECT_TRUE(answers<TypeParam>(*manager, scene));
}

// An object that moved and was not updated could not be taken out.
TYPED_TEST(UpdateContract, AnObjectMayMoveAndLeaveWithoutUpdate) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = soupScene<S>(40, 0.8, 113);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  std::vector<fcl::CollisionObject<S>*> left = scene.objects();
  for (const std::size_t i : std::initializer_list<std::size_t>{30, 20, 10, 0}) {
    translate(*scene[i], Eigen::Vector3d(10, 10, 10));
    manager->unregisterObject(scene[i]);
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(i));
    const PairOracle<S> oracle(left, rulesOf<TypeParam>({}));
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), left, kOrder<TypeParam>));
  }
}

// A coming and going between updates would leave the tree with leaves of another shape.
TYPED_TEST(UpdateContract, UpdatesAndRegistrationsMayAlternate) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(6, 12, 114);
  Random random(115);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  std::vector<fcl::CollisionObject<S>*> inside = scene.objects();
  for (int step = 0; step < 12; ++step) {
    const std::size_t i = random.below(inside.size());
    fcl::CollisionObject<S>* object = inside[i];
    manager->unregisterObject(object);
    inside.erase(inside.begin() + static_cast<std::ptrdiff_t>(i));
    for (fcl::CollisionObject<S>* other : inside) jolt(*other, random, 0.05, 0.2);
    manager->update();
    manager->registerObject(object);
    inside.push_back(object);
    const PairOracle<S> oracle(inside, rulesOf<TypeParam>({}));
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), inside, kOrder<TypeParam>)) << step;
  }
}

// The closest approach after a motion would be that of a frame ago.
TYPED_TEST(FiberUpdate, DistancesFollowMotions) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = soupScene<S>(60, 0.05, 116);
  Random random(117);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  for (int step = 0; step < 20; ++step) {
    for (fcl::CollisionObject<S>* object : scene.objects()) jolt(*object, random, 0.1, 0.5);
    manager->update();
    const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>({}));
    DistanceSearch<S> search(oracle);
    search.run(*manager);
    EXPECT_TRUE(search.keepsToTheRules());
    const S smallest = oracle.smallestDistance(scene.objects());
    if (smallest > 0) {
      EXPECT_EQ(search.result(), smallest);
    } else {
      EXPECT_LE(search.result(), 0);
    }
  }
}

// Motions far from the origin that are small against the offset would be lost, as FCL's tree does.
TYPED_TEST(FiberUpdate, TinyMotionsAtLargeOffsetsCount) {
  using S = typename TypeParam::Scalar;
  // One unit in the last place of the coordinates.
  const double offset = 0x1p17;
  const double step = offset * static_cast<double>(std::numeric_limits<S>::epsilon());
  Scene<S> scene;
  scene.addCapsule(makePose<S>(Eigen::Quaterniond::Identity(), {offset, offset, offset}), 1, 2);
  scene.addCapsule(makePose<S>(Eigen::Quaterniond::Identity(), {offset + 2 + step, offset, offset}),
                   1, 2);
  scene.addCapsule(makePose<S>(Eigen::Quaterniond::Identity(), {offset, offset + 40, offset}), 1,
                   2);
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  for (const FiberManagerOptions& chosen : {FiberManagerOptions{}, options}) {
    const auto manager = TypeParam::make(chosen);
    manager->registerObjects(scene.objects());
    manager->setup();
    for (int i = 0; i < 4; ++i) {
      // In steps that end with touching, then apart again.
      const double by = i % 2 == 0 ? -step : step;
      translate(*scene[1], {by, 0, 0});
      i < 2 ? manager->update(scene[1]) : manager->update({scene[1], scene[2]});
      EXPECT_TRUE(answers<TypeParam>(*manager, scene, chosen));
      if (i % 2 == 0) {
        EXPECT_EQ(selfPairs(*manager).size(), 1u) << describe(chosen);
      }
    }
  }
}

// Queries would read objects while another thread moves them for the next frame.
TYPED_TEST(FiberUpdate, ObjectsThatMoveCountWhereTheyWereUntilUpdate) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(7, 14, 118);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  const Calls<S> before = selfPairs(*manager);
  Random random(119);
  for (fcl::CollisionObject<S>* object : scene.objects()) jolt(*object, random, 1, 1);
  EXPECT_EQ(selfPairs(*manager), before);
  manager->setup();
  EXPECT_EQ(selfPairs(*manager), before);
  manager->update();
  EXPECT_TRUE(answers<TypeParam>(*manager, scene));
}

// A program that skips computeAABB() for capsules would be answered for where they were.
TYPED_TEST(FiberUpdate, CapsulesNeedNoComputeAABB) {
  using S = typename TypeParam::Scalar;
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.02)) {
    SCOPED_TRACE(describe(options));
    const Scene<S> scene = strandScene<S>(6, 10, 108);
    const auto manager = TypeParam::make(options);
    manager->registerObjects(scene.objects());
    manager->setup();
    Random random(109);
    const auto move = [&](fcl::CollisionObject<S>* object) {
      fcl::Transform3<S> pose = object->getTransform();
      pose.translation() += random.inCube(0.3).template cast<S>();
      object->setTransform(pose);
    };
    const auto expect_right = [&] {
      const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>(options));
      EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects()));
    };
    for (fcl::CollisionObject<S>* object : scene.objects()) move(object);
    manager->update();
    expect_right();
    move(scene[17]);
    manager->update(scene[17]);
    expect_right();
    const std::vector<fcl::CollisionObject<S>*> some = {scene[3], scene[30], scene[59]};
    for (fcl::CollisionObject<S>* object : some) move(object);
    manager->update(some);
    expect_right();
  }
}

// Objects that move between being registered and being set up, as MoveIt's do, would be left where
// they were created.
TYPED_TEST(FiberUpdate, TheFirstQueryAfterRegisteringReadsTheObjects) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(7, 14, 125);
  Random random(126);
  const auto move = [&](const std::vector<fcl::CollisionObject<S>*>& objects) {
    for (fcl::CollisionObject<S>* object : objects) jolt(*object, random, 1, 1);
  };
  const auto manager = TypeParam::make();
  for (const bool set_up : {false, true}) {
    SCOPED_TRACE(set_up ? "with setup()" : "without setup()");
    std::vector<fcl::CollisionObject<S>*> inside = scene.objects();
    const auto expectRead = [&](const char* when) {
      if (set_up) manager->setup();
      const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>({}));
      EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), inside)) << when;
      // From then on they count where they were until an update.
      std::vector<fcl::Transform3<S>> poses;
      for (fcl::CollisionObject<S>* object : inside) poses.push_back(object->getTransform());
      move(inside);
      EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), inside)) << when;
      for (std::size_t i = 0; i < inside.size(); ++i) moveTo(*inside[i], poses[i]);
    };
    manager->clear();
    manager->registerObjects(inside);
    move(inside);
    expectRead("all registered");

    // Many of them, and all are read.
    const std::vector<fcl::CollisionObject<S>*> many(inside.begin(), inside.begin() + 50);
    for (fcl::CollisionObject<S>* object : many) manager->unregisterObject(object);
    inside.erase(inside.begin(), inside.begin() + 50);
    manager->registerObjects(many);
    inside.insert(inside.end(), many.begin(), many.end());
    move(inside);
    expectRead("many registered");

    // Few of them, and these are read; the others count where they were, as in FCL's managers.
    manager->unregisterObject(inside[20]);
    manager->registerObject(inside[20]);
    std::rotate(inside.begin() + 20, inside.begin() + 21, inside.end());
    move({inside.back()});
    expectRead("one registered");
  }
}

// The sequence after updates would depend on addresses.
TYPED_TEST(FiberUpdate, TheSequenceAfterUpdatesDoesNotDependOnAddresses) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(7, 14, 120);
  const Scene<S> copy = scene.reallocated(121);
  std::vector<std::vector<std::pair<std::size_t, std::size_t>>> sequences;
  for (const Scene<S>* one : {&scene, &copy}) {
    const auto manager = TypeParam::make();
    manager->registerObjects(one->objects());
    Random random(122);
    for (int step = 0; step < 4; ++step) {
      for (fcl::CollisionObject<S>* object : one->objects()) jolt(*object, random, 0.2, 0.5);
      manager->update();
    }
    sequences.emplace_back();
    for (const auto& [a, b] : selfPairs(*manager)) {
      const auto number = [&](const fcl::CollisionObject<S>* object) {
        return static_cast<std::size_t>(
            std::find(one->objects().begin(), one->objects().end(), object) -
            one->objects().begin());
      };
      sequences.back().emplace_back(number(a), number(b));
    }
  }
  EXPECT_FALSE(sequences[0].empty());
  EXPECT_EQ(sequences[0], sequences[1]);
}

// A scene that begins as a point and spreads out would keep the bounds' first reference and scale.
TYPED_TEST(FiberUpdate, ASceneMayChangeItsSizeAndPlaceByOrders) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = soupScene<S>(60, 0.6, 123, {Eigen::Vector3d::Zero(), 1e-3});
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0)) {
    const auto manager = TypeParam::make(options);
    manager->registerObjects(scene.objects());
    manager->setup();
    EXPECT_TRUE(answers<TypeParam>(*manager, scene, options));
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
      EXPECT_TRUE(answers<TypeParam>(*manager, scene, options)) << power;
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::test
