// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "support/managed.h"
#include "support/scene_generators.h"

// Objects are in one tree if they were registered before it was built, and in another one if they
// came later. Nobody who asks may see which.

namespace fcl_fibers::test {
namespace {

/// A distance callback that wants what is this near.
template <typename S>
struct NearPairs {
  S limit;
  Calls<S> calls;

  static bool visit(fcl::CollisionObject<S>* a, fcl::CollisionObject<S>* b, void* data, S& dist) {
    auto& self = *static_cast<NearPairs*>(data);
    self.calls.emplace_back(a, b);
    dist = std::min(dist, self.limit);
    return false;
  }
};

template <typename S, class... Partner>
Calls<S> nearPairs(const fcl::BroadPhaseCollisionManager<S>& manager, S limit,
                   Partner*... partner) {
  NearPairs<S> near{limit, {}};
  manager.distance(partner..., &near, &NearPairs<S>::visit);
  return near.calls;
}

/// What is in one of the sets only.
template <typename S>
std::size_t differing(const Calls<S>& calls, const Calls<S>& others) {
  const auto set = asSet(calls), other_set = asSet(others);
  // The first pair comes before anything is known of how near others are.
  return static_cast<std::size_t>(std::count_if(set.begin(), set.end(), [&](const auto& pair) {
    return pair != calls.front() && other_set.count(pair) == 0;
  }));
}

/// Under Report::kVolumes it depends on the pairs before whether one that is not near is skipped.
template <typename S>
void expectSameNear(Report report, const Calls<S>& calls, const Calls<S>& others) {
  EXPECT_EQ(calls.empty(), others.empty());
  if (report == Report::kVolumes) return;
  EXPECT_EQ(differing<S>(calls, others), 0u);
  EXPECT_EQ(differing<S>(others, calls), 0u);
}

/// That two managers of the same objects have the same pairs in every query.
/// @param objects  to ask about
/// @param other    to ask about as well
template <typename Config>
void expectSamePairs(const Managed<Config>& one, const Managed<Config>& two,
                     const typename Managed<Config>::Objects& objects,
                     const Managed<Config>& other) {
  using S = typename Config::Scalar;
  const S limit = S(0.03);
  const Report report = one->options().report;
  EXPECT_TRUE(asSet(selfPairs(*one)) == asSet(selfPairs(*two)));
  expectSameNear<S>(report, nearPairs<S>(*one, limit), nearPairs<S>(*two, limit));
  for (auto* object : objects) {
    EXPECT_TRUE(asSet(pairsWith(*one, *object)) == asSet(pairsWith(*two, *object)));
    expectSameNear<S>(report, nearPairs<S>(*one, limit, object), nearPairs<S>(*two, limit, object));
  }
  EXPECT_TRUE(asSet(pairsWith(*one, *other)) == asSet(pairsWith(*two, *other)));
  EXPECT_TRUE(asSet(pairsWith(*other, *one)) == asSet(pairsWith(*other, *two)));
  expectSameNear<S>(report, nearPairs<S>(*one, limit, &*other), nearPairs<S>(*two, limit, &*other));
  expectSameNear<S>(report, nearPairs<S>(*other, limit, &*one), nearPairs<S>(*other, limit, &*two));
}

std::vector<FiberManagerOptions> someOptions() {
  std::vector<FiberManagerOptions> all = assortedOptions();
  all.emplace_back();
  return all;
}

MANAGER_SUITE(Generations, FiberManagers);

// Objects that come one by one, with an update after each, would be missed, or be found where they
// are instead of where the update read them.
TYPED_TEST(Generations, ObjectsThatComeWithAnUpdateEachAreFoundWhereItReadThem) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(9, 16, 321), other_scene = strandScene<S>(4, 6, 322);
  addShapes(scene, 7, 0.2, 323);
  std::size_t options_seen = 0;
  for (const FiberManagerOptions& options : someOptions()) {
    // Few objects are read at first, and so many that there is more than one block of them.
    const std::size_t count = std::array<std::size_t, 4>{2, 5, 20, 100}[options_seen++ % 4];
    SCOPED_TRACE(describe(options) + ", " + std::to_string(count));
    Managed<TypeParam> once(options), each(options), other(other_scene, options);
    Random random(324);
    const auto comes = [&](std::size_t i) {
      each.registerObject(scene[scene.size() - 1 - i]);
      once.registerObject(scene[scene.size() - 1 - i]);
      each->update();
    };
    const auto expectSame = [&](const char* what) {
      SCOPED_TRACE(what);
      once->update();
      jolt(scene.objects(), random, 0.02, 0.1);
      EXPECT_EQ(each->movedSinceUpdate(), once->movedSinceUpdate());
      expectSamePairs(once, each, each.every(11), other);
    };
    for (std::size_t i = 0; i < count; ++i) comes(i);
    expectSame("each came with an update");
    each->update();
    expectSame("all moved");
    each->update();
    for (std::size_t i = count; i < count + 5; ++i) comes(i);
    fcl::CollisionObject<S>* const one = scene[scene.size() - 1 - count];
    jolt(std::vector{one}, random, 0.05, 0.3);
    each->update(one);
    expectSame("more came, of which one was updated");
    each->update();
    for (std::size_t i = count + 5; i < count + 10; ++i) comes(i);
    jolt(std::vector{scene[scene.size() - 1 - (count + 5)]}, random, 0.05, 0.3);
    EXPECT_TRUE(each->movedSinceUpdate());
    each->update();
    EXPECT_FALSE(each->movedSinceUpdate());
    comes(count + 10);
    for (Managed<TypeParam>* managed : {&each, &once}) {
      managed->unregisterObject(scene[scene.size() - 1 - (count + 7)]);
    }
    expectSame("one of those that came has gone");
    each->update();
    comes(count + 11);
    std::vector<std::unique_ptr<fcl::CollisionObject<S>>> owned;
    std::vector<fcl::CollisionObject<S>*> copies;
    for (const auto* object : each.objects()) {
      owned.push_back(std::make_unique<fcl::CollisionObject<S>>(*object));
      copies.push_back(owned.back().get());
    }
    EXPECT_TRUE(each.clone(copies).answersSelf(0));
    expectSame("one came before a clone");
    each->clear();
    EXPECT_TRUE(selfPairs(*each).empty());
  }
}

// Whether a pair is reported would depend on when its objects were registered.
TYPED_TEST(Generations, ObjectsHaveTheSamePairsWheneverTheyAreRegistered) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(12, 16, 311);
  scene.addFiber({{-0.5, 0, 0}, {0, 0.3, 0}, {0.2, -0.1, 0.4}, {0, 0, 0}}, 0.03,
                 FiberEnds::kClosed);
  addShapes(scene, 7, 0.2, 312);
  scene.addHalfspace({0, 0, 1}, -0.4);
  scene.addHalfspace({1, 1, 1}, -0.6);
  scene.addPlane({0, 1, 0}, 0.2);
  Scene<S> other_scene = strandScene<S>(6, 9, 313);
  other_scene.addHalfspace({0, 1, 0}, -0.6);
  addShapes(other_scene, 6, 0.2, 314);
  for (const FiberManagerOptions& options : someOptions()) {
    SCOPED_TRACE(describe(options));
    Managed<TypeParam> before(options), after(options), other(options);
    before.registerFibers(scene);
    before->setup();
    for (std::size_t f = 0; f < scene.fibers().size(); ++f) {
      if (f == scene.fibers().size() - 1) after->setup();
      after.registerFiber(scene.fibers()[f], scene.ends()[f]);
    }
    after.registerEach(scene.loose());
    // Of the other one some come later too.
    for (std::size_t i = 0; i < other_scene.size(); ++i) {
      if (i == other_scene.size() - 4) other->setup();
      other.registerObject(other_scene[i]);
    }
    const auto expectSame = [&](const char* what) {
      SCOPED_TRACE(what);
      expectSamePairs(before, after, after.every(17), other);
      expectSamePairs(before, after, other.every(17), other);
    };
    expectSame("registered");
    EXPECT_TRUE(after.answersSelf());
    EXPECT_TRUE(after.answersWith(other));
    after.expectNearest();

    Random random(315);
    jolt(scene.objects(), random, 0.02, 0.1);
    before->update();
    after->update();
    expectSame("moved");
    const std::vector<fcl::CollisionObject<S>*> some{scene[4], scene[scene.size() - 1],
                                                     scene[scene.size() - 8]};
    jolt(some, random, 0.05, 0.3);
    before->update(some);
    after->update(some);
    expectSame("some moved");
    for (const std::size_t i : {scene.size() - 3, std::size_t{40}}) {
      before.unregisterObject(scene[i]);
      after.unregisterObject(scene[i]);
    }
    expectSame("some gone");
    EXPECT_TRUE(after.answersSelf());
  }
}

