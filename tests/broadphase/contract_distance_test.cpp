// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/managed.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

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

MANAGER_SUITE(DistanceContract, AllManagers);
MANAGER_SUITE(FiberDistance, FiberManagers);

// The closest approach in a scene would be missed.
TYPED_TEST(DistanceContract, SelfDistanceIsTheSmallestOverAllPairs) {
  const Placement far{Eigen::Vector3d(1e4, -1e4, 3e3), 1};
  const Placement tiny{Eigen::Vector3d::Zero(), 1e-5};
  for (const Placement& placement : {Placement{}, far, tiny}) {
    const auto scene = apartScene<typename TypeParam::Scalar>(5, 51, placement);
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.02 * placement.scale)) {
      SCOPED_TRACE(describe(options) + ", scale " + std::to_string(placement.scale));
      EXPECT_GT(Managed<TypeParam>(scene, options).expectNearest(), 0);
    }
  }
}

// The closest approach would depend on the number of objects: a hole in a tree.
TYPED_TEST(DistanceContract, SelfDistanceIsRightForAnyNumberOfObjects) {
  const auto scene = apartScene<typename TypeParam::Scalar>(4, 52);
  std::vector<fcl::CollisionObject<typename TypeParam::Scalar>*> objects;
  for (std::size_t count = 0; count <= scene.size(); ++count) {
    SCOPED_TRACE(count);
    EXPECT_GT(Managed<TypeParam>(objects).expectNearest(), 0);
    if (count < scene.size()) objects.push_back(scene[count]);
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
    i % 3 == 0 ? probes.addSphere(p, 0.1) : probes.addCapsule(p, q, 0.02);
  }
  probes.addSphere({500, 600, -700}, 1);
  const Managed<TypeParam> manager(scene);
  for (auto* probe : probes.objects()) manager.expectNearest(probe);
}

// The distance between two groups of fibers would be wrong.
TYPED_TEST(DistanceContract, DistanceOfAnotherManagerOfTheSameClassIsTheSmallest) {
  using S = typename TypeParam::Scalar;
  const Scene<S> mine = apartScene<S>(5, 55);
  for (const double x : {0.5, 4.7, 30.0}) {
    SCOPED_TRACE(x);
    const Scene<S> theirs = apartScene<S>(3, 56, {Eigen::Vector3d(x, 0.5, 0.5), 1});
    const Managed<TypeParam> manager(mine), other(theirs);
    manager.expectNearest(other);
    other.expectNearest(manager);
  }
}

// A callback that only collects would run for ever, as with four of FCL's managers, or miss pairs.
TYPED_TEST(DistanceContract, ACallbackThatLowersNothingSeesEveryPairOnce) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = soupScene<S>(60, 0.5, 57);
  const Scene<S> others = soupScene<S>(7, 0.5, 58, {Eigen::Vector3d(3, 0, 0), 1});
  const Managed<TypeParam> manager(scene), other(others);
  manager.expectEveryPair();
  manager.expectEveryPair(others[0]);
  manager.expectEveryPair(other);
}

// After a contact was found, a search would go on over everything that touches.
TYPED_TEST(FiberDistance, NothingIsVisitedOnceTheDistanceIsZero) {
  using S = typename TypeParam::Scalar;
  int touching = 0;
  for (const NamedScene<S>& named : standardScenes<S>()) {
    SCOPED_TRACE(named.name);
    touching += Managed<TypeParam>(named.scene).expectNearest() <= 0;
  }
  EXPECT_GT(touching, 5);
}

// The nearest would be a neighbour along the fiber, or beyond the ends of a closed one.
TYPED_TEST(FiberDistance, RulesOfFibersCount) {
  const auto scene = ringScene<typename TypeParam::Scalar>(3, 24, 67);
  for (const FiberManagerOptions& options : assortedOptions()) {
    SCOPED_TRACE(describe(options));
    Managed<TypeParam> manager(options);
    manager.registerFibers(scene);
    manager.expectNearest();
    manager.expectEveryPair();
    for (auto* object : manager.every(17)) manager.expectNearest(object);
  }
}

