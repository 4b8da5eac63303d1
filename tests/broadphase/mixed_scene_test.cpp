// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <initializer_list>
#include <string>
#include <vector>

#include "support/distance_search.h"
#include "support/managers_under_test.h"
#include "support/pair_oracle.h"
#include "support/pair_queries.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

// One by one: FCL's tree crashes if it is given unbounded boxes at once.
template <typename S>
void registerEach(fcl::BroadPhaseCollisionManager<S>& manager, const Scene<S>& scene) {
  for (fcl::CollisionObject<S>* object : scene.objects()) manager.registerObject(object);
  manager.setup();
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

template <typename Config>
class MixedContract : public testing::Test {};
TYPED_TEST_SUITE(MixedContract, AllManagers, ManagerNames);

template <typename Config>
class FiberMixed : public testing::Test {};
TYPED_TEST_SUITE(FiberMixed, FiberManagers, ManagerNames);

// Hair would pass through the head.
TYPED_TEST(MixedContract, ShapesBesideFibersAreFound) {
  using S = typename TypeParam::Scalar;
  for (const std::size_t shapes : std::initializer_list<std::size_t>{1, 5, 40, 300}) {
    const Scene<S> scene = fibersAndShapes<S>(shapes, 161);
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
      SCOPED_TRACE(std::to_string(shapes) + " shapes, " + describe(options));
      const auto manager = TypeParam::make(options);
      manager->registerObjects(scene.objects());
      manager->setup();
      const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>(options));
      EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects(), kOrder<TypeParam>));
    }
  }
}

// The manager would need fibers to work at all.
TYPED_TEST(MixedContract, AManagerWithoutAnyFiberWorks) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  addShapes(scene, 120, 0.5, 162);
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
    SCOPED_TRACE(describe(options));
    const auto manager = TypeParam::make(options);
    manager->registerObjects(scene.objects());
    const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>(options));
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects(), kOrder<TypeParam>));
  }
}

// A floor, whose box is infinite, would break the tree or meet nothing.
TYPED_TEST(MixedContract, UnboundedShapesAreFound) {
  using S = typename TypeParam::Scalar;
  Scene<S> unbounded_only;
  addUnbounded(unbounded_only);
  Scene<S> scene = fibersAndShapes<S>(20, 163);
  addUnbounded(scene);
  scene.addCapsule(Eigen::Vector3d(0, 0, -2), Eigen::Vector3d(0, 1, -2), 0.1);
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
    for (const Scene<S>* one : {&scene, &unbounded_only}) {
      SCOPED_TRACE(describe(options));
      const auto manager = TypeParam::make(options);
      registerEach<S>(*manager, *one);
      const PairOracle<S> oracle(one->objects(), rulesOf<TypeParam>(options));
      EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), one->objects(), kOrder<TypeParam>));
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
  std::vector<fcl::CollisionObject<S>*> all = scene.objects();
  all.insert(all.end(), others.objects().begin(), others.objects().end());
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
    SCOPED_TRACE(describe(options));
    const PairOracle<S> oracle(all, rulesOf<TypeParam>(options));
    const auto manager = TypeParam::make(options);
    registerEach<S>(*manager, scene);
    const auto other = TypeParam::make(options);
    registerEach<S>(*other, others);
    for (fcl::CollisionObject<S>* probe : others.objects()) {
      EXPECT_TRUE(oracle.answersBetween(pairsWith(*manager, *probe), scene.objects(), {probe},
                                        kOrder<TypeParam>));
    }
    for (fcl::CollisionObject<S>* probe : scene.objects()) {
      EXPECT_TRUE(oracle.answersBetween(pairsWith(*other, *probe), others.objects(), {probe},
                                        kOrder<TypeParam>));
    }
    EXPECT_TRUE(oracle.answersBetween(pairsWith(*manager, *other), scene.objects(),
                                      others.objects(), kOrder<TypeParam>));
    EXPECT_TRUE(oracle.answersBetween(pairsWith(*other, *manager), others.objects(),
                                      scene.objects(), kOrder<TypeParam>));
  }
}

// A head that turns would be found where it was.
TYPED_TEST(MixedContract, ShapesMoveToo) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = fibersAndShapes<S>(40, 166);
  Random random(167);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  for (int step = 0; step < 8; ++step) {
    for (fcl::CollisionObject<S>* object : scene.objects()) jolt(*object, random, 0.2, 0.5);
    manager->update();
    const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>({}));
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects(), kOrder<TypeParam>));
  }
}

// Shapes that come and go would take fibers with them.
TYPED_TEST(FiberMixed, ShapesMayComeAndGo) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = fibersAndShapes<S>(15, 168);
  addUnbounded(scene);
  std::vector<fcl::CollisionObject<S>*> inside = scene.objects();
  const auto manager = TypeParam::make();
  manager->registerObjects(inside);
  Random random(169);
  for (int step = 0; step < 30; ++step) {
    const std::size_t i =
        step % 2 == 0 ? inside.size() - 1 - random.below(20) : random.below(inside.size());
    fcl::CollisionObject<S>* object = inside[i];
    inside.erase(inside.begin() + static_cast<std::ptrdiff_t>(i));
    manager->unregisterObject(object);
    const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>({}));
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), inside)) << "step " << step;
    manager->registerObject(object);
    inside.push_back(object);
  }
  EXPECT_EQ(objectsOf<S>(*manager), inside);
  manager->update();
  const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>({}));
  EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), inside));
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
    const auto manager = TypeParam::make(options);
    manager->registerObjects(scene.objects());
    const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>(options));
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects()));
    manager->update();
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects()));
    EXPECT_EQ(manager->selfCollisionStatistics().pairs, selfPairs(*manager).size());
    for (fcl::CollisionObject<S>* object : scene.objects()) {
      EXPECT_TRUE(oracle.answersBetween(pairsWith(*manager, *object), scene.objects(), {object}));
    }
  }
}

