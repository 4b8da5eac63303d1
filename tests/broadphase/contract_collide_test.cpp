// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <memory>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "support/distance_search.h"
#include "support/managers_under_test.h"
#include "support/pair_oracle.h"
#include "support/pair_queries.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

template <typename S>
std::vector<fcl::CollisionObject<S>*> joined(const Scene<S>& a, const Scene<S>& b) {
  std::vector<fcl::CollisionObject<S>*> all = a.objects();
  all.insert(all.end(), b.objects().begin(), b.objects().end());
  return all;
}

template <typename Config>
class CollideContract : public testing::Test {};
TYPED_TEST_SUITE(CollideContract, AllManagers, ManagerNames);

template <typename Config>
class FiberCollide : public testing::Test {};
TYPED_TEST_SUITE(FiberCollide, FiberManagers, ManagerNames);

// A simulation would miss contacts, treat some twice, or drown in pairs that are far apart.
TYPED_TEST(CollideContract, SelfCollisionReportsEachOverlappingPairOnce) {
  using S = typename TypeParam::Scalar;
  for (const NamedScene<S>& named : standardScenes<S>()) {
    const auto& objects = named.scene.objects();
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(named.margin)) {
      SCOPED_TRACE(named.name + ", " + describe(options));
      const auto manager = TypeParam::make(options);
      manager->registerObjects(objects);
      manager->setup();
      const PairOracle<S> oracle(objects, rulesOf<TypeParam>(options));
      EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), objects, kOrder<TypeParam>));
    }
  }
}

// A tree of some number of leaves would have a hole: an empty node, a last child, a lone root.
TYPED_TEST(CollideContract, SelfCollisionIsRightForAnyNumberOfObjects) {
  using S = typename TypeParam::Scalar;
  for (std::size_t count = 0; count <= 75; ++count) {
    SCOPED_TRACE(count);
    const Scene<S> scene = soupScene<S>(count, 1.2, 100 + count);
    const auto manager = TypeParam::make();
    manager->registerObjects(scene.objects());
    manager->setup();
    const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>({}));
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects(), kOrder<TypeParam>));
  }
}

// A tree of some number of fibers and segments would have a hole.
TYPED_TEST(CollideContract, SelfCollisionIsRightForAnyShapeOfBundle) {
  using S = typename TypeParam::Scalar;
  for (std::size_t fibers = 1; fibers <= 18; ++fibers) {
    for (const std::size_t segments : std::initializer_list<std::size_t>{1, 2, 3, 7, 8, 9, 17}) {
      SCOPED_TRACE(std::to_string(fibers) + " x " + std::to_string(segments));
      const Scene<S> scene = strandScene<S>(fibers, segments, fibers * 31 + segments);
      const auto manager = TypeParam::make();
      manager->registerObjects(scene.objects());
      manager->setup();
      const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>({}));
      EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects(), kOrder<TypeParam>));
    }
  }
}

// Trees of more than a few levels would lose pairs.
TYPED_TEST(CollideContract, SelfCollisionIsRightInALargeScene) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(40, 50, 17);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>({}));
  EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects(), kOrder<TypeParam>));
}

// Probing a scene with a foreign object would miss what it touches.
TYPED_TEST(CollideContract, AnUnregisteredObjectMeetsEachPartnerOnce) {
  using S = typename TypeParam::Scalar;
  for (const NamedScene<S>& named : standardScenes<S>()) {
    const auto& objects = named.scene.objects();
    // Where the scene is: copies of its own, shifted by a little, and one that meets nothing.
    Scene<S> probes;
    Random random(21);
    for (std::size_t i = 0; i < named.scene.size(); i += 11) {
      const auto& capsule =
          dynamic_cast<const fcl::Capsule<S>&>(*named.scene[i]->collisionGeometry());
      const double size = 2 * static_cast<double>(capsule.radius) + static_cast<double>(capsule.lz);
      fcl::CollisionObject<S>* probe =
          probes.addCapsule(named.scene[i]->getTransform(), static_cast<double>(capsule.radius),
                            static_cast<double>(capsule.lz));
      jolt(*probe, random, size / 2, 3);
    }
    const Eigen::Vector3d corner = objects.front()->getTranslation().template cast<double>();
    probes.addSphere(corner, 40 * named.margin);
    probes.addSphere(corner + Eigen::Vector3d::Constant(1e5 * named.margin), named.margin);

    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(named.margin)) {
      SCOPED_TRACE(named.name + ", " + describe(options));
      const auto manager = TypeParam::make(options);
      manager->registerObjects(objects);
      manager->setup();
      for (fcl::CollisionObject<S>* probe : probes.objects()) {
        std::vector<fcl::CollisionObject<S>*> all = objects;
        all.push_back(probe);
        const PairOracle<S> oracle(all, rulesOf<TypeParam>(options));
        EXPECT_TRUE(oracle.answersBetween(pairsWith(*manager, *probe), objects, {probe},
                                          kOrder<TypeParam>));
      }
    }
  }
}

