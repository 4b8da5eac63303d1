// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/impact_collector.h>

#include "broadphase/moving_program.h"
#include "support/scalars.h"

// What a manager with FiberManagerOptions::motion finds, against brute force.

namespace fcl_fibers::test {
namespace {

template <typename S>
class ManagerMotion : public testing::Test {};
TYPED_TEST_SUITE(ManagerMotion, Scalars, ScalarName);

// Some sequence of calls would lose where objects were, and so what they met on their way.
TYPED_TEST(ManagerMotion, QueriesReportWhatTouchesWithinTheStep) {
  using S = TypeParam;
  std::size_t missed_at_end = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    FiberManagerOptions options = movingOptions();
    options.topology = seed % 4 == 3 ? Topology::kSuperThread : Topology::kBundle;
    options.ignored_neighbors = 1;
    options.margin = seed % 3 == 0 ? 0.02 : 0;
    options.threads = seed % 5 == 4 ? 2 : 1;
    Program<S> program(options, seed), other(options, 1000 + seed);
    for (int i = 0; i < 4; ++i) other.registerFiber(5);
    Random& random = program.random;
    std::vector<std::unique_ptr<fcl::CollisionObject<S>>> probes;
    for (int i = 0; i < 6; ++i) program.registerFiber(6);
    for (int call = 0; call < 60; ++call) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", call " + std::to_string(call));
      const double distance = std::pow(10, random.between(-3, 0));
      switch (random.below(18)) {
        case 0:
          program.registerFiber(1 + random.below(20));
          break;
        case 1:
          program.registerBall();
          break;
        case 2:
          for (std::size_t i = random.below(4); i > 0; --i) program.unregister();
          break;
        case 3:
          if (random.below(2) > 0) break;
          while (program.order.size() > 5) program.unregister();
          break;
        case 4:
          if (random.below(6) == 0) program.clear();
          break;
        case 5:
        case 6:
          program.updateAll(distance);
          break;
        case 7:
          // Far away, so that the frame changes, or back.
          program.updateAll(random.below(3) == 0 ? 30 : 0.3);
          break;
        case 8:
        case 9:
          program.update(random.below(6), distance);
          break;
        case 10:
          program.manager.setup();
          program.read();
          break;
        case 11:
          if (random.below(8) == 0) {
            program.endStep();
          } else {
            program.beginStep();
          }
          break;
        case 12:
          program.beginStep();
          program.updateAll(distance);
          break;
        case 13:
          program.beginStep();
          program.update(random.below(6), distance);
          break;
        case 14:
          other.beginStep();
          break;
        case 15: {
          probes.push_back(program.makeObject(0.4));
          fcl::CollisionObject<S>* probe = probes.back().get();
          if (random.below(2) == 0 && !program.order.empty()) {
            probe = program.order[random.below(program.order.size())];
          }
          program.read();
          program.judge(pairsWith(program.manager, *probe), {probe}, nullptr, "with an object");
          break;
        }
        case 16:
          if (random.below(2) == 0) other.updateAll(distance);
          program.read();
          other.read();
          program.judge(pairsWith(program.manager, other.manager), other.order, &other,
                        "with a manager");
          break;
        default:
          program.read();
          if (program.order.size() > 1) {
            program.judge(selfPairs(program.manager), {}, nullptr, "self");
          }
      }
      if (this->HasFailure()) return;
    }
    missed_at_end += program.missed_at_end;
  }
  EXPECT_GT(missed_at_end, 100u);
}

