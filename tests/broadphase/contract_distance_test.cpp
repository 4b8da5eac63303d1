// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "support/distance_search.h"
#include "support/managers_under_test.h"
#include "support/pair_oracle.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

template <typename S>
std::vector<fcl::CollisionObject<S>*> joined(const Scene<S>& a, const Scene<S>& b) {
  std::vector<fcl::CollisionObject<S>*> all = a.objects();
  all.insert(all.end(), b.objects().begin(), b.objects().end());
  return all;
}

// Capsules well apart from each other: on a grid, turned and moved by less than the gaps.
template <typename S>
Scene<S> apartScene(int side, std::uint64_t seed, const Placement& placement = {}) {
  Random random(seed);
  Scene<S> scene;
  for (int i = 0; i < side * side * side; ++i) {
    const Eigen::Vector3d cell(i % side, i / side % side, i / side / side);
    const Eigen::Vector3d center = cell + random.inCube(0.15);
    const Eigen::Vector3d half = random.between(0, 0.25) * random.direction();
    scene.addCapsule(placement.origin + placement.scale * (center - half),
                     placement.origin + placement.scale * (center + half),
                     placement.scale * random.between(0, 0.05));
  }
  return scene;
}

// Ours prunes by true lower bounds only, so that its answer is the smallest distance to the last
// bit. FCL rounds its boxes to nearest.
template <typename Config, typename S>
void expectFound(S found, S smallest, const PairOracle<S>& oracle) {
  if (Config::kIsFiberManager) {
    EXPECT_EQ(found, smallest);
  } else {
    const Real band = 16 * std::numeric_limits<S>::epsilon() * oracle.largestCoordinate();
    EXPECT_NEAR(found, smallest, static_cast<double>(band));
  }
}

template <typename Config>
class DistanceContract : public testing::Test {};
TYPED_TEST_SUITE(DistanceContract, AllManagers, ManagerNames);

template <typename Config>
class FiberDistance : public testing::Test {};
TYPED_TEST_SUITE(FiberDistance, FiberManagers, ManagerNames);

// The closest approach in a scene would be missed.
TYPED_TEST(DistanceContract, SelfDistanceIsTheSmallestOverAllPairs) {
  using S = typename TypeParam::Scalar;
  const Placement far{Eigen::Vector3d(1e4, -1e4, 3e3), 1};
  const Placement tiny{Eigen::Vector3d::Zero(), 1e-5};
  for (const Placement& placement : {Placement{}, far, tiny}) {
    const Scene<S> scene = apartScene<S>(5, 51, placement);
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.02 * placement.scale)) {
      SCOPED_TRACE(describe(options) + ", scale " + std::to_string(placement.scale));
      const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>(options));
      const auto manager = TypeParam::make(options);
      manager->registerObjects(scene.objects());
      manager->setup();
      DistanceSearch<S> search(oracle);
      search.run(*manager);
      EXPECT_TRUE(search.keepsToTheRules());
      expectFound<TypeParam>(search.result(), oracle.smallestDistance(scene.objects()), oracle);
    }
  }
}

// The closest approach would depend on the number of objects: a hole in a tree.
TYPED_TEST(DistanceContract, SelfDistanceIsRightForAnyNumberOfObjects) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = apartScene<S>(4, 52);
  for (std::size_t count = 0; count <= scene.size(); ++count) {
    SCOPED_TRACE(count);
    const std::vector<fcl::CollisionObject<S>*> objects(
        scene.objects().begin(), scene.objects().begin() + static_cast<std::ptrdiff_t>(count));
    const PairOracle<S> oracle(objects, rulesOf<TypeParam>({}));
    const auto manager = TypeParam::make();
    manager->registerObjects(objects);
    manager->setup();
    DistanceSearch<S> search(oracle);
    search.run(*manager);
    EXPECT_TRUE(search.keepsToTheRules());
    expectFound<TypeParam>(search.result(), oracle.smallestDistance(objects), oracle);
  }
}

