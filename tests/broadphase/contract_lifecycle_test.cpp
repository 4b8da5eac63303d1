// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <thread>
#include <unordered_map>
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
using Objects = std::vector<fcl::CollisionObject<S>*>;

// Whether the manager holds these objects, and answers for them as it would if it never held
// others.
template <typename Config, typename S>
testing::AssertionResult holds(const fcl::BroadPhaseCollisionManager<S>& manager,
                               const Objects<S>& objects) {
  if (manager.size() != objects.size() || manager.empty() != objects.empty()) {
    return testing::AssertionFailure()
           << "size is " << manager.size() << " instead of " << objects.size();
  }
  const Objects<S> managed = objectsOf<S>(manager);
  const bool same = Config::kIsFiberManager ? managed == objects
                                            : std::is_permutation(managed.begin(), managed.end(),
                                                                  objects.begin(), objects.end());
  if (!same) return testing::AssertionFailure() << "getObjects gives other objects";
  const PairOracle<S> oracle(objects, rulesOf<Config>({}));
  return oracle.answersSelf(selfPairs(manager), objects, kOrder<Config>);
}

template <typename S>
Objects<S> slice(const Objects<S>& objects, std::size_t begin, std::size_t end) {
  return {objects.begin() + static_cast<std::ptrdiff_t>(begin),
          objects.begin() + static_cast<std::ptrdiff_t>(end)};
}

template <typename S>
Calls<S> sorted(Calls<S> calls) {
  std::sort(calls.begin(), calls.end());
  return calls;
}

// Pairs as numbers of objects, for scenes whose objects live elsewhere.
template <typename S>
std::vector<std::pair<std::size_t, std::size_t>> numbered(const Calls<S>& calls,
                                                          const Objects<S>& objects) {
  std::unordered_map<const fcl::CollisionObject<S>*, std::size_t> number;
  for (std::size_t i = 0; i < objects.size(); ++i) number.emplace(objects[i], i);
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const auto& [a, b] : calls) pairs.emplace_back(number.at(a), number.at(b));
  return pairs;
}

template <typename Config>
class LifecycleContract : public testing::Test {};
TYPED_TEST_SUITE(LifecycleContract, AllManagers, ManagerNames);

template <typename Config>
class FiberLifecycle : public testing::Test {};
TYPED_TEST_SUITE(FiberLifecycle, FiberManagers, ManagerNames);

// Programs that register one by one, as MoveIt does, would get another answer.
TYPED_TEST(LifecycleContract, RegisteringOneByOneIsRegisteringAtOnce) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(9, 15, 71);
  const auto at_once = TypeParam::make();
  at_once->registerObjects(scene.objects());
  at_once->setup();
  const auto one_by_one = TypeParam::make();
  for (fcl::CollisionObject<S>* object : scene.objects()) one_by_one->registerObject(object);
  one_by_one->setup();
  EXPECT_TRUE(holds<TypeParam>(*at_once, scene.objects()));
  EXPECT_TRUE(holds<TypeParam>(*one_by_one, scene.objects()));
}

// Objects that join a scene later would be missed, or hide those that were there.
TYPED_TEST(LifecycleContract, RegisteringMayBeMixedBeforeAndAfterSetup) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = soupScene<S>(120, 0.8, 72);
  const auto& objects = scene.objects();
  const auto manager = TypeParam::make();
  manager->registerObjects(slice<S>(objects, 0, 30));
  manager->registerObject(objects[30]);
  manager->setup();
  EXPECT_TRUE(holds<TypeParam>(*manager, slice<S>(objects, 0, 31)));
  manager->registerObject(objects[31]);
  EXPECT_TRUE(holds<TypeParam>(*manager, slice<S>(objects, 0, 32)));
  manager->registerObjects(slice<S>(objects, 32, 90));
  EXPECT_TRUE(holds<TypeParam>(*manager, slice<S>(objects, 0, 90)));
  manager->setup();
  EXPECT_TRUE(holds<TypeParam>(*manager, slice<S>(objects, 0, 90)));
  manager->registerObjects({});
  for (std::size_t i = 90; i < 120; ++i) manager->registerObject(objects[i]);
  manager->update();
  EXPECT_TRUE(holds<TypeParam>(*manager, objects));
}

