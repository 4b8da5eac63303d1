// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <initializer_list>
#include <set>
#include <string>
#include <type_traits>
#include <vector>

#include "support/managed.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

MANAGER_SUITE(CollideContract, AllManagers);
MANAGER_SUITE(FiberCollide, FiberManagers);

// A simulation would miss contacts, treat some twice, or drown in pairs that are far apart.
TYPED_TEST(CollideContract, SelfCollisionReportsEachOverlappingPairOnce) {
  using S = typename TypeParam::Scalar;
  for (const NamedScene<S>& named : standardScenes<S>()) {
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(named.margin)) {
      SCOPED_TRACE(named.name + ", " + describe(options));
      EXPECT_TRUE(Managed<TypeParam>(named.scene, options).answersSelf());
    }
  }
}

// A tree of some number of leaves would have a hole: an empty node, a last child, a lone root.
TYPED_TEST(CollideContract, SelfCollisionIsRightForAnyNumberOfObjects) {
  for (std::size_t count = 0; count <= 75; ++count) {
    const auto scene = soupScene<typename TypeParam::Scalar>(count, 1.2, 100 + count);
    EXPECT_TRUE(Managed<TypeParam>(scene).answersSelf(count < 9 ? 0 : 1)) << count;
  }
}

// A tree of some number of fibers and segments would have a hole.
TYPED_TEST(CollideContract, SelfCollisionIsRightForAnyShapeOfBundle) {
  for (std::size_t fibers = 1; fibers <= 18; ++fibers) {
    for (const std::size_t segments : std::initializer_list<std::size_t>{1, 2, 3, 7, 8, 9, 17}) {
      const auto scene =
          strandScene<typename TypeParam::Scalar>(fibers, segments, fibers * 31 + segments);
      EXPECT_TRUE(Managed<TypeParam>(scene).answersSelf(segments > 1 ? 1 : 0))
          << fibers << " x " << segments;
    }
  }
}

// Probing a scene with a foreign object would miss what it touches.
TYPED_TEST(CollideContract, AnUnregisteredObjectMeetsEachPartnerOnce) {
  using S = typename TypeParam::Scalar;
  for (const NamedScene<S>& named : standardScenes<S>()) {
    // Where the scene is: copies of its own, shifted by a little, and one that meets nothing.
    Scene<S> probes;
    Random random(21);
    for (std::size_t i = 0; i < named.scene.size(); i += 11) {
      const auto& capsule =
          dynamic_cast<const fcl::Capsule<S>&>(*named.scene[i]->collisionGeometry());
      const double radius = static_cast<double>(capsule.radius);
      const double length = static_cast<double>(capsule.lz);
      auto* probe = probes.addCapsule(named.scene[i]->getTransform(), radius, length);
      jolt(*probe, random, radius + length / 2, 3);
    }
    const Eigen::Vector3d corner = named.scene[0]->getTranslation().template cast<double>();
    probes.addSphere(corner, 40 * named.margin);
    probes.addSphere(corner + Eigen::Vector3d::Constant(1e5 * named.margin), named.margin);
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(named.margin)) {
      SCOPED_TRACE(named.name + ", " + describe(options));
      Managed<TypeParam>(named.scene, options).expectAnswersWith(probes.objects());
    }
  }
}

// Two groups of fibers, each with its manager, would pass through each other; or small groups
// against large ones take a path of their own, and lose pairs there.
TYPED_TEST(CollideContract, AnotherManagerOfTheSameClassMeetsEachPairOnce) {
  using S = typename TypeParam::Scalar;
  const Scene<S> mine = strandScene<S>(9, 20, 31);
  std::vector<Scene<S>> others;
  others.push_back(soupScene<S>(20, 0.5, 33, {Eigen::Vector3d(100, 0, 0), 1}));
  others.push_back(curledScene<S>(130, 32, {Eigen::Vector3d(0.2, 0.1, -0.3), 1.5}));
  for (const std::size_t count : std::initializer_list<std::size_t>{0, 1, 2, 8}) {
    others.push_back(soupScene<S>(count, 1.5, 35 + count));
    others.back().addCapsule(Eigen::Vector3d(-1, 0, 0), Eigen::Vector3d(1, 0, 0), 0.3);
  }
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.02)) {
    const Managed<TypeParam> manager(mine, options);
    for (std::size_t i = 0; i < others.size(); ++i) {
      SCOPED_TRACE(describe(options) + ", scene " + std::to_string(i));
      const Managed<TypeParam> other(others[i], options);
      EXPECT_TRUE(manager.answersWith(other, i == 0 ? 0 : 1));
      EXPECT_TRUE(other.answersWith(manager, i == 0 ? 0 : 1));
    }
  }
}