// A scene of nothing but unbounded shapes, or of one, has no box to build on.
TYPED_TEST(FiberMixed, AnUnboundedShapeMayBeAlone) {
  using S = typename TypeParam::Scalar;
  Scene<S> floor;
  floor.addHalfspace({0, 0, 1}, 0);
  const Scene<S> capsules = soupScene<S>(3, 1, 171);
  const auto manager = TypeParam::make();
  manager->registerObjects(floor.objects());
  EXPECT_TRUE(selfPairs(*manager).empty());
  EXPECT_TRUE(pairsWith(*manager, *floor[0]).empty());
  manager->registerObject(capsules[0]);
  std::vector<fcl::CollisionObject<S>*> all = floor.objects();
  all.push_back(capsules[0]);
  const PairOracle<S> oracle(all, rulesOf<TypeParam>({}));
  EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), all));
  manager->unregisterObject(capsules[0]);
  EXPECT_TRUE(selfPairs(*manager).empty());
}

// Distances between fibers and shapes would be wrong.
TYPED_TEST(FiberMixed, DistancesIncludeShapes) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  Random random(172);
  for (int i = 0; i < 64; ++i) {
    const Eigen::Vector3d center = Eigen::Vector3d(i % 4, i / 4 % 4, i / 16) + random.inCube(0.1);
    const Eigen::Vector3d half = 0.2 * random.direction();
    const Eigen::Quaterniond turn = random.rotation();
    const double size = random.between(0.1, 0.2);
    if (i % 6 == 0) {
      scene.addSphere(center, size);
    } else if (i % 6 == 1) {
      scene.addBox(center, turn, Eigen::Vector3d::Constant(size));
    } else if (i % 6 == 2) {
      scene.addMesh(center, size);
    } else if (i % 6 == 3) {
      scene.addOctree(center, size);
    } else if (i % 6 == 4) {
      scene.addConvex(center, size);
    } else {
      scene.addCapsule(center - half, center + half, 0.02);
    }
  }
  for (const bool floor : {false, true}) {
    if (floor) scene.addHalfspace({0, 0, 1}, -0.5);
    const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>({}));
    const S smallest = oracle.smallestDistance(scene.objects());
    ASSERT_GT(smallest, 0);
    const auto manager = TypeParam::make();
    manager->registerObjects(scene.objects());
    DistanceSearch<S> search(oracle);
    search.run(*manager);
    EXPECT_TRUE(search.keepsToTheRules());
    EXPECT_EQ(search.result(), smallest);

    DistanceSearch<S> all(oracle);
    all.lowers = false;
    all.run(*manager);
    EXPECT_TRUE(all.keepsToTheRules());
    EXPECT_EQ(all.calls.size(), oracle.pairCount(scene.objects()));

    for (fcl::CollisionObject<S>* object : scene.objects()) {
      DistanceSearch<S> one(oracle);
      one.run(*manager, *object);
      EXPECT_TRUE(one.keepsToTheRules());
      EXPECT_EQ(one.result(), oracle.smallestDistance(scene.objects(), {object}));
      // And not boxes that an octree was taken apart into.
      for (const auto& call : one.calls) EXPECT_EQ(call.second, object);
    }
  }
}

// Once a contact was found, everything would be tried against the floor all the same.
TYPED_TEST(FiberMixed, NoUnboundedShapeIsVisitedOnceTheDistanceIsZero) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(4, 8, 173);
  scene.addHalfspace({0, 0, 1}, 0);
  const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>({}));
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  DistanceSearch<S> search(oracle);
  search.run(*manager);
  EXPECT_LE(search.result(), 0);
  for (std::size_t i = 0; i + 1 < search.left.size(); ++i) EXPECT_GT(search.left[i], 0);
}

// A sphere beside the fibers would count by FCL's box of it, a cube when turned.
TYPED_TEST(FiberMixed, ASphereIsACapsuleOfLengthZero) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  scene.addSphere({0, 0, 0}, 1);
  scene.addCapsule(Eigen::Vector3d(0.75, 0.75, -1), Eigen::Vector3d(0.75, 0.75, 1), 0.03125);
  scene.addSphere({2, 0, 0}, 1);
  scene.addSphere({1.25, 1.25, 0}, 0.5);
  moveTo(*scene[0], makePose<S>(Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitX())),
                                {0, 0, 0}));
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.0625)) {
    SCOPED_TRACE(describe(options));
    const auto manager = TypeParam::make(options);
    manager->registerObjects(scene.objects());
    const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>(options));
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects()));
  }
}

}  // namespace
}  // namespace fcl_fibers::test