// Whoever forgets setup() would get nothing, or a crash.
TYPED_TEST(LifecycleContract, AQueryNeedsNoSetup) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = curledScene<S>(90, 73);
  const Scene<S> probes = soupScene<S>(5, 1, 74);
  Objects<S> all = scene.objects();
  all.insert(all.end(), probes.objects().begin(), probes.objects().end());
  const PairOracle<S> oracle(all, rulesOf<TypeParam>({}));
  const auto fresh = [&] {
    auto manager = TypeParam::make();
    manager->registerObjects(scene.objects());
    return manager;
  };
  EXPECT_TRUE(holds<TypeParam>(*fresh(), scene.objects()));
  EXPECT_TRUE(oracle.answersBetween(pairsWith(*fresh(), *probes[0]), scene.objects(), {probes[0]},
                                    kOrder<TypeParam>));
  const auto other = TypeParam::make();
  other->registerObjects(probes.objects());
  EXPECT_TRUE(oracle.answersBetween(pairsWith(*fresh(), *other), scene.objects(), probes.objects(),
                                    kOrder<TypeParam>));
  DistanceSearch<S> search(oracle);
  search.run(*fresh());
  EXPECT_FALSE(search.calls.empty());
}

// The first queries of a planner's threads would race for the tree.
TYPED_TEST(LifecycleContract, SeveralThreadsMayQueryRightAfterRegistering) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(10, 20, 75);
  const auto& objects = scene.objects();
  const PairOracle<S> oracle(objects, rulesOf<TypeParam>({}));
  for (int round = 0; round < 5; ++round) {
    const auto manager = TypeParam::make();
    manager->registerObjects(objects);
    constexpr std::size_t kThreads = 4;
    std::vector<Calls<S>> self(kThreads);
    std::vector<Calls<S>> one(kThreads);
    std::vector<S> distance(kThreads);
    std::vector<std::thread> threads;
    for (std::size_t t = 0; t < kThreads; ++t) {
      threads.emplace_back([&, t] {
        // Every thread begins with another kind of query.
        for (std::size_t step = 0; step < 3; ++step) {
          switch ((t + step) % 3) {
            case 0:
              self[t] = selfPairs(*manager);
              break;
            case 1:
              one[t] = pairsWith(*manager, *objects[7]);
              break;
            default: {
              DistanceSearch<S> search(oracle);
              search.run(*manager);
              distance[t] = search.result();
            }
          }
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_TRUE(oracle.answersSelf(self[0], objects, kOrder<TypeParam>));
    for (std::size_t t = 1; t < kThreads; ++t) {
      EXPECT_EQ(self[t], self[0]);
      EXPECT_EQ(one[t], one[0]);
      EXPECT_EQ(distance[t], distance[0]);
    }
  }
}

// Two managers that ask each other for the first time would wait for each other, for ever.
TYPED_TEST(LifecycleContract, TwoManagersMayAskEachOtherAtOnce) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(8, 12, 96);
  const Scene<S> others = soupScene<S>(60, 0.6, 97);
  Objects<S> all = scene.objects();
  all.insert(all.end(), others.objects().begin(), others.objects().end());
  const PairOracle<S> oracle(all, rulesOf<TypeParam>({}));
  for (int round = 0; round < 5; ++round) {
    const auto manager = TypeParam::make();
    manager->registerObjects(scene.objects());
    const auto other = TypeParam::make();
    other->registerObjects(others.objects());
    Calls<S> there;
    Calls<S> back;
    std::thread first([&] { there = pairsWith(*manager, *other); });
    std::thread second([&] { back = pairsWith(*other, *manager); });
    first.join();
    second.join();
    EXPECT_TRUE(oracle.answersBetween(there, scene.objects(), others.objects(), kOrder<TypeParam>));
    EXPECT_TRUE(oracle.answersBetween(back, others.objects(), scene.objects(), kOrder<TypeParam>));
  }
}

// Runs could not be compared: pairs would come in the order of the heap.
TYPED_TEST(LifecycleContract, TheSequenceDoesNotDependOnAddresses) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = unequalScene<S>(76);
  const Scene<S> probes = soupScene<S>(20, 1, 77);
  const Scene<S> copy = scene.reallocated(78);
  const Scene<S> probes_copy = probes.reallocated(79);
  const auto manager = TypeParam::make();
  const auto manager_copy = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager_copy->registerObjects(copy.objects());
  manager->setup();
  manager_copy->setup();
  EXPECT_EQ(numbered<S>(selfPairs(*manager), scene.objects()),
            numbered<S>(selfPairs(*manager_copy), copy.objects()));

  const auto other = TypeParam::make();
  const auto other_copy = TypeParam::make();
  other->registerObjects(probes.objects());
  other_copy->registerObjects(probes_copy.objects());
  Objects<S> all = scene.objects();
  all.insert(all.end(), probes.objects().begin(), probes.objects().end());
  Objects<S> all_copy = copy.objects();
  all_copy.insert(all_copy.end(), probes_copy.objects().begin(), probes_copy.objects().end());
  EXPECT_EQ(numbered<S>(pairsWith(*manager, *other), all),
            numbered<S>(pairsWith(*manager_copy, *other_copy), all_copy));
  EXPECT_EQ(numbered<S>(pairsWith(*manager, *probes[0]), all),
            numbered<S>(pairsWith(*manager_copy, *probes_copy[0]), all_copy));
}

// A careful program that calls setup() before each query would see other sequences.
TYPED_TEST(LifecycleContract, RepeatedSetupIsHarmless) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(7, 13, 80);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  const Calls<S> pairs = selfPairs(*manager);
  manager->setup();
  manager->setup();
  EXPECT_EQ(selfPairs(*manager), pairs);
  EXPECT_TRUE(holds<TypeParam>(*manager, scene.objects()));
}