// A registered object would be at distance zero from itself, and so from everything.
TYPED_TEST(FiberDistance, DistanceOfARegisteredObjectIsThatToTheOthers) {
  const auto scene = apartScene<typename TypeParam::Scalar>(4, 61);
  const Managed<TypeParam> manager(scene);
  for (auto* object : scene.objects()) EXPECT_GT(manager.expectNearest(object), 0);
}

// The earlier registered object would come second.
TYPED_TEST(FiberDistance, ArgumentsComeInOrderOfRegistration) {
  const auto scene = apartScene<typename TypeParam::Scalar>(4, 62);
  // Registered in another order than that of space.
  auto objects = scene.objects();
  Random random(63);
  random.shuffle(objects);
  Managed<TypeParam>(objects).expectEveryPair();
}

// The manager of another program would be taken for one of ours.
TYPED_TEST(FiberDistance, AnyOtherManagerIsAnsweredThroughItsObjects) {
  using S = typename TypeParam::Scalar;
  const Scene<S> mine = apartScene<S>(4, 64);
  const Scene<S> theirs = apartScene<S>(3, 65, {Eigen::Vector3d(3.9, 0.4, 0.2), 1});
  const Managed<TypeParam> manager(mine);
  for (const auto& [name, other] : makeEachManager<S>()) {
    SCOPED_TRACE(name);
    manager.expectEveryPair({*other, {}});
    other->registerObjects(theirs.objects());
    other->setup();
    EXPECT_GT(manager.expectNearest({*other, theirs.objects()}), 0);
    manager.expectEveryPair({*other, theirs.objects()});
  }
}

// A query against itself would find distance zero, of an object from itself; or a query that is
// repeated would see another sequence.
TYPED_TEST(FiberDistance, DistanceToItselfIsTheSelfQuery) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = apartScene<S>(4, 66);
  const Managed<TypeParam> manager(scene);
  const PairOracle<S> oracle = manager.oracle();
  DistanceSearch<S> self(oracle), again(oracle), same(oracle);
  self.run(*manager);
  again.run(*manager);
  same.run(*manager, *manager);
  EXPECT_EQ(self.calls, again.calls);
  EXPECT_EQ(self.calls, same.calls);
  EXPECT_EQ(self.result(), manager.expectNearest());
}

// Margins, or the choice of what is reported, would leak into distances: FCL knows neither.
TYPED_TEST(FiberDistance, MarginAndReportDoNotShow) {
  using S = typename TypeParam::Scalar;
  const Scene<S> mine = apartScene<S>(4, 68);
  const Scene<S> theirs = apartScene<S>(3, 69, {Eigen::Vector3d(3.95, 0.5, 0.4), 1});
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.3)) {
    SCOPED_TRACE(describe(options));
    const Managed<TypeParam> manager(mine, options);
    EXPECT_GT(manager.expectNearest(), 0);
    for (auto* object : theirs.objects()) EXPECT_GT(manager.expectNearest(object), 0);
    for (const double margin : {0.0, 0.1, 0.5}) {
      FiberManagerOptions other_options = options;
      other_options.margin = margin;
      EXPECT_GT(manager.expectNearest(Managed<TypeParam>(theirs, other_options)), 0);
    }
  }
}

// A query that meets nothing, of no size, would search for ever, as with four of FCL's managers.
TYPED_TEST(DistanceContract, AQueryOfNoSizeThatMeetsNothingEnds) {
  Scene<typename TypeParam::Scalar> scene, probes;
  scene.addSphere({1, 2, 3}, 0);
  probes.addSphere({5, 5, 5}, 0);
  probes.addCapsule(Eigen::Vector3d(-4, 0, 0), Eigen::Vector3d(-4, 0, 0), 0);
  const Managed<TypeParam> manager(scene);
  manager.expectEveryPair();
  for (auto* probe : probes.objects()) {
    manager.expectEveryPair(probe);
    EXPECT_GT(manager.expectNearest(probe), 0);
  }
}

// A search would not prune: as slow as visiting every pair.
TYPED_TEST(FiberDistance, ASearchVisitsFewPairs) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = apartScene<S>(8, 67);
  const Managed<TypeParam> manager(scene);
  const PairOracle<S> oracle = manager.oracle();
  DistanceSearch<S> search(oracle);
  search.run(*manager);
  EXPECT_LT(search.calls.size(), oracle.pairCount(scene.objects()) / 10);
}

}  // namespace
}  // namespace fcl_fibers::test