// A program that starts without objects, or clears its scene, would crash or get pairs from
// nowhere.
TYPED_TEST(CollideContract, AnEmptyManagerAnswersEveryQuery) {
  const auto scene = soupScene<typename TypeParam::Scalar>(10, 1, 36);
  const Managed<TypeParam> empty, also_empty, filled(scene);
  for (const bool after_setup : {false, true}) {
    if (after_setup) empty->setup();
    EXPECT_TRUE(empty.answersSelf(0));
    EXPECT_TRUE(empty.answersWith(scene[0], 0));
    EXPECT_TRUE(empty.answersWith(also_empty, 0));
    EXPECT_TRUE(empty.answersWith(filled, 0));
    EXPECT_TRUE(filled.answersWith(empty, 0));
    empty.expectEveryPair();
    empty.expectEveryPair(scene[0]);
    empty.expectEveryPair(also_empty);
    empty.expectEveryPair(filled);
    filled.expectEveryPair(empty);
  }
  empty->update();
  EXPECT_TRUE(empty.answersSelf(0));
}

// Neighbours along a fiber, and beyond the ends of a closed one, would be reported, or others left
// out.
TYPED_TEST(FiberCollide, RulesOfFibersCountInEveryScene) {
  using S = typename TypeParam::Scalar;
  for (const NamedScene<S>& named : standardScenes<S>()) {
    for (const FiberManagerOptions& options : assortedOptions()) {
      SCOPED_TRACE(named.name + ", " + describe(options));
      Managed<TypeParam> manager(options);
      manager.registerFibers(named.scene);
      EXPECT_TRUE(manager.answersSelf());
      manager.expectAnswersWith(manager.every(13));
    }
  }
}

// An object would collide with itself, or a query for its partners would depend on how it is asked.
TYPED_TEST(FiberCollide, ARegisteredObjectMeetsItsPartnersOnceAndNeverItself) {
  using S = typename TypeParam::Scalar;
  for (const NamedScene<S>& named : standardScenes<S>()) {
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(named.margin)) {
      SCOPED_TRACE(named.name + ", " + describe(options));
      const Managed<TypeParam> manager(named.scene, options);
      manager.expectAnswersWith(manager.every(13));
    }
  }
}

// The manager of another program would be taken for one of ours: FCL's own do that, and crash.
TYPED_TEST(FiberCollide, AnyOtherManagerIsAnsweredThroughItsObjects) {
  using S = typename TypeParam::Scalar;
  const Scene<S> mine = strandScene<S>(8, 16, 41);
  const Scene<S> theirs = unequalScene<S>(42, {Eigen::Vector3d(0.1, -0.2, 0.1), 1.2});
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.02)) {
    const Managed<TypeParam> manager(mine, options);
    for (const auto& [name, other] : makeEachManager<S>(options)) {
      SCOPED_TRACE(name + ", " + describe(options));
      EXPECT_TRUE(pairsWith(*manager, *other).empty());
      other->registerObjects(theirs.objects());
      other->setup();
      EXPECT_TRUE(manager.answersWith({*other, theirs.objects()}));
    }
  }
}