// Objects that left a scene would go on colliding, or take others with them.
TYPED_TEST(LifecycleContract, UnregisteredObjectsAreGoneAndMayComeBack) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = curledScene<S>(70, 81);
  Objects<S> objects = scene.objects();
  const auto manager = TypeParam::make();
  manager->registerObjects(objects);
  manager->setup();
  const auto leave = [&](std::size_t i) {
    manager->unregisterObject(objects[i]);
    fcl::CollisionObject<S>* left = objects[i];
    objects.erase(objects.begin() + static_cast<std::ptrdiff_t>(i));
    return left;
  };
  const auto first = leave(0);
  EXPECT_TRUE(holds<TypeParam>(*manager, objects)) << "without the first";
  const auto last = leave(objects.size() - 1);
  EXPECT_TRUE(holds<TypeParam>(*manager, objects)) << "without the last";
  const auto middle = leave(objects.size() / 2);
  EXPECT_TRUE(holds<TypeParam>(*manager, objects)) << "without one in the middle";
  for (fcl::CollisionObject<S>* object : {last, first, middle}) {
    manager->registerObject(object);
    objects.push_back(object);
    EXPECT_TRUE(holds<TypeParam>(*manager, objects)) << "one came back";
  }
  manager->setup();
  EXPECT_TRUE(holds<TypeParam>(*manager, objects));

  Random random(82);
  while (!objects.empty()) {
    leave(random.below(objects.size()));
    if (objects.size() % 9 == 0 || objects.size() < 4) {
      EXPECT_TRUE(holds<TypeParam>(*manager, objects)) << objects.size() << " left";
    }
  }
  manager->registerObjects(scene.objects());
  EXPECT_TRUE(holds<TypeParam>(*manager, scene.objects()));
}