// The distance of a foreign object from the scene would be wrong.
TYPED_TEST(DistanceContract, DistanceOfAnUnregisteredObjectIsTheSmallest) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = apartScene<S>(5, 53);
  Scene<S> probes;
  Random random(54);
  for (int i = 0; i < 12; ++i) {
    const Eigen::Vector3d p = Eigen::Vector3d(2, 2, 2) + random.inCube(4);
    const Eigen::Vector3d q = p + 0.5 * random.direction();
    if (i % 3 == 0) {
      probes.addSphere(p, 0.1);
    } else {
      probes.addCapsule(p, q, 0.02);
    }
  }
  probes.addSphere({500, 600, -700}, 1);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  const PairOracle<S> oracle(joined(scene, probes), rulesOf<TypeParam>({}));
  for (fcl::CollisionObject<S>* probe : probes.objects()) {
    const S smallest = oracle.smallestDistance(scene.objects(), {probe});
    DistanceSearch<S> search(oracle);
    search.run(*manager, *probe);
    EXPECT_TRUE(search.keepsToTheRules());
    for (const auto& [managed, other] : search.calls) {
      EXPECT_EQ(other, probe);
      EXPECT_NE(managed, probe);
    }
    if (smallest > 0) {
      expectFound<TypeParam>(search.result(), smallest, oracle);
    } else {
      EXPECT_LE(search.result(), 0);
    }
  }
}

// The distance between two groups of fibers would be wrong.
TYPED_TEST(DistanceContract, DistanceOfAnotherManagerOfTheSameClassIsTheSmallest) {
  using S = typename TypeParam::Scalar;
  const Scene<S> mine = apartScene<S>(5, 55);
  for (const double x : {0.5, 4.7, 30.0}) {
    SCOPED_TRACE(x);
    const Scene<S> theirs = apartScene<S>(3, 56, {Eigen::Vector3d(x, 0.5, 0.5), 1});
    const PairOracle<S> oracle(joined(mine, theirs), rulesOf<TypeParam>({}));
    const auto manager = TypeParam::make();
    manager->registerObjects(mine.objects());
    manager->setup();
    const auto other = TypeParam::make();
    other->registerObjects(theirs.objects());
    other->setup();
    DistanceSearch<S> search(oracle);
    search.run(*manager, *other);
    EXPECT_TRUE(search.keepsToTheRules());
    const S smallest = oracle.smallestDistance(mine.objects(), theirs.objects());
    if (smallest > 0) {
      expectFound<TypeParam>(search.result(), smallest, oracle);
    } else {
      EXPECT_LE(search.result(), 0);
    }
    DistanceSearch<S> back(oracle);
    back.run(*other, *manager);
    EXPECT_TRUE(back.keepsToTheRules());
    expectFound<TypeParam>(back.result(), search.result(), oracle);
  }
}

// A callback that only collects would run for ever, as with four of FCL's managers, or miss pairs.
TYPED_TEST(DistanceContract, ACallbackThatLowersNothingSeesEveryPairOnce) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = soupScene<S>(60, 0.5, 57);
  const Scene<S> others = soupScene<S>(7, 0.5, 58, {Eigen::Vector3d(3, 0, 0), 1});
  const PairOracle<S> oracle(joined(scene, others), rulesOf<TypeParam>({}));
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  const auto other = TypeParam::make();
  other->registerObjects(others.objects());
  other->setup();

  DistanceSearch<S> self(oracle);
  self.lowers = false;
  self.run(*manager);
  EXPECT_TRUE(self.keepsToTheRules());
  EXPECT_EQ(self.calls.size(), scene.size() * (scene.size() - 1) / 2);

  DistanceSearch<S> one(oracle);
  one.lowers = false;
  one.run(*manager, *others[0]);
  EXPECT_TRUE(one.keepsToTheRules());
  EXPECT_EQ(one.calls.size(), scene.size());

  DistanceSearch<S> both(oracle);
  both.lowers = false;
  both.run(*manager, *other);
  EXPECT_TRUE(both.keepsToTheRules());
  EXPECT_EQ(both.calls.size(), scene.size() * others.size());
}

// A program without objects would crash when it asks for distances.
TYPED_TEST(DistanceContract, AnEmptyManagerAnswersEveryQuery) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = soupScene<S>(5, 1, 59);
  const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>({}));
  const auto empty = TypeParam::make();
  const auto also_empty = TypeParam::make();
  const auto filled = TypeParam::make();
  filled->registerObjects(scene.objects());
  filled->setup();
  DistanceSearch<S> search(oracle);
  search.run(*empty);
  search.run(*empty, *scene[0]);
  search.run(*empty, *also_empty);
  search.run(*empty, *filled);
  search.run(*filled, *empty);
  EXPECT_TRUE(search.calls.empty());
}