// Long thin boxes were compared by their boxes where one came late, and by the spheres around them
// where both had been there.
TYPED_TEST(Generations, TwoLongBoxesSideBySideAreThePairThatTheirVolumesSay) {
  using S = typename TypeParam::Scalar;
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    FiberManagerOptions options;
    options.report = report;
    Scene<S> scene = soupScene<S>(30, 0.1, 316, {{100, 0, 0}, 1});
    const auto addBox = [&](double y) {
      return scene.addBox({0, y, 0}, Eigen::Quaterniond::Identity(), {10, 0.1, 0.1});
    };
    auto* const first = addBox(0);
    auto* const second = addBox(1.1);
    for (const int late : {0, 1, 2}) {
      SCOPED_TRACE(describe(options) + ", late: " + std::to_string(late));
      Managed<TypeParam> managed(options);
      for (std::size_t i = 0; i < scene.size(); ++i) {
        if (i + static_cast<std::size_t>(late) == scene.size()) managed->setup();
        managed.registerObject(scene[i]);
      }
      const auto has = [&](const Calls<S>& calls, auto* a, auto* b) {
        return std::count(calls.begin(), calls.end(), std::pair(a, b)) == 1;
      };
      const bool overlap = report == Report::kVolumes && TypeParam::kVolume == LeafVolume::kSphere;
      EXPECT_EQ(has(selfPairs(*managed), first, second), overlap);
      EXPECT_EQ(has(pairsWith(*managed, *first), second, first), overlap);
      EXPECT_EQ(has(pairsWith(*managed, *second), first, second), overlap);
      // They are farther apart than half a unit, so they are a pair only before that is the limit,
      // unless their volumes overlap and were not tested.
      NearPairs<S> near{S(0.5), {}};
      managed->distance(second, &near, &NearPairs<S>::visit);
      if (!overlap) {
        EXPECT_EQ(has(near.calls, first, second),
                  !near.calls.empty() && near.calls.front().first == first);
      }
      EXPECT_TRUE(managed.answersSelf(0));
      managed.expectNearest();
    }
  }
}

