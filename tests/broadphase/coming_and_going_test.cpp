// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <vector>

#include "support/managed.h"
#include "support/scene_generators.h"

// Few objects that come and go beside many that stay: the tree is not built anew for them, and
// every answer has to be as if it were.

namespace fcl_fibers::test {
namespace {

/// All of FCL's queries against brute force.
template <typename Config>
void expectAnswers(const Managed<Config>& managed, const Managed<Config>& other) {
  EXPECT_TRUE(managed.answersSelf());
  EXPECT_TRUE(managed.answersWith(other));
  EXPECT_TRUE(other.answersWith(managed));
  managed.expectAnswersWith(managed.every(7));
  managed.expectAnswersWith(other.every(7));
  managed.expectNearest();
  managed.expectNearest(other);
  for (auto* object : managed.every(7)) managed.expectNearest(object);
  for (auto* object : other.every(7)) managed.expectNearest(object);
}

MANAGER_SUITE(ComingAndGoing, FiberManagers);

// What came late, or has gone, would be missed or answered for.
TYPED_TEST(ComingAndGoing, AnswersAreThoseOfANewTree) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(12, 16, 301);
  const auto strands = scene.fibers();
  const auto curl = scene.addFiber({{-0.5, 0, 0}, {0, 0.3, 0}, {0.2, -0.1, 0.4}, {0, 0, 0}}, 0.03);
  scene.addHalfspace({0, 0, 1}, -0.4);
  scene.addSphere({0.1, 0.1, 0}, 0.1);
  scene.addPlane({1, 0, 0}, 0.3);
  scene.addMesh({0, 0, 0.2}, 0.15);
  Scene<S> other_scene = strandScene<S>(6, 9, 302);
  other_scene.addHalfspace({0, 1, 0}, -0.6);

  for (const FiberManagerOptions& options : assortedOptions()) {
    SCOPED_TRACE(describe(options));
    Managed<TypeParam> managed(options), other(options);
    for (const auto& fiber : strands) managed.registerFiber(fiber, FiberEnds::kClosed);
    other.registerEach(other_scene.objects());
    managed->setup();
    other->setup();

    managed.registerFiber(curl, FiberEnds::kClosed);
    managed.registerEach(scene.loose());
    for (const std::size_t i : {190u, 100u, 41u, 40u, 0u}) managed.unregister(i);
    other.unregister(20);
    expectAnswers(managed, other);

    SCOPED_TRACE("after a motion");
    Random random(303);
    jolt(managed.objects(), random, 0.02, 0.1);
    managed->update();
    expectAnswers(managed, other);
    for (const std::size_t i : {3u, 180u}) jolt(*managed[i], random, 0.02, 0.1);
    managed->update({managed[3], managed[180], curl[1]});
    expectAnswers(managed, other);

    SCOPED_TRACE("after some have gone again");
    managed.unregister(managed.size() - 2);
    managed.unregister(managed.size() - 4);
    expectAnswers(managed, other);
  }
}

// Those of its fiber that are in the tree already would be reported twice, or itself not at all.
TYPED_TEST(ComingAndGoing, AFiberMayBeContinued) {
  using S = typename TypeParam::Scalar;
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    FiberManagerOptions options;
    options.report = report;
    const Scene<S> scene = strandScene<S>(3, 60, 307);
    Managed<TypeParam> managed(options);
    const auto& objects = scene.objects();
    managed.registerEach({objects.begin(), objects.begin() + 150});
    for (std::size_t i = 150; i < 165; ++i) {
      EXPECT_TRUE(managed.answersSelf()) << i;
      managed.registerObject(objects[i]);
    }
    EXPECT_TRUE(managed.answersSelf());
    managed.expectEveryPair();
    managed->update();
    EXPECT_TRUE(managed.answersSelf());
  }
}

