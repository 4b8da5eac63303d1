// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/moving_pairs.h"
#include "support/moving_scene.h"
#include "support/scalars.h"
#include "support/small_stack.h"

namespace fcl_fibers::test {
namespace {

using testing::HasSubstr;

template <typename S>
class ContinuousManager : public testing::Test {};
TYPED_TEST_SUITE(ContinuousManager, Scalars, ScalarName);

/// The pairs of which the boxes come nearer than a distance that stays.
template <typename S>
struct Within {
  S least;
  std::set<std::pair<Moving<S>*, Moving<S>*>> pairs;

  static bool take(Moving<S>* a, Moving<S>* b, void* data, S& dist) {
    auto& self = *static_cast<Within*>(data);
    // The first pair comes before the limit is known.
    if (dist <= self.least || SeparationOracle<S>({a, b}, 1).ofLines(0, 1) <= Real(self.least)) {
      self.pairs.emplace(a, b);
    }
    dist = self.least;
    return false;
  }
  template <class... Partner>
  static Calls<S> of(const Manager<S>& manager, double least, Partner... partner) {
    Within within{static_cast<S>(least), {}};
    manager.distance(partner..., &within, &Within::take);
    return {within.pairs.begin(), within.pairs.end()};
  }
};

// A program that updates its motions would see those of the step before.
TYPED_TEST(ContinuousManager, UpdatesReadTheMotionsOfTheNextStep) {
  using S = TypeParam;
  for (const FiberOptions& options : assortedContinuousOptions()) {
    MovingScene<S> scene;
    fill(scene, 120, {MotionKind::kTranslation}, 814);
    Manager<S> manager(options);
    manager.registerObjects(scene.objects());
    manager.setup();
    Random random(815);
    const auto move = [&](std::size_t i) {
      auto& motion = dynamic_cast<fcl::TranslationMotion<S>&>(*scene[i]->getMotion());
      const Motion<S> next =
          makeMotion<S>(MotionKind::kTranslation, random.inCube(0.6), 0.4, 0, random);
      motion = dynamic_cast<const fcl::TranslationMotion<S>&>(*next);
    };
    for (const std::size_t count : std::initializer_list<std::size_t>{120, 1, 8, 20, 70}) {
      everyPair(manager, scene[0]);  // so that the next one would find an old tree
      std::vector<Moving<S>*> moved;
      for (std::size_t i = 0; i < count; ++i) {
        move(i * 7 % scene.size());
        moved.push_back(scene[i * 7 % scene.size()]);
      }
      if (count == scene.size()) {
        manager.update();
      } else if (count == 1) {
        manager.update(moved[0]);
      } else {
        manager.update(moved);
      }
      expectPairs<S>(collide(manager), scene.objects(), nullptr, options.margin, true);
      expectPairs<S>(Within<S>::of(manager, 1e-5), scene.objects(), nullptr, 0, true);
    }
    MovingScene<S> stranger;
    manager.update(stranger.addSphere({0, 0, 0}, {1, 0, 0}, 1));  // ignored
    expectPairs<S>(collide(manager), scene.objects(), nullptr, options.margin, true);
  }
}

// Objects that are gone would be used after their end, and new ones missed.
TYPED_TEST(ContinuousManager, ObjectsComeAndGo) {
  using S = TypeParam;
  MovingScene<S> scene;
  fill(scene, 240, {MotionKind::kTranslation}, 816);
  Manager<S> manager;
  EXPECT_TRUE(manager.empty());
  EXPECT_TRUE(collide(manager).empty());
  std::vector<Moving<S>*> managed(scene.objects().begin(), scene.objects().begin() + 160);
  manager.registerObjects(managed);
  Random random(817);
  std::size_t next = 160;
  for (int round = 0; round < 12; ++round) {
    const std::size_t gone = round % 3 == 0 ? 2 : 15;
    for (std::size_t i = 0; i < gone; ++i) {
      const auto place = static_cast<std::ptrdiff_t>(random.below(managed.size()));
      manager.unregisterObject(managed[static_cast<std::size_t>(place)]);
      managed.erase(managed.begin() + place);
    }
    if (round % 2 == 0) manager.update();
    if (round % 4 == 1) {
      for (int i = 0; i < 10; ++i) {
        managed.push_back(scene[next]);
        manager.registerObject(scene[next++]);
      }
    }
    std::vector<Moving<S>*> held;
    manager.getObjects(held);
    EXPECT_EQ(held, managed);
    EXPECT_EQ(manager.size(), managed.size());
    expectPairs<S>(collide(manager), managed, nullptr, 0, true);
    EXPECT_EQ(everyPair(manager).size(), managed.size() * (managed.size() - 1) / 2);
  }
  manager.clear();
  EXPECT_TRUE(manager.empty());
  EXPECT_TRUE(collide(manager).empty());
  EXPECT_TRUE(collide(manager, scene[0]).empty());
  manager.registerObject(scene[0]);
  EXPECT_EQ(manager.size(), 1u);
}

// A program would wait for an answer that it has, or lose its own error.
TYPED_TEST(ContinuousManager, CallbacksStopAndThrow) {
  using S = TypeParam;
  using Base = typename Manager<S>::Base;
  MovingScene<S> scene, others;
  fill(scene, 150, {MotionKind::kTranslation}, 818);
  fill(others, 40, {MotionKind::kTranslation}, 819);
  for (const int threads : {1, 2}) {
    FiberOptions options;
    options.threads = threads;
    Manager<S> manager(options), other(options);
    manager.registerObjects(scene.objects());
    other.registerObjects(others.objects());
    Moving<S>* probe = *std::max_element(
        others.objects().begin(), others.objects().end(),
        [&](auto* a, auto* b) { return collide(manager, a).size() < collide(manager, b).size(); });
    const std::vector<std::function<void(Collector<S>&)>> queries = {
        [&](auto& c) { manager.collide(&c, &Collector<S>::collide); },
        [&](auto& c) { manager.collide(probe, &c, &Collector<S>::collide); },
        [&](auto& c) { manager.collide(static_cast<Base*>(&other), &c, &Collector<S>::collide); },
        [&](auto& c) { manager.distance(&c, &Collector<S>::distance); },
        [&](auto& c) { manager.distance(probe, &c, &Collector<S>::distance); },
        [&](auto& c) {
          manager.distance(static_cast<Base*>(&other), &c, &Collector<S>::distance);
        }};
    for (const auto& query : queries) {
      Collector<S> all;
      query(all);
      ASSERT_GT(all.calls.size(), 4u);
      for (const std::size_t count : {std::size_t{1}, all.calls.size() / 2, all.calls.size()}) {
        const Calls<S> first(all.calls.begin(),
                             all.calls.begin() + static_cast<std::ptrdiff_t>(count));
        Collector<S> stopped, thrown;
        stopped.stop_at = count;
        query(stopped);
        EXPECT_EQ(stopped.calls, first);
        thrown.throw_at = count;
        EXPECT_THROW(query(thrown), CallbackError);
        EXPECT_EQ(thrown.calls, first);
      }
      // Nothing may change meanwhile, and all may afterwards.
      Collector<S> busy;
      busy.stop_at = 1;
      busy.during = [&] {
        EXPECT_THROW(manager.update(), std::invalid_argument);
        EXPECT_THROW(manager.update(scene[0]), std::invalid_argument);
        EXPECT_THROW(manager.clear(), std::invalid_argument);
        EXPECT_THROW(manager.registerObject(others[0]), std::invalid_argument);
        EXPECT_THROW(manager.unregisterObject(scene[0]), std::invalid_argument);
        EXPECT_EQ(collide(manager, probe), collide(manager, probe));
      };
      query(busy);
      manager.update();
    }
  }
}

// Logs of two runs would differ, or of one thread and two.
TYPED_TEST(ContinuousManager, TheOrderDependsOnNothingButTheObjects) {
  using S = TypeParam;
  MovingScene<S> scene;
  fill(scene, 1500, {MotionKind::kTranslation, MotionKind::kSpline}, 820, 0.03);
  const MovingScene<S> copy = scene.reallocated();
  const auto order = [](const MovingScene<S>& objects, int threads) {
    FiberOptions options;
    options.threads = threads;
    Manager<S> manager(options);
    manager.registerObjects(objects.objects());
    std::vector<std::pair<std::size_t, std::size_t>> numbers;
    for (const Calls<S>& calls : {collide(manager), everyPair(manager, objects[3])}) {
      EXPECT_GT(calls.size(), 1000u);
      for (const auto& [a, b] : calls) numbers.emplace_back(objects.indexOf(a), objects.indexOf(b));
    }
    return numbers;
  };
  const auto expected = order(scene, 1);
  EXPECT_EQ(order(scene, 2), expected);
  EXPECT_EQ(order(copy, 1), expected);
  EXPECT_EQ(order(copy, 2), expected);
}

// Several threads that make the first query would build at the same time.
TYPED_TEST(ContinuousManager, ThreadsShareTheFirstQuery) {
  using S = TypeParam;
  MovingScene<S> scene;
  fill(scene, 200, {MotionKind::kTranslation}, 821);
  Manager<S> manager, asked_alone;
  manager.registerObjects(scene.objects());
  asked_alone.registerObjects(scene.objects());
  std::vector<Calls<S>> found(4), near(4);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < found.size(); ++i) {
    threads.emplace_back([&, i] {
      found[i] = collide(manager);
      near[i] = everyPair(manager, scene[0]);
    });
  }
  for (std::thread& thread : threads) thread.join();
  const Calls<S> pairs = collide(asked_alone), by_distance = everyPair(asked_alone, scene[0]);
  expectPairs<S>(pairs, scene.objects(), nullptr, 0, true);
  EXPECT_EQ(by_distance.size(), scene.size() - 1);
  for (const auto& calls : found) EXPECT_EQ(calls, pairs);
  for (const auto& calls : near) EXPECT_EQ(calls, by_distance);
}

// Programs whose threads have little stack would crash.
TYPED_TEST(ContinuousManager, NeedsLittleStack) {
  using S = TypeParam;
  MovingScene<S> scene, others;
  fill(scene, 1000, {MotionKind::kTranslation, MotionKind::kSpline}, 822, 0.03);
  fill(others, 300, {MotionKind::kTranslation}, 823, 0.03);
  for (const FiberOptions& options : assortedContinuousOptions()) {
    runOnSmallStack([&] {
      Manager<S> manager(options), other(options);
      manager.registerObjects(scene.objects());
      other.registerObjects(others.objects());
      EXPECT_GT(collide(manager).size(), 1000u);
      manager.update();
      manager.update(scene[0]);
      using Base = fcl::BroadPhaseContinuousCollisionManager<S>;
      EXPECT_GT(collide(manager, static_cast<Base*>(&other)).size(), 300u);
      EXPECT_FALSE(collide(manager, others[0]).empty());
      EXPECT_EQ(everyPair(manager, others[0]).size(), scene.size());
      Collector<S> own, both;
      own.stop_at = both.stop_at = 1;
      manager.distance(&own, &Collector<S>::distance);
      manager.distance(static_cast<Base*>(&other), &both, &Collector<S>::distance);
      EXPECT_EQ(own.calls.size() + both.calls.size(), 2u);
    });
  }
}

/// Lowers the distance to that of two spheres that move along lines, at their nearest.
template <typename S>
struct NearestSpheres {
  std::size_t calls = 0;
  S least = std::numeric_limits<S>::max();