// A program would take the time or the place of an impact from another pair, manager or unit.
TYPED_TEST(ManagerMotion, ImpactsTellWhenAndWhere) {
  using S = TypeParam;
  LayeredAABBTreeCollisionManager<S> manager(movingOptions()), other(movingOptions());
  OneCapsule<S> resting, falling, its;
  falling.place(0.05, 0, 1);
  its.place(0, 3, 0);
  manager.registerFiber({&resting.object});
  manager.registerFiber({&falling.object});
  other.registerFiber({&its.object});
  manager.beginStep();
  other.beginStep();
  EXPECT_TRUE(selfPairs(manager).empty());
  EXPECT_TRUE(pairsWith(manager, other).empty());
  falling.place(0.05, 0, -1);
  manager.update();
  its.place(0, -5, 0);
  other.update();

  ImpactCollector<S> collector(manager, &other);
  manager.collide(&collector, &ImpactCollector<S>::callback);
  ASSERT_EQ(collector.impacts().size(), 1u);
  const ObjectImpact<S> impact = collector.impacts()[0];
  EXPECT_EQ(impact.object_a, &resting.object);
  EXPECT_EQ(impact.object_b, &falling.object);
  EXPECT_EQ(impact.a.fiber, 0);
  EXPECT_EQ(impact.b.fiber, 1);
  EXPECT_TRUE(impact.is_exact);
  EXPECT_NEAR(impact.time, 0.49, 1e-6);
  EXPECT_NEAR(impact.distance, 0, 1e-6);
  EXPECT_NEAR(impact.normal[2], 1, 1e-6);
  EXPECT_NEAR(impact.point_a[2], 0.01, 1e-6);

  collector.clear();
  manager.collide(&other, &collector, &ImpactCollector<S>::callback);
  ASSERT_EQ(collector.impacts().size(), 1u);
  EXPECT_EQ(collector.impacts()[0].object_b, &its.object);
  EXPECT_EQ(collector.impacts()[0].b.fiber, 0);
  EXPECT_NEAR(collector.impacts()[0].time, (3 - 0.02) / 8, 1e-6);

  // What is not managed rests.
  OneCapsule<S> probe;
  probe.place(0.05, 0, -0.5);
  collector.clear();
  manager.collide(&probe.object, &collector, &ImpactCollector<S>::callback);
  ASSERT_EQ(collector.impacts().size(), 1u);
  EXPECT_EQ(collector.impacts()[0].object_a, &falling.object);
  EXPECT_NEAR(collector.impacts()[0].time, 0.74, 1e-6);

  TimedContact contact;
  EXPECT_FALSE(manager.findImpact(&resting.object, &probe.object, nullptr, contact));
  EXPECT_THROW(manager.findImpact(nullptr, &probe.object, nullptr, contact), std::invalid_argument);
  EXPECT_THROW(manager.findImpact(&probe.object, &resting.object, nullptr, contact),
               std::invalid_argument);
  EXPECT_THROW(manager.findImpact(&resting.object, nullptr, nullptr, contact),
               std::invalid_argument);
  LayeredAABBTreeCollisionManager<S> without;
  without.registerObject(&resting.object);
  EXPECT_THROW(without.findImpact(&resting.object, &falling.object, nullptr, contact),
               std::invalid_argument);
}

// A program would get other pairs, or another order, with more threads.
TYPED_TEST(ManagerMotion, PairsComeInOneOrderWithAnyThreads) {
  using S = TypeParam;
  std::vector<std::vector<std::pair<std::size_t, std::size_t>>> found;
  for (const int threads : {1, 2, 3, 2}) {
    Program<S> program(movingOptions(threads), 77);
    for (int i = 0; i < 120; ++i) program.registerFiber(10);
    program.registerBall();
    program.beginStep();
    for (int i = 0; i < 5; ++i) program.registerBall();
    program.updateAll(0.2);
    auto& places = found.emplace_back();
    for (const auto& [a, b] : selfPairs(program.manager)) {
      const auto placeOf = [&](const fcl::CollisionObject<S>* object) {
        const auto at = std::find(program.order.begin(), program.order.end(), object);
        return static_cast<std::size_t>(at - program.order.begin());
      };
      places.emplace_back(placeOf(a), placeOf(b));
    }
  }
  EXPECT_GT(found[0].size(), 2000u);
  for (const auto& other : found) EXPECT_EQ(other, found[0]);
}

// The time of a pair whose second object moves in a manager that nobody named would be invented.
TYPED_TEST(ManagerMotion, AnUnknownTimeIsTold) {
  using S = TypeParam;
  LayeredAABBTreeCollisionManager<S> manager(movingOptions()), other(movingOptions());
  OneCapsule<S> resting, falling;
  falling.place(0, 0, 1);
  manager.registerFiber({&resting.object});
  other.registerFiber({&falling.object});
  other.beginStep();
  EXPECT_TRUE(pairsWith(manager, other).empty());
  falling.place(0, 0, -1);
  other.update();
  for (const bool is_named : {false, true}) {
    ImpactCollector<S> collector(manager, is_named ? &other : nullptr);
    manager.collide(&other, &collector, &ImpactCollector<S>::callback);
    ASSERT_EQ(collector.impacts().size(), 1u);
    EXPECT_EQ(collector.impacts()[0].has_time, is_named);
  }

  // If both managers have the object, the one that is named counts.
  manager.registerFiber({&falling.object});
  manager.setup();
  TimedContact contact;
  EXPECT_FALSE(manager.findImpact(&resting.object, &falling.object, nullptr, contact));
  EXPECT_TRUE(manager.findImpact(&resting.object, &falling.object, &other, contact));
  EXPECT_NEAR(contact.time, 0.49, 1e-6);
}

}  // namespace
}  // namespace fcl_fibers::test