// A program that tries a query twice, or records and replays, would see another sequence.
TYPED_TEST(DistanceContract, TheSameQueryGivesTheSameSequence) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = apartScene<S>(4, 60);
  const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>({}));
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  DistanceSearch<S> first(oracle);
  first.run(*manager);
  DistanceSearch<S> second(oracle);
  second.run(*manager);
  EXPECT_EQ(first.calls, second.calls);
}

// After a contact was found, a search would go on over everything that touches.
TYPED_TEST(FiberDistance, NothingIsVisitedOnceTheDistanceIsZero) {
  using S = typename TypeParam::Scalar;
  for (const NamedScene<S>& named : standardScenes<S>()) {
    SCOPED_TRACE(named.name);
    const auto& objects = named.scene.objects();
    const PairOracle<S> oracle(objects, rulesOf<TypeParam>({}));
    const auto manager = TypeParam::make();
    manager->registerObjects(objects);
    DistanceSearch<S> search(oracle);
    search.run(*manager);
    EXPECT_TRUE(search.keepsToTheRules());
    const S smallest = oracle.smallestDistance(objects);
    if (smallest > 0) {
      EXPECT_EQ(search.result(), smallest);
      continue;
    }
    EXPECT_LE(search.result(), 0);
    for (std::size_t i = 0; i + 1 < search.left.size(); ++i) EXPECT_GT(search.left[i], 0);
  }
}

// A registered object would be at distance zero from itself, and so from everything.
TYPED_TEST(FiberDistance, DistanceOfARegisteredObjectIsThatToTheOthers) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = apartScene<S>(4, 61);
  const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>({}));
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  for (fcl::CollisionObject<S>* object : scene.objects()) {
    DistanceSearch<S> search(oracle);
    search.run(*manager, *object);
    EXPECT_TRUE(search.keepsToTheRules());
    EXPECT_EQ(search.result(), oracle.smallestDistance(scene.objects(), {object}));
    for (const auto& call : search.calls) EXPECT_EQ(call.second, object);
  }
}

// The earlier registered object would come second.
TYPED_TEST(FiberDistance, ArgumentsComeInOrderOfRegistration) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = apartScene<S>(4, 62);
  // Registered in another order than that of space.
  std::vector<fcl::CollisionObject<S>*> objects = scene.objects();
  Random random(63);
  random.shuffle(objects);
  const PairOracle<S> oracle(objects, rulesOf<TypeParam>({}));
  const auto manager = TypeParam::make();
  manager->registerObjects(objects);
  DistanceSearch<S> search(oracle);
  search.lowers = false;
  search.run(*manager);
  for (const auto& [a, b] : search.calls) {
    EXPECT_LT(std::find(objects.begin(), objects.end(), a),
              std::find(objects.begin(), objects.end(), b));
  }
}

// The manager of another program would be taken for one of ours.
TYPED_TEST(FiberDistance, AnyOtherManagerIsAnsweredThroughItsObjects) {
  using S = typename TypeParam::Scalar;
  const Scene<S> mine = apartScene<S>(4, 64);
  const Scene<S> theirs = apartScene<S>(3, 65, {Eigen::Vector3d(3.9, 0.4, 0.2), 1});
  const PairOracle<S> oracle(joined(mine, theirs), rulesOf<TypeParam>({}));
  const S smallest = oracle.smallestDistance(mine.objects(), theirs.objects());
  ASSERT_GT(smallest, 0);
  const auto manager = TypeParam::make();
  manager->registerObjects(mine.objects());

  std::vector<std::unique_ptr<fcl::BroadPhaseCollisionManager<S>>> others;
  FiberManagerOptions super_thread;
  super_thread.topology = Topology::kSuperThread;
  others.push_back(makeLayeredAabbTree<S>({}));
  others.push_back(makeLayeredAabbTree<S>(super_thread));
  others.push_back(makeWrappedSphereTree<S>({}));
  others.push_back(makeWrappedSphereTree<S>(super_thread));
  for (auto& [name, fcl_manager] : makeFclManagers<S>()) others.push_back(std::move(fcl_manager));
  others.push_back(std::make_unique<ForeignManager<S>>(std::vector<fcl::CollisionObject<S>*>()));
  for (std::size_t i = 0; i < others.size(); ++i) {
    SCOPED_TRACE(i);
    DistanceSearch<S> none(oracle);
    none.run(*manager, *others[i]);
    EXPECT_TRUE(none.calls.empty());

    others[i]->registerObjects(theirs.objects());
    others[i]->setup();
    DistanceSearch<S> search(oracle);
    search.run(*manager, *others[i]);
    EXPECT_TRUE(search.keepsToTheRules());
    EXPECT_EQ(search.result(), smallest);
    for (const auto& call : search.calls) {
      EXPECT_NE(std::find(mine.objects().begin(), mine.objects().end(), call.first),
                mine.objects().end());
    }

    DistanceSearch<S> all(oracle);
    all.lowers = false;
    all.run(*manager, *others[i]);
    EXPECT_TRUE(all.keepsToTheRules());
    EXPECT_EQ(all.calls.size(), mine.size() * theirs.size());
  }
}