// One object that comes and goes each frame would cost a tree, make the manager grow, or be
// forgotten in the order of registration.
TYPED_TEST(ComingAndGoing, OneMayComeAndGoForever) {
  const auto scene = strandScene<typename TypeParam::Scalar>(12, 16, 304);
  Managed<TypeParam> managed;
  managed.registerFibers(scene);
  managed->setup();
  Random random(306);
  // Ids of those that left are dealt anew from time to time, so that memory goes up and down.
  const auto peak = [&] {
    std::size_t bytes = 0;
    for (int frame = 0; frame < 1000; ++frame) {
      auto* const one = managed.unregister(random.below(managed.size()));
      managed.registerObject(one);
      bytes = std::max(bytes, managed->memoryUsage());
      if (frame % 50 == 0) {
        EXPECT_TRUE(managed.answersWith(one)) << frame;
      }
    }
    return bytes;
  };
  const std::size_t first = peak();
  EXPECT_TRUE(managed.answersSelf());
  // Trees of as many segments differ by some nodes. A byte lost each time would be more.
  EXPECT_LE(peak(), first + 700);
  EXPECT_TRUE(managed.answersSelf());
}

// Objects would count where they are without an update that names them, and a broken one would be
// held against the update of another.
TYPED_TEST(ComingAndGoing, AYoungObjectIsReadAgainIfAnUpdateNamesIt) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(12, 16, 301);
  Managed<TypeParam> manager(scene);
  auto* late = scene.addCapsule({0, 0, 0}, {0, 0, 0.1}, 0.05);
  manager.registerObject(late);
  const auto with_it = [&] {
    const Calls<S> pairs = selfPairs(*manager);
    return std::count_if(pairs.begin(), pairs.end(), [&](const auto& pair) {
      return pair.first == late || pair.second == late;
    });
  };
  const auto before = with_it();
  EXPECT_GT(before, 0);
  late->setTranslation(fcl::Vector3<S>(100, 100, 100));
  manager->update(scene[3]);
  EXPECT_EQ(with_it(), before);
  late->setTranslation(fcl::Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN()));
  manager->update(scene[3]);
  EXPECT_EQ(with_it(), before);
  late->setTranslation(fcl::Vector3<S>(100, 100, 100));
  manager->update({scene[3], late});
  EXPECT_EQ(with_it(), 0);
}

// Nobody could fix what is not there any more.
TYPED_TEST(ComingAndGoing, AnEmptyManagerHasNothingToRefuse) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(2, 8, 5);
  Managed<TypeParam> manager(scene);
  const fcl::Vector3<S> place = scene[3]->getTranslation();
  scene[3]->setTranslation(fcl::Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN()));
  EXPECT_THROW(manager->update(), std::invalid_argument);
  EXPECT_THROW(selfPairs(*manager), std::invalid_argument);
  while (manager.size() > 0) manager.unregister(0);
  EXPECT_TRUE(manager.answersSelf(0));
  scene[3]->setTranslation(place);
  manager.registerObjects(scene.objects());
  EXPECT_TRUE(manager.answersSelf());
}

// An object that cannot be read would be passed over in silence.
TYPED_TEST(ComingAndGoing, ALateObjectThatHasGoneBadIsNamed) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(12, 16, 305);
  Managed<TypeParam> managed;
  managed.registerFibers(scene);
  managed->setup();
  auto* const late = scene.addCapsule({0, 0, 0}, {0, 0, 1}, 0.1);
  managed.registerObject(late);
  const auto pose = late->getTransform();
  auto bad = pose;
  bad.translation().x() = std::numeric_limits<S>::quiet_NaN();
  late->setTransform(bad);
  EXPECT_THROW(managed->update(), std::invalid_argument);
  EXPECT_THROW(selfPairs(*managed), std::invalid_argument);
  late->setTransform(pose);
  managed->update();
  EXPECT_TRUE(managed.answersSelf());
}

}  // namespace
}  // namespace fcl_fibers::test
