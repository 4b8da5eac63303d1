// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "support/managed.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

template <typename S>
using Objects = std::vector<fcl::CollisionObject<S>*>;

template <typename S>
Objects<S> slice(const Objects<S>& objects, std::size_t begin, std::size_t end) {
  return {objects.begin() + static_cast<std::ptrdiff_t>(begin),
          objects.begin() + static_cast<std::ptrdiff_t>(end)};
}

MANAGER_SUITE(LifecycleContract, AllManagers);
MANAGER_SUITE(FiberLifecycle, FiberManagers);

// Programs that register one by one, as MoveIt does, would get another answer.
TYPED_TEST(LifecycleContract, RegisteringOneByOneIsRegisteringAtOnce) {
  const auto scene = strandScene<typename TypeParam::Scalar>(9, 15, 71);
  EXPECT_TRUE(Managed<TypeParam>(scene).answersSelf());
  Managed<TypeParam> one_by_one;
  one_by_one.registerEach(scene.objects());
  one_by_one->setup();
  EXPECT_TRUE(one_by_one.answersSelf());
}

// Objects that join a scene later would be missed, or hide those that were there.
TYPED_TEST(LifecycleContract, RegisteringMayBeMixedBeforeAndAfterSetup) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = soupScene<S>(120, 0.8, 72);
  const auto& objects = scene.objects();
  Managed<TypeParam> manager;
  manager.registerObjects(slice<S>(objects, 0, 30));
  manager.registerObject(objects[30]);
  manager->setup();
  EXPECT_TRUE(manager.answersSelf());
  manager.registerObject(objects[31]);
  EXPECT_TRUE(manager.answersSelf());
  manager.registerObjects(slice<S>(objects, 32, 90));
  EXPECT_TRUE(manager.answersSelf());
  manager->setup();
  EXPECT_TRUE(manager.answersSelf());
  manager.registerObjects({});
  manager.registerEach(slice<S>(objects, 90, 120));
  manager->update();
  EXPECT_TRUE(manager.answersSelf());
}

// Whoever forgets setup() would get nothing, or a crash.
TYPED_TEST(LifecycleContract, AQueryNeedsNoSetup) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = curledScene<S>(90, 73);
  const Scene<S> probes = soupScene<S>(5, 1, 74);
  const auto fresh = [](const Scene<S>& from) {
    Managed<TypeParam> manager;
    manager.registerObjects(from.objects());
    return manager;
  };
  EXPECT_TRUE(fresh(scene).answersSelf());
  EXPECT_TRUE(fresh(scene).answersWith(probes[0]));
  EXPECT_TRUE(fresh(scene).answersWith(fresh(probes)));
  EXPECT_LE(fresh(scene).expectNearest(), 0);
  fresh(scene).expectNearest(fresh(probes));
}