// Two groups of fibers, each with its manager, would pass through each other.
TYPED_TEST(CollideContract, AnotherManagerOfTheSameClassMeetsEachPairOnce) {
  using S = typename TypeParam::Scalar;
  const Placement beside{Eigen::Vector3d(0.2, 0.1, -0.3), 1.5};
  const Scene<S> mine = strandScene<S>(9, 20, 31);
  const Scene<S> theirs = curledScene<S>(130, 32, beside);
  const Scene<S> far_away = soupScene<S>(20, 0.5, 33, {Eigen::Vector3d(100, 0, 0), 1});
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.02)) {
    SCOPED_TRACE(describe(options));
    const auto manager = TypeParam::make(options);
    manager->registerObjects(mine.objects());
    manager->setup();
    for (const Scene<S>* scene : {&theirs, &far_away}) {
      const auto other = TypeParam::make(options);
      other->registerObjects(scene->objects());
      other->setup();
      const PairOracle<S> oracle(joined(mine, *scene), rulesOf<TypeParam>(options));
      EXPECT_TRUE(oracle.answersBetween(pairsWith(*manager, *other), mine.objects(),
                                        scene->objects(), kOrder<TypeParam>));
      EXPECT_TRUE(oracle.answersBetween(pairsWith(*other, *manager), scene->objects(),
                                        mine.objects(), kOrder<TypeParam>));
    }
  }
}

// Small groups against large ones would take a path of their own, and lose pairs there.
TYPED_TEST(CollideContract, ManagersOfVeryDifferentSizesMeet) {
  using S = typename TypeParam::Scalar;
  const Scene<S> large = soupScene<S>(200, 0.6, 34);
  const auto manager = TypeParam::make();
  manager->registerObjects(large.objects());
  manager->setup();
  for (const std::size_t count : std::initializer_list<std::size_t>{1, 2, 3, 9}) {
    SCOPED_TRACE(count);
    const Scene<S> small = soupScene<S>(count, 1.5, 35 + count);
    const auto other = TypeParam::make();
    other->registerObjects(small.objects());
    other->setup();
    const PairOracle<S> oracle(joined(large, small), rulesOf<TypeParam>({}));
    EXPECT_TRUE(oracle.answersBetween(pairsWith(*manager, *other), large.objects(), small.objects(),
                                      kOrder<TypeParam>));
    EXPECT_TRUE(oracle.answersBetween(pairsWith(*other, *manager), small.objects(), large.objects(),
                                      kOrder<TypeParam>));
  }
}

// A program that starts without objects, or clears its scene, would crash or get pairs from
// nowhere.
TYPED_TEST(CollideContract, AnEmptyManagerAnswersEveryQuery) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = soupScene<S>(10, 1, 36);
  const auto empty = TypeParam::make();
  const auto also_empty = TypeParam::make();
  const auto filled = TypeParam::make();
  filled->registerObjects(scene.objects());
  filled->setup();
  for (const bool after_setup : {false, true}) {
    if (after_setup) empty->setup();
    EXPECT_TRUE(selfPairs(*empty).empty());
    EXPECT_TRUE(pairsWith(*empty, *scene[0]).empty());
    EXPECT_TRUE(pairsWith(*empty, *also_empty).empty());
    EXPECT_TRUE(pairsWith(*empty, *filled).empty());
    EXPECT_TRUE(pairsWith(*filled, *empty).empty());
    EXPECT_TRUE(empty->empty());
    EXPECT_EQ(empty->size(), 0u);
    EXPECT_TRUE(objectsOf<S>(*empty).empty());
  }
  empty->update();
  EXPECT_TRUE(selfPairs(*empty).empty());
}

