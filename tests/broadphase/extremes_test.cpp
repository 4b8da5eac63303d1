// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include "support/managed.h"
#include "support/scene_generators.h"

// Scenes and partners whose parts differ in size or place by more than a frame can bridge.

namespace fcl_fibers::test {
namespace {

MANAGER_SUITE(Extremes, FiberManagers);

// Both corners of a far box would be taken for infinity, and infinity minus infinity for apart.
TYPED_TEST(Extremes, BoxesNearTheEndOfTheRangeMeet) {
  using S = typename TypeParam::Scalar;
  const double far = static_cast<double>(std::numeric_limits<S>::max()) / 3.2;
  Scene<S> scene;
  for (const double x : {far, 1.0000001 * far, 0.0}) {
    scene.addBox({x, 0, 0}, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Constant(1e-5 * far));
  }
  ASSERT_TRUE(scene[0]->getAABB().overlap(scene[1]->getAABB()));
  const Managed<TypeParam> manager(scene);
  // FCL takes coordinates so large for infinite, and a sphere around an open box is around
  // everything.
  const std::size_t most = TypeParam::kVolume == LeafVolume::kBox ? 1 : 3;
  const Calls<S> found = selfPairs(*manager);
  EXPECT_EQ(std::count(found.begin(), found.end(), std::pair(scene[0], scene[1])), 1);
  EXPECT_LE(found.size(), most);
  EXPECT_GE(pairsWith(*manager, *scene[1]).size(), 1u);
}

// Distances between them overflow in the frame of the smaller one, and so do their squares.
TYPED_TEST(Extremes, ManagersOfVeryDifferentSizeAnswerEachOther) {
  using S = typename TypeParam::Scalar;
  constexpr int kMost = std::is_same_v<S, float> ? 120 : 1010;
  for (const int exponent : {kMost, kMost / 2, 2 * kMost / 5, 3 * kMost / 10}) {
    const double small = std::ldexp(1.0, -exponent), large = std::ldexp(1.0, exponent);
    Scene<S> tiny, huge;
    for (int i = -20; i <= 20; ++i) tiny.addSphere({small * i / 2, 0, small * i / 2}, 0.2 * small);
    for (int i = 1; i <= 22; ++i) {
      huge.addCapsule({-large, i * large, 0}, {large, i * large, 0}, large / 4);
    }
    for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0)) {
      for (const bool late : {false, true}) {
        SCOPED_TRACE(testing::Message() << "2^" << exponent << (late ? ", one is late" : ""));
        auto at_once = tiny.objects();
        if (late) at_once.pop_back();
        Managed<TypeParam> first(at_once, options);
        const Managed<TypeParam> second(huge, options);
        if (late) first.registerObject(tiny.objects().back());
        first.expectNearest(second);
        first.expectEveryPair(second);
        second.expectNearest(first);
        second.expectEveryPair(first);
      }
    }
  }
}

// What the trees have found would be found again one by one.
TYPED_TEST(Extremes, AHalfSpaceBesideManagersOfVeryDifferentSizeRepeatsNothing) {
  using S = typename TypeParam::Scalar;
  constexpr int kMost = std::is_same_v<S, float> ? 120 : 1010;
  for (const int exponent : {kMost, kMost / 2}) {
    const double small = std::ldexp(1.0, -exponent), large = std::ldexp(1.0, exponent);
    for (const bool in_tiny : {true, false}) {
      Scene<S> tiny, huge;
      for (int i = -2; i <= 2; ++i) {
        tiny.addSphere({small * i / 2, 0, small * i / 2}, 0.36 * small);
      }
      huge.addCapsule({-large, 0, 0}, {large, 0, 0}, 0.5 * small);
      huge.addCapsule({-large, large, 0}, {large, large, 0}, large);
      (in_tiny ? tiny : huge).addHalfspace({0, 0, 1}, 0);
      const Managed<TypeParam> first(tiny), second(huge);
      for (Calls<S> pairs : {pairsWith(*first, *second), pairsWith(*second, *first)}) {
        EXPECT_GE(pairs.size(), 5u);
        std::sort(pairs.begin(), pairs.end());
        EXPECT_EQ(std::adjacent_find(pairs.begin(), pairs.end()), pairs.end()) << "2^" << exponent;
      }
    }
  }
}