  static double distanceOf(const Moving<S>& a, const Moving<S>& b) {
    const auto place = [](const Moving<S>& object, double t) -> Eigen::Vector3d {
      fcl::Transform3<S> pose;
      object.getMotion()->integrate(static_cast<S>(t));
      object.getMotion()->getCurrentTransform(pose);
      return pose.translation().template cast<double>();
    };
    const auto radius = [](const Moving<S>& object) {
      return double(static_cast<const fcl::Sphere<S>&>(*object.collisionGeometry()).radius);
    };
    const Eigen::Vector3d from = place(a, 0) - place(b, 0), to = place(a, 1) - place(b, 1);
    const Eigen::Vector3d along = to - from;
    const double square = along.squaredNorm();
    const double t = square > 0 ? std::clamp(-from.dot(along) / square, 0.0, 1.0) : 0;
    return std::max(0.0, (from + t * along).norm() - radius(a) - radius(b));
  }
  static bool take(Moving<S>* a, Moving<S>* b, void* data, S& dist) {
    auto& self = *static_cast<NearestSpheres*>(data);
    ++self.calls;
    self.least = std::min(self.least, static_cast<S>(distanceOf(*a, *b)));
    dist = self.least;
    return false;
  }
};

// A planner would trust a distance that is too large, or wait for every pair.
TYPED_TEST(ContinuousManager, DistanceFindsTheNearestOfAllTimes) {
  using S = TypeParam;
  using Base = typename Manager<S>::Base;
  Random random(822);
  MovingScene<S> scene, others;
  for (int i = 0; i < 200; ++i) {
    auto& to = i < 150 ? scene : others;
    to.addSphere(random.inCube(5), random.inCube(5), i % 40 == 0 ? 0.2 : 1e-3);
  }
  FiberOptions options;
  options.margin = 0.5;  // has no effect
  Manager<S> manager(options), other;
  manager.registerObjects(scene.objects());
  other.registerObjects(others.objects());
  const auto expectLeast = [](const NearestSpheres<S>& search, const auto& mine,
                              const auto& theirs) {
    double least = std::numeric_limits<double>::max();
    std::size_t pairs = 0;
    for (auto* a : mine) {
      for (auto* b : theirs) {
        if (a == b) continue;
        least = std::min(least, NearestSpheres<S>::distanceOf(*a, *b));
        ++pairs;
      }
    }
    EXPECT_EQ(search.least, static_cast<S>(least));
    EXPECT_LT(search.calls, pairs / 4);
  };
  NearestSpheres<S> own, with, one;
  manager.distance(&own, &NearestSpheres<S>::take);
  expectLeast(own, scene.objects(), scene.objects());
  manager.distance(static_cast<Base*>(&other), &with, &NearestSpheres<S>::take);
  expectLeast(with, scene.objects(), others.objects());
  manager.distance(others[5], &one, &NearestSpheres<S>::take);
  expectLeast(one, scene.objects(), std::vector<Moving<S>*>{others[5]});
  // All that come nearer than a distance that stays, in each form.
  const auto expectWithin = [](const Calls<S>& calls, const auto& mine, const auto& theirs) {
    const std::set<std::pair<Moving<S>*, Moving<S>*>> found(calls.begin(), calls.end());
    EXPECT_EQ(found.size(), calls.size());
    for (auto* a : mine) {
      for (auto* b : theirs) {
        if (&mine == &theirs && a >= b) continue;
        const std::size_t times = found.count({a, b}) + found.count({b, a});
        if (NearestSpheres<S>::distanceOf(*a, *b) < 0.99) {
          EXPECT_EQ(times, 1u);
        } else if (SeparationOracle<S>({a, b}, 1).ofLines(0, 1) > 1.01L) {
          EXPECT_EQ(times, 0u);
        }
      }
    }
  };
  expectWithin(Within<S>::of(manager, 1), scene.objects(), scene.objects());
  expectWithin(Within<S>::of(manager, 1, static_cast<Base*>(&other)), scene.objects(),
               others.objects());
  expectWithin(Within<S>::of(manager, 1, others[5]), scene.objects(),
               std::vector<Moving<S>*>{others[5]});
  // Every pair once, if nothing is lowered.
  const Calls<S> every = everyPair(manager);
  EXPECT_EQ(every.size(), 150u * 149 / 2);
  EXPECT_EQ((std::set<std::pair<Moving<S>*, Moving<S>*>>(every.begin(), every.end()).size()),
            every.size());
}

// A program that has FCL's callback would crash or wait for pairs that never come.
TYPED_TEST(ContinuousManager, FclsQueriesNameTheOverload) {
  using S = TypeParam;
  using Base = typename Manager<S>::Base;
  MovingScene<S> scene;
  scene.addSphere({0, 0, 0}, {1, 0, 0}, 1);
  Manager<S> manager, other;
  manager.registerObjects(scene.objects());
  const Base& fcls = manager;
  Base* partner = &other;
  const fcl::CollisionCallBack<S> collide = [](auto*, auto*, void*) { return false; };
  const fcl::DistanceCallBack<S> distance = [](auto*, auto*, void*, S&) { return false; };
  const auto names_collide = HasSubstr(
      "collide: its callback takes fcl::CollisionObject, which a "
      "continuous object is not; pass an "
      "fcl::ContinuousCollisionCallBack");
  const auto names_distance = HasSubstr("pass an fcl::ContinuousDistanceCallBack");
  EXPECT_THAT(textOf([&] { fcls.collide(nullptr, collide); }), names_collide);
  EXPECT_THAT(textOf([&] { fcls.collide(scene[0], nullptr, collide); }), names_collide);
  EXPECT_THAT(textOf([&] { fcls.collide(partner, nullptr, collide); }), names_collide);
  EXPECT_THAT(textOf([&] { fcls.distance(nullptr, distance); }), names_distance);
  EXPECT_THAT(textOf([&] { fcls.distance(scene[0], nullptr, distance); }), names_distance);
  EXPECT_THAT(textOf([&] { fcls.distance(partner, nullptr, distance); }), names_distance);
}

// Mistakes would show later, elsewhere, or never.
TYPED_TEST(ContinuousManager, MistakesAreRefusedAndChangeNothing) {
  using S = TypeParam;
  using Base = typename Manager<S>::Base;
  const auto nan = std::numeric_limits<S>::quiet_NaN();
  MovingScene<S> scene;
  fill(scene, 20, {MotionKind::kTranslation}, 823);
  const auto sphere = std::make_shared<fcl::Sphere<S>>(S(1));
  Moving<S>* still = scene.add(sphere, nullptr);
  Manager<S> manager;
  manager.registerObjects({scene[0], scene[1]});
  const auto still_holds_two = [&] { EXPECT_EQ(manager.size(), 2u); };
  EXPECT_THAT(textOf([&] {
                manager.registerObjects({scene[2], nullptr});
              }),
              HasSubstr("registerObjects: object 1 is null"));
  EXPECT_THAT(textOf([&] {
                manager.registerObjects({scene[2], scene[2]});
              }),
              HasSubstr("object 1 is registered already"));
  EXPECT_THAT(textOf([&] { manager.registerObject(scene[1]); }),
              HasSubstr("registerObject: object 0 is registered already"));
  EXPECT_THAT(textOf([&] { manager.registerObject(still); }),
              HasSubstr("object 0: it has no motion; construct it with one"));
  EXPECT_THAT(textOf([&] {
                manager.registerFiber({scene.add(sphere, scene.translation({0, 0, 0}, {1, 0, 0}))});
              }),
              HasSubstr("registerFiber: object 0 is not a capsule, cylinder or box"));
  EXPECT_THAT(textOf([&] { manager.unregisterObject(scene[5]); }), HasSubstr("is not registered"));
  EXPECT_THAT(textOf([&] { manager.unregisterObject(nullptr); }), HasSubstr("is null"));
  EXPECT_THAT(textOf([&] {
                manager.update(std::vector<Moving<S>*>{scene[0], nullptr});
              }),
              HasSubstr("update: object 1 is null"));
  EXPECT_THAT(textOf([&] { manager.fiberSegment(scene[5]); }), HasSubstr("is not registered"));
  still_holds_two();
  void* none = nullptr;
  Collector<S> collector;
  EXPECT_THAT(textOf([&] { manager.collide(none, fcl::ContinuousCollisionCallBack<S>(nullptr)); }),
              HasSubstr("the callback is null"));
  EXPECT_THAT(textOf([&] {
                manager.collide(static_cast<Moving<S>*>(nullptr), &collector,
                                &Collector<S>::collide);
              }),
              HasSubstr("the object is null"));
  EXPECT_THAT(textOf([&] {
                manager.distance(static_cast<Base*>(nullptr), &collector, &Collector<S>::distance);
              }),
              HasSubstr("the manager is null"));
  EXPECT_THAT(textOf([&] { manager.collide(still, &collector, &Collector<S>::collide); }),
              HasSubstr("the given object: it has no motion"));
  Foreign<S> foreign;
  foreign.objects = {scene[3], still};
  EXPECT_THAT(textOf([&] {
                manager.collide(static_cast<Base*>(&foreign), &collector, &Collector<S>::collide);
              }),
              HasSubstr("object 1 of the other manager: it has no motion"));
  EXPECT_TRUE(collector.calls.empty());

  // After a failed update all objects are there, and queries wait for a good one.
  auto& motion = dynamic_cast<fcl::TranslationMotion<S>&>(*scene[1]->getMotion());
  const fcl::TranslationMotion<S> good = motion;
  fcl::Transform3<S> nowhere = fcl::Transform3<S>::Identity();
  nowhere.translation()[0] = nan;
  Manager<S> larger;  // so that one object is updated by itself
  larger.registerObjects({scene.objects().begin(), scene.objects().begin() + 20});
  for (const bool single : {false, true}) {
    larger.setup();
    motion = fcl::TranslationMotion<S>(nowhere, nowhere);
    EXPECT_THAT(textOf([&] { single ? larger.update(scene[1]) : larger.update(); }),
                HasSubstr("its motion has parameters that are NaN"));
    EXPECT_EQ(larger.size(), 20u);
    EXPECT_THAT(textOf([&] { collide(larger); }), HasSubstr("the last update failed"));
    motion = good;
    larger.update();
    EXPECT_NO_THROW(collide(larger));
  }
  FiberOptions options;
  options.threads = 0;
  EXPECT_THAT(textOf([&] { Manager<S>{options}; }), HasSubstr("threads is 0"));
}

}  // namespace
}  // namespace fcl_fibers::test