// A program that tries a query twice, or records and replays, would see another sequence.
TYPED_TEST(CollideContract, TheSameQueryGivesTheSameSequence) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(10, 15, 37);
  const Scene<S> others = soupScene<S>(40, 0.7, 38);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  const auto other = TypeParam::make();
  other->registerObjects(others.objects());
  other->setup();
  EXPECT_EQ(selfPairs(*manager), selfPairs(*manager));
  EXPECT_EQ(pairsWith(*manager, *others[3]), pairsWith(*manager, *others[3]));
  EXPECT_EQ(pairsWith(*manager, *other), pairsWith(*manager, *other));
}

// An object would collide with itself, or a query for its partners would depend on how it is asked.
TYPED_TEST(FiberCollide, ARegisteredObjectMeetsItsPartnersOnceAndNeverItself) {
  using S = typename TypeParam::Scalar;
  for (const NamedScene<S>& named : standardScenes<S>()) {
    const auto& objects = named.scene.objects();
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(named.margin)) {
      SCOPED_TRACE(named.name + ", " + describe(options));
      const auto manager = TypeParam::make(options);
      manager->registerObjects(objects);
      manager->setup();
      const PairOracle<S> oracle(objects, rulesOf<TypeParam>(options));
      for (std::size_t i = 0; i < objects.size(); i += 13) {
        EXPECT_TRUE(oracle.answersBetween(pairsWith(*manager, *objects[i]), objects, {objects[i]}));
      }
    }
  }
}

// The manager of another program would be taken for one of ours: FCL's own do that, and crash.
TYPED_TEST(FiberCollide, AnyOtherManagerIsAnsweredThroughItsObjects) {
  using S = typename TypeParam::Scalar;
  const Placement beside{Eigen::Vector3d(0.1, -0.2, 0.1), 1.2};
  const Scene<S> mine = strandScene<S>(8, 16, 41);
  const Scene<S> theirs = unequalScene<S>(42, beside);
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.02)) {
    const auto manager = TypeParam::make(options);
    manager->registerObjects(mine.objects());
    manager->setup();

    FiberManagerOptions bundle = options;
    bundle.topology = Topology::kBundle;
    FiberManagerOptions super_thread = options;
    super_thread.topology = Topology::kSuperThread;
    using Other = std::pair<std::string, std::unique_ptr<fcl::BroadPhaseCollisionManager<S>>>;
    std::vector<Other> others;
    others.emplace_back("boxes, bundle", makeLayeredAabbTree<S>(bundle));
    others.emplace_back("boxes, super thread", makeLayeredAabbTree<S>(super_thread));
    others.emplace_back("spheres, bundle", makeWrappedSphereTree<S>(bundle));
    others.emplace_back("spheres, super thread", makeWrappedSphereTree<S>(super_thread));
    for (auto& fcl_manager : makeFclManagers<S>()) others.push_back(std::move(fcl_manager));
    others.emplace_back(
        "foreign", std::make_unique<ForeignManager<S>>(std::vector<fcl::CollisionObject<S>*>()));
    const PairOracle<S> oracle(joined(mine, theirs), rulesOf<TypeParam>(options));
    for (const auto& [name, other] : others) {
      SCOPED_TRACE(name + ", " + describe(options));
      EXPECT_TRUE(pairsWith(*manager, *other).empty());
      other->registerObjects(theirs.objects());
      other->setup();
      EXPECT_TRUE(
          oracle.answersBetween(pairsWith(*manager, *other), mine.objects(), theirs.objects()));
    }
  }
}