// A query against itself would find distance zero, of an object from itself.
TYPED_TEST(FiberDistance, DistanceToItselfIsTheSelfQuery) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = apartScene<S>(4, 66);
  const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>({}));
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  DistanceSearch<S> self(oracle);
  self.run(*manager);
  DistanceSearch<S> same(oracle);
  same.run(*manager, *manager);
  EXPECT_EQ(self.calls, same.calls);
  EXPECT_EQ(self.result(), same.result());
}

// Margins, or the choice of what is reported, would leak into distances: FCL knows neither.
TYPED_TEST(FiberDistance, MarginAndReportDoNotShow) {
  using S = typename TypeParam::Scalar;
  const Scene<S> mine = apartScene<S>(4, 68);
  const Scene<S> theirs = apartScene<S>(3, 69, {Eigen::Vector3d(3.95, 0.5, 0.4), 1});
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.3)) {
    SCOPED_TRACE(describe(options));
    const PairOracle<S> oracle(joined(mine, theirs), rulesOf<TypeParam>(options));
    const auto manager = TypeParam::make(options);
    manager->registerObjects(mine.objects());
    const auto expect_found = [&](S smallest, auto run) {
      ASSERT_GT(smallest, 0);
      DistanceSearch<S> search(oracle);
      run(search);
      EXPECT_TRUE(search.keepsToTheRules());
      EXPECT_EQ(search.result(), smallest);
    };
    expect_found(oracle.smallestDistance(mine.objects()),
                 [&](auto& search) { search.run(*manager); });
    for (fcl::CollisionObject<S>* object : theirs.objects()) {
      expect_found(oracle.smallestDistance(mine.objects(), {object}),
                   [&](auto& search) { search.run(*manager, *object); });
    }
    for (const double margin : {0.0, 0.1, 0.5}) {
      FiberManagerOptions other_options = options;
      other_options.margin = margin;
      const auto other = TypeParam::make(other_options);
      other->registerObjects(theirs.objects());
      expect_found(oracle.smallestDistance(mine.objects(), theirs.objects()),
                   [&](auto& search) { search.run(*manager, *other); });
    }
  }
}

// A query that meets nothing, of no size, would search for ever, as with four of FCL's managers.
TYPED_TEST(DistanceContract, AQueryOfNoSizeThatMeetsNothingEnds) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  scene.addSphere({1, 2, 3}, 0);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  Scene<S> probes;
  probes.addSphere({5, 5, 5}, 0);
  probes.addCapsule(Eigen::Vector3d(-4, 0, 0), Eigen::Vector3d(-4, 0, 0), 0);
  const PairOracle<S> oracle(joined(scene, probes), rulesOf<TypeParam>({}));
  DistanceSearch<S> alone(oracle);
  alone.run(*manager);
  EXPECT_TRUE(alone.calls.empty());
  for (fcl::CollisionObject<S>* probe : probes.objects()) {
    DistanceSearch<S> search(oracle);
    search.run(*manager, *probe);
    EXPECT_EQ(search.calls.size(), 1u);
    EXPECT_EQ(search.result(), oracle.distance(scene[0], probe));
  }
}

// A search would not prune: as slow as visiting every pair.
TYPED_TEST(FiberDistance, ASearchVisitsFewPairs) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = apartScene<S>(8, 67);
  const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>({}));
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  DistanceSearch<S> search(oracle);
  search.run(*manager);
  EXPECT_LT(search.calls.size(), oracle.pairCount(scene.objects()) / 10);
}

}  // namespace
}  // namespace fcl_fibers::test