// The frame of the tree does not hold it, but another one does: it would be refused.
TYPED_TEST(Extremes, AnObjectThatMovesOutOfTheFramesRangeIsFollowed) {
  using S = typename TypeParam::Scalar;
  const S far = static_cast<S>(std::sqrt(static_cast<double>(std::numeric_limits<S>::max())) * 1e9);
  const double size = std::is_same_v<S, float> ? 1e-20 : 1e-155;
  for (const bool late : {false, true}) {
    Scene<S> scene;
    for (int i = 0; i < 24; ++i) scene.addSphere({i * size, 0, 0}, 0.6 * size);
    auto objects = scene.objects();
    fcl::CollisionObject<S>* const last = objects.back();
    fcl::CollisionObject<S>* const neighbor = objects[objects.size() - 2];
    if (late) objects.pop_back();
    Managed<TypeParam> manager(objects);
    EXPECT_EQ(selfPairs(*manager).size(), objects.size() - 1);
    if (late) manager.registerObject(last);
    const auto move_to = [&](S x) {
      last->setTranslation(fcl::Vector3<S>(x, 0, 0));
      last->computeAABB();
      manager->update(last);
    };
    // Beside it the others may be too small to be told apart, so only it is looked at.
    const auto has = [&](fcl::CollisionObject<S>* a) {
      const Calls<S> pairs = selfPairs(*manager);
      return std::any_of(pairs.begin(), pairs.end(), [&](const auto& pair) {
        return pair == std::pair(a, last) || pair == std::pair(last, a);
      });
    };
    move_to(far);
    // Out of the range of float in the frame that update(object) keeps, a sphere is unbounded. A
    // young object out of that range has all built in another frame.
    const bool spheres = rulesOf<TypeParam>({}).volume == LeafVolume::kSphere;
    EXPECT_EQ(has(neighbor), (spheres && std::is_same_v<S, float> && !late));
    move_to(static_cast<S>(23 * size));
    EXPECT_TRUE(has(neighbor));
  }
}

// One that comes later would be refused for the frame that the others have.
TYPED_TEST(Extremes, WhatTheFrameDoesNotHoldMayBeRegistered) {
  using S = typename TypeParam::Scalar;
  const double far = std::sqrt(static_cast<double>(std::numeric_limits<S>::max())) * 1e9;
  const double size = std::is_same_v<S, float> ? 1e-20 : 1e-155;
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0)) {
    Scene<S> scene;
    for (int i = 0; i < 24; ++i) scene.addSphere({i * size, 0, 0}, 0.6 * size);
    const Managed<TypeParam> manager(scene, options);
    EXPECT_EQ(selfPairs(*manager).size(), 23u);
    auto* const first = scene.addSphere({far, 0, 0}, far / 4);
    auto* const second = scene.addSphere({1.25 * far, 0, 0}, far / 4);
    manager->registerObjects({first, second});
    // Beside them the others may be too small to be told apart.
    Calls<S> pairs;
    EXPECT_NO_THROW(pairs = selfPairs(*manager)) << describe(options);
    EXPECT_EQ(std::count(pairs.begin(), pairs.end(), std::pair(first, second)), 1);
  }
}

// Squares of its length would overflow, and NaN be taken for apart.
TYPED_TEST(Extremes, AQueryObjectFarLargerThanTheSceneMeetsIt) {
  using S = typename TypeParam::Scalar;
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  const auto manager = TypeParam::make(options);
  Scene<S> scene;
  scene.addCapsule({0, 0, 0}, {1, 0, 0}, 0.1);
  scene.addCapsule({0, 5, 0}, {1, 5, 0}, 0.1);
  manager->registerObjects(scene.objects());
  // Where coordinates themselves overflow, the object is refused.
  const int last = std::min(std::numeric_limits<S>::max_exponent10 - 2, 250);
  for (int exponent = 0; exponent <= last; exponent += 3) {
    const double half = std::pow(10.0, exponent);
    Scene<S> query;
    query.addCapsule({0.5, 0, -half}, {0.5, 0, half}, 0.1);
    const Calls<S> pairs = pairsWith(*manager, *query[0]);
    ASSERT_GE(pairs.size(), 1u) << "half length 1e" << exponent;
    EXPECT_EQ(pairs[0].first, scene[0]) << "half length 1e" << exponent;
    // The other is 4.8 away, more than rounding of such lengths once they are not too large.
    EXPECT_TRUE(pairs.size() == 1 || exponent >= 12) << "half length 1e" << exponent;
  }
}