// The other manager's options would leak into the answer of the one that was asked.
TYPED_TEST(FiberCollide, TheOptionsOfTheManagerThatIsAskedCount) {
  using S = typename TypeParam::Scalar;
  const Scene<S> mine = strandScene<S>(7, 14, 48);
  const Scene<S> theirs = soupScene<S>(60, 0.4, 49, {Eigen::Vector3d(0.2, 0.1, 0), 1.1});
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.04)) {
    const auto manager = TypeParam::make(options);
    manager->registerObjects(mine.objects());
    const PairOracle<S> oracle(joined(mine, theirs), rulesOf<TypeParam>(options));
    for (FiberManagerOptions others_options : optionsToTest<TypeParam>(0.3)) {
      SCOPED_TRACE(describe(options) + "; the other: " + describe(others_options));
      others_options.ignored_neighbors = 3;
      std::vector<std::unique_ptr<fcl::BroadPhaseCollisionManager<S>>> others;
      others.push_back(TypeParam::make(others_options));
      others.push_back(TypeParam::OtherTopology::make(others_options));
      others.push_back(makeLayeredAabbTree<S>(others_options));
      others.push_back(makeWrappedSphereTree<S>(others_options));
      for (const auto& other : others) {
        other->registerObjects(theirs.objects());
        EXPECT_TRUE(
            oracle.answersBetween(pairsWith(*manager, *other), mine.objects(), theirs.objects()));
      }
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
        const Eigen::Vector3d q = p + 0.3 * random.direction();
        theirs.addCapsule(p, q, 0.02);
      }
      for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
        SCOPED_TRACE(std::to_string(offset) + ", " + std::to_string(scale) + ", " +
                     describe(options));
        const PairOracle<S> oracle(joined(mine, theirs), rulesOf<TypeParam>(options));
        const auto manager = TypeParam::make(options);
        manager->registerObjects(mine.objects());
        const auto other = TypeParam::make(options);
        other->registerObjects(theirs.objects());
        EXPECT_TRUE(
            oracle.answersBetween(pairsWith(*manager, *other), mine.objects(), theirs.objects()));
        EXPECT_TRUE(
            oracle.answersBetween(pairsWith(*other, *manager), theirs.objects(), mine.objects()));
      }
    }
  }
}

// A query against itself would report every object with itself and every pair twice, as FCL's does.
TYPED_TEST(FiberCollide, CollidingWithItselfIsTheSelfQuery) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = curledScene<S>(120, 43);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  EXPECT_FALSE(selfPairs(*manager).empty());
  EXPECT_EQ(pairsWith(*manager, *manager), selfPairs(*manager));
}

// What two scenes share would be in contact with itself.
TYPED_TEST(FiberCollide, AnObjectInBothManagersDoesNotMeetItself) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(6, 12, 50);
  const auto& objects = scene.objects();
  using Objects = std::vector<fcl::CollisionObject<S>*>;
  const Objects mine(objects.begin(), objects.begin() + 48);
  const Objects theirs(objects.begin() + 24, objects.end());
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.02)) {
    const auto manager = TypeParam::make(options);
    manager->registerObjects(mine);
    FiberManagerOptions super_thread = options;
    super_thread.topology = Topology::kSuperThread;
    std::vector<std::unique_ptr<fcl::BroadPhaseCollisionManager<S>>> others;
    others.push_back(TypeParam::make(options));
    others.push_back(makeLayeredAabbTree<S>(super_thread));
    others.push_back(makeFclNaive<S>());
    const PairOracle<S> oracle(objects, rulesOf<TypeParam>(options));
    for (const auto& other : others) {
      SCOPED_TRACE(describe(options));
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

// The choice of topology would change answers, not only their speed.
TYPED_TEST(FiberCollide, BothTopologiesFindTheSamePairs) {
  using S = typename TypeParam::Scalar;
  for (const NamedScene<S>& named : standardScenes<S>()) {
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(named.margin)) {
      SCOPED_TRACE(named.name + ", " + describe(options));
      const auto one = TypeParam::make(options);
      const auto other = TypeParam::OtherTopology::make(options);
      one->registerObjects(named.scene.objects());
      other->registerObjects(named.scene.objects());
      Calls<S> pairs = selfPairs(*one);
      Calls<S> other_pairs = selfPairs(*other);
      std::sort(pairs.begin(), pairs.end());
      std::sort(other_pairs.begin(), other_pairs.end());
      EXPECT_EQ(pairs, other_pairs);
    }
  }
}

// Whoever forgets computeAABB after moving a capsule would get answers for where it was created.
TYPED_TEST(FiberCollide, CapsulesAndSpheresNeedNoComputeAABB) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(6, 10, 44);
  Scene<S> probe;
  probe.addSphere({50, 50, 50}, 0.4);
  probe.addCapsule(Eigen::Vector3d(50, 50, 50), Eigen::Vector3d(51, 50, 50), 0.1);
  for (std::size_t i = 0; i < scene.size(); i += 3) {
    fcl::Transform3<S> pose = scene[i]->getTransform();
    pose.translation() += fcl::Vector3<S>(S(0.25), 0, 0);
    scene[i]->setTransform(pose);
  }
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  const PairOracle<S> oracle(joined(scene, probe), rulesOf<TypeParam>({}));
  EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects()));
  for (fcl::CollisionObject<S>* object : probe.objects()) {
    object->setTranslation(scene[17]->getTranslation());
    const PairOracle<S> moved(joined(scene, probe), rulesOf<TypeParam>({}));
    const Calls<S> pairs = pairsWith(*manager, *object);
    EXPECT_FALSE(pairs.empty());
    EXPECT_TRUE(moved.answersBetween(pairs, scene.objects(), {object}));
  }
}