// A limb that is registered when the body moves already would collide with it.
TYPED_TEST(Generations, AGroupHasNoPairsAmongItselfAcrossThem) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(16, 14, 317);
  const std::size_t fibers = scene.fibers().size();
  for (const FiberManagerOptions& options : someOptions()) {
    SCOPED_TRACE(describe(options));
    std::vector<int> groups;
    for (std::size_t f = 0; f < fibers; ++f) groups.push_back(f % 3 == 0 ? 0 : f % 3 == 1 ? 7 : -2);
    groups.back() = 7;
    Managed<TypeParam> before(options), after(options), none(options);
    before.registerFibers(scene, groups);
    none.registerFibers(scene);
    for (std::size_t f = 0; f < fibers; ++f) {
      if (f == fibers - 1) after->setup();
      after.registerFiber(scene.fibers()[f], scene.ends()[f], FiberGroup{groups[f]});
    }
    const auto& late = scene.fibers().back();
    const auto inGroup = [&](const Managed<TypeParam>& managed) {
      std::size_t count = 0;
      for (const auto& [a, b] : selfPairs(*managed)) {
        const auto isLate = [&](auto* object) {
          return std::count(late.begin(), late.end(), object) != 0;
        };
        const auto groupOf = [&](auto* object) {
          return groups[managed->fiberSegment(object).fiber];
        };
        count += isLate(a) != isLate(b) && groupOf(a) == 7 && groupOf(b) == 7;
      }
      return count;
    };
    EXPECT_GT(inGroup(none), 0u) << "a scene that shows nothing";
    EXPECT_EQ(inGroup(after), 0u);
    EXPECT_TRUE(after.answersSelf());
    after.expectAnswersWith(after.every(5));
    after.expectNearest();
    after.expectEveryPair();
    for (auto* object : {late.front(), late.back(), scene[0], scene[20]}) {
      after.expectNearest(object);
      after.expectEveryPair(object);
    }
    // Objects that are in both keep their groups.
    expectSamePairs(before, after, after.every(5), none);
  }
}

}  // namespace
}  // namespace fcl_fibers::test