// One object far out would make bounds of all others useless.
TYPED_TEST(Extremes, AnOutlierLeavesTheOthersBoundsTight) {
  for (const double far : {1e6, 1e12, 1e20}) {
    using S = typename TypeParam::Scalar;
    Scene<S> scene;
    // Away from the world's origin, too, if the scalar can tell the capsules apart there.
    const double x = far * double{std::numeric_limits<S>::epsilon()} < 0.2 ? 0.4 * far : 0;
    for (int i = 0; i < 100; ++i) {
      scene.addCapsule({x, 3.0 * i, 0.0}, {x + 1.0, 3.0 * i, 0.0}, 0.1);
    }
    scene.addCapsule({far, far, far}, {far, far, 1.5 * far}, 0.1);
    EXPECT_TRUE(selfPairs(*Managed<TypeParam>(scene)).empty()) << far;
  }
}

// The frame would be lost with the objects that it was found from, and bounds be coarse.
TYPED_TEST(Extremes, UnregisteringEveryOtherObjectLeavesBoundsTight) {
  using S = typename TypeParam::Scalar;
  const double offset = std::is_same_v<S, double> ? 1e6 : 1e3;
  Scene<S> scene;
  for (int i = 0; i < 500; ++i) {
    const double y = 0.3 * i;
    scene.addCapsule({offset, y, 0.0}, {offset + 0.01, y, 0.0}, 0.001);
  }
  for (const std::size_t first : {0u, 1u}) {
    const auto manager = TypeParam::make();
    manager->registerObjects(scene.objects());
    for (std::size_t i = first; i < scene.size(); i += 2) manager->unregisterObject(scene[i]);
    EXPECT_TRUE(selfPairs(*manager).empty()) << first;
  }
}

// A query that ends at its first pair would cost as much as reading the other manager whole.
TYPED_TEST(Extremes, AForeignManagersObjectsAreReadWhenTheirTurnComes) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(6, 12, 401);
  Scene<S> others = strandScene<S>(6, 12, 401);
  others[others.size() - 1]->setTranslation(
      fcl::Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN()));
  const Managed<TypeParam> manager(scene);
  ForeignManager<S> foreign(others.objects());
  PairCollector<S> collector;
  collector.stop_at = 1;
  EXPECT_NO_THROW(manager->collide(&foreign, &collector, &PairCollector<S>::collide));
  EXPECT_EQ(collector.calls.size(), 1u);
  collector.stop_at = kNever;
  EXPECT_THROW(manager->collide(&foreign, &collector, &PairCollector<S>::collide),
               std::invalid_argument);
  const auto none = TypeParam::make();
  EXPECT_NO_THROW(none->collide(&foreign, &collector, &PairCollector<S>::collide));
}

// FCL's callers may call setup() as often as they like.
TYPED_TEST(Extremes, SetupOfAReadyManagerIsHarmlessEvenInAQuery) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(3, 5, 403);
  const Managed<TypeParam> manager(scene);
  struct Data {
    fcl::BroadPhaseCollisionManager<S>* manager;
    std::size_t calls;
  } data{&*manager, 0};
  manager->collide(&data, [](fcl::CollisionObject<S>*, fcl::CollisionObject<S>*, void* cdata) {
    auto& d = *static_cast<Data*>(cdata);
    d.manager->setup();
    ++d.calls;
    return false;
  });
  EXPECT_EQ(data.calls, selfPairs(*manager).size());
}

}  // namespace
}  // namespace fcl_fibers::test