// Coming and going at random would leave something behind.
TYPED_TEST(LifecycleContract, AnySequenceOfRegisteringAndUnregisteringIsRight) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = soupScene<S>(60, 1, 83);
  Random random(84);
  Objects<S> outside = scene.objects();
  Objects<S> inside;
  const auto manager = TypeParam::make();
  for (int step = 0; step < 300; ++step) {
    const bool join = inside.empty() || (!outside.empty() && random.unit() < 0.55);
    Objects<S>& from = join ? outside : inside;
    Objects<S>& to = join ? inside : outside;
    const std::size_t i = random.below(from.size());
    join ? manager->registerObject(from[i]) : manager->unregisterObject(from[i]);
    to.push_back(from[i]);
    from.erase(from.begin() + static_cast<std::ptrdiff_t>(i));
    if (step % 20 == 7) manager->setup();
    if (step % 30 == 11) manager->update();
    if (step % 10 == 3) {
      EXPECT_TRUE(holds<TypeParam>(*manager, inside)) << "step " << step;
    }
  }
  EXPECT_TRUE(holds<TypeParam>(*manager, inside));
}

// A cleared manager would remember.
TYPED_TEST(LifecycleContract, AClearedManagerIsAsNew) {
  using S = typename TypeParam::Scalar;
  const Scene<S> first = strandScene<S>(5, 11, 85);
  const Scene<S> second = soupScene<S>(40, 1, 86);
  const auto manager = TypeParam::make();
  manager->clear();
  EXPECT_TRUE((holds<TypeParam, S>(*manager, {})));
  for (const Scene<S>* scene : {&first, &second, &first}) {
    manager->registerObjects(scene->objects());
    manager->setup();
    EXPECT_TRUE(holds<TypeParam>(*manager, scene->objects()));
    manager->clear();
    EXPECT_TRUE((holds<TypeParam, S>(*manager, {})));
    manager->setup();
    EXPECT_TRUE((holds<TypeParam, S>(*manager, {})));
  }
}

// Objects that die before their manager, or before clear(), would be touched after their death.
TYPED_TEST(LifecycleContract, ObjectsMayDieBeforeClearAndBeforeTheManager) {
  using S = typename TypeParam::Scalar;
  const auto manager = TypeParam::make();
  {
    const Scene<S> scene = soupScene<S>(30, 1, 87);
    manager->registerObjects(scene.objects());
    manager->setup();
  }
  manager->clear();
  {
    const Scene<S> scene = soupScene<S>(30, 1, 88);
    manager->registerObjects(scene.objects());
    EXPECT_TRUE(holds<TypeParam>(*manager, scene.objects()));
  }
}

// What was in the caller's vector would be taken for managed objects.
TYPED_TEST(LifecycleContract, GetObjectsReplacesTheContent) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = soupScene<S>(12, 1, 89);
  const Scene<S> others = soupScene<S>(30, 1, 90);
  const auto manager = TypeParam::make();
  Objects<S> objects = others.objects();
  manager->getObjects(objects);
  EXPECT_TRUE(objects.empty());
  manager->registerObjects(scene.objects());
  objects = others.objects();
  manager->getObjects(objects);
  EXPECT_THAT(objects, testing::UnorderedElementsAreArray(scene.objects()));
  EXPECT_EQ(manager->size(), scene.size());
  EXPECT_FALSE(manager->empty());
}

// Objects could not be told apart by their number, or "the earlier one" would mean nothing.
TYPED_TEST(FiberLifecycle, GetObjectsIsInOrderOfRegistration) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(6, 10, 91).reallocated(92);
  const auto manager = TypeParam::make();
  Objects<S> expected;
  manager->registerObject(scene[59]);
  expected.push_back(scene[59]);
  manager->registerFiber(scene.fibers()[3]);
  expected.insert(expected.end(), scene.fibers()[3].begin(), scene.fibers()[3].end());
  manager->registerObjects(slice<S>(scene.objects(), 0, 25));
  expected.insert(expected.end(), scene.objects().begin(), scene.objects().begin() + 25);
  EXPECT_EQ(objectsOf<S>(*manager), expected);
  EXPECT_TRUE(holds<TypeParam>(*manager, expected));
  manager->unregisterObject(scene[4]);
  manager->registerObject(scene[4]);
  expected.erase(std::find(expected.begin(), expected.end(), scene[4]));
  expected.push_back(scene[4]);
  EXPECT_EQ(objectsOf<S>(*manager), expected);
  EXPECT_TRUE(holds<TypeParam>(*manager, expected));
}