// Scenes in nanometres or light years would overflow or vanish in the products of the exact test.
TYPED_TEST(FiberCollide, AnswersHoldAtAnyScale) {
  using S = typename TypeParam::Scalar;
  const bool is_double = std::is_same_v<S, double>;
  for (const int power : {-100, -30, -12, 12, 30, 100}) {
    // Squares of such lengths are out of range in S at the far ends.
    if (!is_double && (power < -12 || power > 12)) continue;
    const Placement placement{Eigen::Vector3d::Zero(), std::pow(10.0, power)};
    const Scene<S> scene = unequalScene<S>(45, placement);
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03 * placement.scale)) {
      SCOPED_TRACE("10^" + std::to_string(power) + ", " + describe(options));
      const auto manager = TypeParam::make(options);
      manager->registerObjects(scene.objects());
      const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>(options));
      EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects()));
    }
  }
}

// Far from the origin, bounds in float would lose pairs, or report everything near everything.
TYPED_TEST(FiberCollide, AnswersHoldFarFromTheOrigin) {
  using S = typename TypeParam::Scalar;
  for (const double offset : {1e3, 1e4, 1e5, 1e6}) {
    const Placement placement{Eigen::Vector3d(offset, -offset / 3, offset / 7), 1};
    const Scene<S> scene = strandScene<S>(9, 14, 46, placement);
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
      SCOPED_TRACE("offset " + std::to_string(offset) + ", " + describe(options));
      const auto manager = TypeParam::make(options);
      manager->registerObjects(scene.objects());
      const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>(options));
      EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects()));
    }
  }
}

// One outlier far away would blur the bounds of all others into each other beyond what is stated,
// or its own until it is lost.
TYPED_TEST(FiberCollide, AnOutlierFarAwayCostsNoPair) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(9, 14, 47);
  scene.addCapsule(Eigen::Vector3d(1e5, 0, 0), Eigen::Vector3d(1e5 + 1, 0, 0), 0.5);
  scene.addCapsule(Eigen::Vector3d(1e5 + 1, 0.5, 0), Eigen::Vector3d(1e5 + 2, 0.5, 0), 0.5);
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
    SCOPED_TRACE(describe(options));
    const auto manager = TypeParam::make(options);
    manager->registerObjects(scene.objects());
    const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>(options));
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects()));
    fcl::CollisionObject<S>* outlier = scene.objects().back();
    EXPECT_TRUE(oracle.answersBetween(pairsWith(*manager, *outlier), scene.objects(), {outlier}));
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
    const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>(options));
    const auto manager = TypeParam::make(options);
    manager->registerObjects(scene.objects());
    // Everything is close together, measured by the whole scene: no pair is too many.
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects()));
    for (std::size_t i = scene.size() - 3; i < scene.size(); ++i) {
      EXPECT_TRUE(
          oracle.answersBetween(pairsWith(*manager, *scene[i]), scene.objects(), {scene[i]}));
    }
    // One goes there and comes back.
    const fcl::Transform3<S> pose = scene[5]->getTransform();
    moveTo(*scene[5], scene.objects().back()->getTransform());
    manager->update(scene[5]);
    const PairOracle<S> moved(scene.objects(), rulesOf<TypeParam>(options));
    EXPECT_TRUE(moved.answersSelf(selfPairs(*manager), scene.objects()));
    moveTo(*scene[5], pose);
    manager->update(scene[5]);
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects()));
  }
}

}  // namespace
}  // namespace fcl_fibers::test