// Two scenes kept relative to their own places would not find each other where they meet.
TYPED_TEST(FiberCollide, ManagersOfOtherPlacesAndSizesMeet) {
  using S = typename TypeParam::Scalar;
  Scene<S> mine = strandScene<S>(6, 12, 50);
  mine.addCapsule(Eigen::Vector3d(1e4, 0, 0), Eigen::Vector3d(1e4 + 1, 0, 0), 0.25);
  for (const double offset : {1.0, 1e2, 1e4}) {
    for (const double scale : {1e-3, 1.0, 1e2}) {
      // Most of the other scene is elsewhere, some of it here.
      Scene<S> theirs = soupScene<S>(40, 0.8, 51, {Eigen::Vector3d(offset, 0, 0), scale});
      Random random(52);
      for (int i = 0; i < 10; ++i) {
        const Eigen::Vector3d p = random.inCube(0.5);
        theirs.addCapsule(p, p + 0.3 * random.direction(), 0.02);
      }
      for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
        SCOPED_TRACE(std::to_string(offset) + ", " + std::to_string(scale) + ", " +
                     describe(options));
        const Managed<TypeParam> manager(mine, options), other(theirs, options);
        EXPECT_TRUE(manager.answersWith(other));
        EXPECT_TRUE(other.answersWith(manager));
      }
    }
  }
}

// A query against itself would report every object with itself and every pair twice, as FCL's does.
TYPED_TEST(FiberCollide, CollidingWithItselfIsTheSelfQuery) {
  const auto scene = curledScene<typename TypeParam::Scalar>(120, 43);
  const Managed<TypeParam> manager(scene);
  EXPECT_FALSE(selfPairs(*manager).empty());
  EXPECT_EQ(pairsWith(*manager, *manager), selfPairs(*manager));
}

// What two scenes share would be in contact with itself.
TYPED_TEST(FiberCollide, AnObjectInBothManagersDoesNotMeetItself) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(6, 12, 50);
  using Objects = std::vector<fcl::CollisionObject<S>*>;
  const Objects mine(scene.objects().begin(), scene.objects().begin() + 48);
  const Objects theirs(scene.objects().begin() + 24, scene.objects().end());
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.02)) {
    const Managed<TypeParam> manager(mine, options);
    const PairOracle<S> oracle = manager.oracle(theirs);
    for (const auto& [name, other] : makeEachManager<S>(options)) {
      SCOPED_TRACE(name + ", " + describe(options));
      other->registerObjects(theirs);
      const Calls<S> pairs = pairsWith(*manager, *other);
      EXPECT_FALSE(pairs.empty());
      for (const auto& [a, b] : pairs) EXPECT_NE(a, b);
      // Of two that are in both, each is the other's partner.
      EXPECT_EQ(std::set(pairs.begin(), pairs.end()).size(), pairs.size());
      DistanceSearch<S> search(oracle);
      search.lowers = false;
      search.run(*manager, *other);
      for (const auto& [a, b] : search.calls) EXPECT_NE(a, b);
      EXPECT_EQ(search.calls.size(), mine.size() * theirs.size() - 24);
    }
  }
}

// Objects far outside the range of the others' bounds would be lost: FLT_MAX is not the end of the
// world, nor are inf - inf and NaN distances.
TYPED_TEST(FiberCollide, ObjectsBeyondTheRangeOfBoundsAreFound) {
  using S = typename TypeParam::Scalar;
  // Squares of these still fit double.
  const double far = std::is_same_v<S, double> ? 1e60 : 1e30;
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
    SCOPED_TRACE(describe(options));
    Scene<S> scene = strandScene<S>(6, 12, 53, {Eigen::Vector3d::Zero(), 1e-9});
    for (const double x : {far, 1.001 * far, -far}) {
      scene.addCapsule(Eigen::Vector3d(x, 0, 0), Eigen::Vector3d(x, 0.1 * far, 0), 0.01 * far);
    }
    const Managed<TypeParam> manager(scene, options);
    // Everything is close together, measured by the whole scene: no pair is too many.
    EXPECT_TRUE(manager.answersSelf());
    manager.expectAnswersWith({scene.objects().end() - 3, scene.objects().end()});
    // One goes there and comes back.
    const fcl::Transform3<S> pose = scene[5]->getTransform();
    for (const fcl::Transform3<S>& place : {scene.objects().back()->getTransform(), pose}) {
      moveTo(*scene[5], place);
      manager->update(scene[5]);
      EXPECT_TRUE(manager.answersSelf());
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::test