// The first queries of a planner's threads would race for the tree.
TYPED_TEST(LifecycleContract, SeveralThreadsMayQueryRightAfterRegistering) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(10, 20, 75);
  const Managed<TypeParam> model(scene);
  const PairOracle<S> oracle = model.oracle();
  for (int round = 0; round < 5; ++round) {
    Managed<TypeParam> manager;
    manager.registerObjects(scene.objects());
    constexpr std::size_t kThreads = 4;
    std::vector<Calls<S>> self(kThreads), one(kThreads);
    std::vector<S> distance(kThreads);
    std::vector<std::thread> threads;
    for (std::size_t t = 0; t < kThreads; ++t) {
      threads.emplace_back([&, t] {
        // Every thread begins with another kind of query.
        for (std::size_t step = 0; step < 3; ++step) {
          if ((t + step) % 3 == 0) self[t] = selfPairs(*manager);
          if ((t + step) % 3 == 1) one[t] = pairsWith(*manager, *scene[7]);
          if ((t + step) % 3 == 2) {
            DistanceSearch<S> search(oracle);
            search.run(*manager);
            distance[t] = search.result();
          }
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_TRUE(manager.answersSelf());
    EXPECT_FALSE(one[0].empty());
    EXPECT_LE(distance[0], 0);
    for (std::size_t t = 0; t < kThreads; ++t) {
      EXPECT_EQ(self[t], selfPairs(*manager));
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
  for (int round = 0; round < 5; ++round) {
    Managed<TypeParam> manager, other;
    manager.registerObjects(scene.objects());
    other.registerObjects(others.objects());
    Calls<S> there, back;
    std::thread first([&] { there = pairsWith(*manager, *other); });
    std::thread second([&] { back = pairsWith(*other, *manager); });
    first.join();
    second.join();
    EXPECT_EQ(there, pairsWith(*manager, *other));
    EXPECT_EQ(back, pairsWith(*other, *manager));
    EXPECT_TRUE(manager.answersWith(other));
    EXPECT_TRUE(other.answersWith(manager));
  }
}

// Runs could not be compared: pairs would come in the order of the heap.
TYPED_TEST(LifecycleContract, TheSequenceDoesNotDependOnAddresses) {
  using S = typename TypeParam::Scalar;
  const auto sequences = [](const Scene<S>& scene, const Scene<S>& probes) {
    const Managed<TypeParam> manager(scene), other(probes);
    return std::vector{manager.numbered(selfPairs(*manager)),
                       manager.numbered(pairsWith(*manager, *other), probes.objects()),
                       manager.numbered(pairsWith(*manager, *scene[7]))};
  };
  const Scene<S> scene = unequalScene<S>(76);
  const Scene<S> probes = soupScene<S>(20, 1, 77);
  EXPECT_EQ(sequences(scene, probes), sequences(scene.reallocated(78), probes.reallocated(79)));
}

// Objects that left a scene would go on colliding, or take others with them.
TYPED_TEST(LifecycleContract, UnregisteredObjectsAreGoneAndMayComeBack) {
  const auto scene = curledScene<typename TypeParam::Scalar>(70, 81);
  Managed<TypeParam> manager(scene);
  auto* first = manager.unregister(0);
  EXPECT_TRUE(manager.answersSelf()) << "without the first";
  auto* last = manager.unregister(manager.size() - 1);
  EXPECT_TRUE(manager.answersSelf()) << "without the last";
  auto* middle = manager.unregister(manager.size() / 2);
  EXPECT_TRUE(manager.answersSelf()) << "without one in the middle";
  for (auto* object : {last, first, middle}) {
    manager.registerObject(object);
    EXPECT_TRUE(manager.answersSelf()) << "one came back";
  }
  manager->setup();
  EXPECT_TRUE(manager.answersSelf());

  Random random(82);
  while (manager.size() > 0) {
    manager.unregister(random.below(manager.size()));
    if (manager.size() % 9 == 0 || manager.size() < 4) {
      EXPECT_TRUE(manager.answersSelf(0)) << manager.size() << " left";
    }
  }
  manager.registerObjects(scene.objects());
  EXPECT_TRUE(manager.answersSelf());
}

// A cleared manager would remember.
TYPED_TEST(LifecycleContract, AClearedManagerIsAsNew) {
  using S = typename TypeParam::Scalar;
  const Scene<S> first = strandScene<S>(5, 11, 85);
  const Scene<S> second = soupScene<S>(40, 1, 86);
  Managed<TypeParam> manager;
  manager.clear();
  EXPECT_TRUE(manager.answersSelf(0));
  for (const Scene<S>* scene : {&first, &second, &first}) {
    manager.registerObjects(scene->objects());
    manager->setup();
    EXPECT_TRUE(manager.answersSelf());
    manager.clear();
    EXPECT_TRUE(manager.answersSelf(0));
    manager->setup();
    EXPECT_TRUE(manager.answersSelf(0));
  }
}

// Objects that die before their manager, or before clear(), would be touched after their death.
TYPED_TEST(LifecycleContract, ObjectsMayDieBeforeClearAndBeforeTheManager) {
  using S = typename TypeParam::Scalar;
  Managed<TypeParam> manager;
  {
    const Scene<S> scene = soupScene<S>(30, 1, 87);
    manager.registerObjects(scene.objects());
    manager->setup();
  }
  manager.clear();
  {
    const Scene<S> scene = soupScene<S>(30, 1, 88);
    manager.registerObjects(scene.objects());
    EXPECT_TRUE(manager.answersSelf());
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
}

// Objects could not be told apart by their number, or "the earlier one" would mean nothing.
TYPED_TEST(FiberLifecycle, GetObjectsIsInOrderOfRegistration) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(6, 10, 91).reallocated(92);
  Managed<TypeParam> manager;
  manager.registerObject(scene[59]);
  manager.registerFiber(scene.fibers()[3]);
  manager.registerObjects(slice<S>(scene.objects(), 0, 25));
  EXPECT_TRUE(manager.answersSelf());
  manager.unregisterObject(scene[4]);
  manager.registerObject(scene[4]);
  EXPECT_TRUE(manager.answersSelf());
}

}  // namespace
}  // namespace fcl_fibers::test