// A scene in which objects come and go all day would fill the memory, and forget their order.
TYPED_TEST(FiberLifecycle, ComingAndGoingLeavesNothingBehind) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(6, 20, 98);
  Objects<S> objects = scene.objects();
  const auto manager = TypeParam::make();
  manager->registerObjects(objects);
  manager->setup();
  const std::size_t before = manager->memoryUsage();
  Random random(99);
  for (int i = 0; i < 3000; ++i) {
    const std::size_t chosen = random.below(objects.size());
    fcl::CollisionObject<S>* object = objects[chosen];
    manager->unregisterObject(object);
    manager->registerObject(object);
    objects.erase(objects.begin() + static_cast<std::ptrdiff_t>(chosen));
    objects.push_back(object);
  }
  EXPECT_TRUE(holds<TypeParam>(*manager, objects));
  EXPECT_LT(manager->memoryUsage(), 8 * before);
}

// The way in which fibers are registered would change answers, not only speed.
TYPED_TEST(FiberLifecycle, AllWaysOfRegisteringFindTheSamePairs) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = unequalScene<S>(93);
  const auto at_once = TypeParam::make();
  at_once->registerObjects(scene.objects());
  const auto by_fiber = TypeParam::make();
  for (const auto& fiber : scene.fibers()) by_fiber->registerFiber(fiber);
  by_fiber->registerFiber({});
  const auto one_by_one = TypeParam::make();
  for (fcl::CollisionObject<S>* object : scene.objects()) one_by_one->registerObject(object);
  const auto mixed = TypeParam::make();
  for (std::size_t f = 0; f < scene.fibers().size(); ++f) {
    const auto& fiber = scene.fibers()[f];
    if (f % 3 == 0) {
      mixed->registerFiber(fiber);
    } else if (f % 3 == 1) {
      mixed->registerObjects(fiber);
    } else {
      for (fcl::CollisionObject<S>* object : fiber) mixed->registerObject(object);
    }
    if (f == 5) mixed->setup();
  }
  const Calls<S> pairs = sorted<S>(selfPairs(*at_once));
  EXPECT_TRUE(holds<TypeParam>(*at_once, scene.objects()));
  EXPECT_EQ(sorted<S>(selfPairs(*by_fiber)), pairs);
  EXPECT_EQ(sorted<S>(selfPairs(*one_by_one)), pairs);
  EXPECT_EQ(sorted<S>(selfPairs(*mixed)), pairs);
}

// Fibers would need an order of registration that follows space: bundles sort, others must not
// lose.
TYPED_TEST(FiberLifecycle, FibersMayBeRegisteredInAnyOrderAndDirection) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(14, 18, 94);
  std::vector<Objects<S>> fibers = scene.fibers();
  Random random(95);
  random.shuffle(fibers);
  const auto manager = TypeParam::make();
  Objects<S> expected;
  for (std::size_t f = 0; f < fibers.size(); ++f) {
    if (f % 2 == 1) std::reverse(fibers[f].begin(), fibers[f].end());
    manager->registerFiber(fibers[f]);
    expected.insert(expected.end(), fibers[f].begin(), fibers[f].end());
  }
  EXPECT_TRUE(holds<TypeParam>(*manager, expected));
  // And in no order at all: no two consecutive capsules touch.
  Objects<S> shuffled = scene.objects();
  random.shuffle(shuffled);
  manager->clear();
  manager->registerObjects(shuffled);
  EXPECT_TRUE(holds<TypeParam>(*manager, shuffled));
}

}  // namespace
}  // namespace fcl_fibers::test
