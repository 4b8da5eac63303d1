// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/ellipsoid.h>

#include "support/managed.h"
#include "support/mesh_models.h"
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

/// What may come and go beside a few strands: meshes, of which some are solid, half-spaces, planes
/// and other shapes.
template <typename S>
struct Visitors {
  Scene<S> scene;
  std::vector<fcl::CollisionObject<S>*> all;

  explicit Visitors(std::uint64_t seed, std::size_t strands = 4)
      : scene(strandScene<S>(strands, 8, seed)) {
    Random random(seed + 1);
    const auto model = makeModel<S>(modelTypes<S>().front(), blob(0.3, 0.2, 6, 4));
    for (int i = 0; i < 24; ++i) {
      const Eigen::Vector3d place = random.inCube(0.6);
      const Eigen::Quaterniond turn = random.rotation();
      if (i % 4 == 0) scene.add(model, makePose<S>(turn, place));
      if (i % 8 == 1) scene.addHalfspace(random.direction(), -0.3);
      if (i % 8 == 5) scene.addPlane(random.direction(), random.between(-0.3, 0.3));
      if (i % 8 == 2) scene.addMesh(place, 0.2);
      if (i % 8 == 6) scene.addHalfspace(Eigen::Vector3d::Unit(i % 3), -0.4);
      if (i % 8 == 3) scene.addBox(place, turn, {0.2, 0.1, 0.3});
      if (i % 8 == 7) scene.addSphere(place, 0.1);
    }
    all = scene.loose();
  }
};

// What comes or goes one by one would be read with all others, or not at all.
TYPED_TEST(ComingAndGoing, WhatIsBesideTheTreeMayComeAndGoOneByOne) {
  using S = typename TypeParam::Scalar;
  FiberManagerOptions by_capsules;
  by_capsules.report = Report::kCapsules;
  by_capsules.margin = 0.02;
  by_capsules.ignored_neighbors = 2;
  for (const FiberManagerOptions& options : {FiberManagerOptions(), by_capsules}) {
    Visitors<S> visitors(331);
    Scene<S> other_scene = strandScene<S>(2, 6, 333);
    other_scene.addHalfspace({0, 0.6, 0.8}, -0.3);
    other_scene.addMesh({0, 0.2, 0}, 0.2);
    Managed<TypeParam> managed(options), other(options);
    for (const auto& fiber : visitors.scene.fibers()) managed.registerFiber(fiber);
    other.registerEach(other_scene.objects());
    std::vector<fcl::CollisionObject<S>*> outside = visitors.all, inside;
    Random random(334);
    for (int round = 0; round < 30 && !this->HasFailure(); ++round) {
      const std::size_t what = random.below(round < 12 ? 5 : 8);
      SCOPED_TRACE(describe(options) + ", round " + std::to_string(round) + ", call " +
                   std::to_string(what));
      if (what < 3 && !outside.empty()) {
        const std::size_t i = random.below(outside.size());
        managed.registerObject(outside[i]);
        inside.push_back(outside[i]);
        outside.erase(outside.begin() + static_cast<std::ptrdiff_t>(i));
      } else if ((what == 5 || what == 6) && !inside.empty()) {
        // The first, the last or any.
        const std::size_t last = inside.size() - 1;
        const std::size_t i = round % 3 == 0 ? 0 : round % 3 == 1 ? last : random.below(last + 1);
        managed.unregisterObject(inside[i]);
        outside.push_back(inside[i]);
        inside.erase(inside.begin() + static_cast<std::ptrdiff_t>(i));
      } else if (what == 3 && !inside.empty()) {
        auto* const one = inside[random.below(inside.size())];
        jolt(*one, random, 0.2, 0.5);
        managed->update(one);
      } else if (what == 4 && inside.size() > 3) {
        std::vector<fcl::CollisionObject<S>*> some = managed.every(3);
        some.insert(some.end(), {inside[1], inside[0], inside[1]});
        jolt(some, random, 0.1, 0.3);
        managed->update(some);
      } else {
        jolt(managed.objects(), random, 0.02, 0.1);
        managed->update();
      }
      EXPECT_TRUE(managed.answersSelf());
      EXPECT_FALSE(managed->movedSinceUpdate());
      if (round % 6 == 5) {
        EXPECT_TRUE(managed.answersWith(other, 0));
        EXPECT_TRUE(other.answersWith(managed, 0));
        for (auto* object : visitors.all) EXPECT_TRUE(managed.answersWith(object, 0));
        managed.expectNearest();
      }
    }
    EXPECT_GT(inside.size(), 4u);
  }
}

/// That a manager has the pairs of a new one of the same objects, among them and with each.
template <typename Config, typename Object>
void expectPairsOfANew(const Managed<Config>& managed, const Managed<Config>& anew,
                       const std::vector<Object*>& partners) {
  const auto asSet = [](const auto& calls) {
    std::set<std::pair<Object*, Object*>> pairs;
    for (const auto& [a, b] : calls) EXPECT_TRUE(pairs.insert(std::minmax(a, b)).second);
    return pairs;
  };
  EXPECT_TRUE(asSet(selfPairs(*managed)) == asSet(selfPairs(*anew)));
  for (Object* one : partners) {
    EXPECT_TRUE(asSet(pairsWith(*managed, *one)) == asSet(pairsWith(*anew, *one)));
  }
}

// What is new would never be read if something newer has gone before a query.
TYPED_TEST(ComingAndGoing, WhatGoesUnreadLeavesTheOthersToBeRead) {
  using S = typename TypeParam::Scalar;
  using Object = fcl::CollisionObject<S>;
  std::vector<FiberManagerOptions> all = optionsToTest<TypeParam>(0);
  all[1].margin = 0.02;
  if (TypeParam::kVolume == LeafVolume::kBox) {
    all.push_back(all[1]);
    all.back().motion = true;
  }
  for (const FiberManagerOptions& options : all) {
    Random random(354);
    // So many strands that the tree stays.
    Visitors<S> visitors(351, 12);
    addShapes(visitors.scene, 11, 0.3, 353);
    visitors.scene.addCapsule({0, 0, 0}, {0.3, 0.1, 0}, 0.05);
    const auto ellipsoid = std::make_shared<fcl::Ellipsoid<S>>(S(0.3), S(0.1), S(0.2));
    for (int i = 0; i < 6; ++i) {
      visitors.scene.add(ellipsoid, makePose<S>(random.rotation(), random.inCube(0.6)));
    }
    std::vector<Object*> outside = visitors.scene.loose(), inside;
    Managed<TypeParam> managed(options);
    for (const auto& fiber : visitors.scene.fibers()) managed.registerFiber(fiber);
    managed->setup();
    const auto exchange = [&](std::vector<Object*>& from, std::vector<Object*>& to,
                              std::size_t first) {
      const std::size_t i = first + random.below(from.size() - first);
      to.push_back(from[i]);
      from.erase(from.begin() + static_cast<std::ptrdiff_t>(i));
      return to.back();
    };
    for (int round = 0; round < 20 && !this->HasFailure(); ++round) {
      SCOPED_TRACE(describe(options) + (options.motion ? ", motion" : "") + ", round " +
                   std::to_string(round));
      const std::size_t old = inside.size();
      for (std::size_t i = 2 + random.below(3); i > 0 && !outside.empty(); --i) {
        managed.registerObject(exchange(outside, inside, 0));
      }
      for (std::size_t i = 1 + random.below(2); i > 0 && inside.size() > old; --i) {
        managed.unregisterObject(exchange(inside, outside, old));
      }
      while (inside.size() > 9) managed.unregisterObject(exchange(inside, outside, 0));
      EXPECT_TRUE(managed.answersSelf());
      Managed<TypeParam> anew(options);
      for (const auto& fiber : visitors.scene.fibers()) anew.registerFiber(fiber);
      anew.registerEach(inside);
      expectPairsOfANew(managed, anew, inside);
      EXPECT_FALSE(managed->movedSinceUpdate());
    }
  }
}

// An update of another object would make up for a query that has refused one, and what came with
// that one would never be read.
TYPED_TEST(ComingAndGoing, AfterARefusalAnUpdateOfAnotherObjectIsNotEnough) {
  using S = typename TypeParam::Scalar;
  using Object = fcl::CollisionObject<S>;
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0)) {
    for (const bool are_meshes : {false, true}) {
      for (int update = 0; update < 4; ++update) {
        SCOPED_TRACE(describe(options) + (are_meshes ? ", meshes" : ", half-spaces") + ", update " +
                     std::to_string(update));
        Scene<S> scene = strandScene<S>(12, 16, 356);
        const auto model = makeModel<S>(modelTypes<S>().front(), blob(0.3, 0.2, 6, 4));
        const auto addOne = [&](int axis) -> Object* {
          if (!are_meshes) return scene.addHalfspace(Eigen::Vector3d::Unit(axis), -0.3);
          const Eigen::Vector3d place = 0.2 * Eigen::Vector3d::Unit(axis);
          return scene.add(model, makePose<S>(Eigen::Quaterniond::Identity(), place));
        };
        Object* const old = addOne(0);
        Managed<TypeParam> managed(scene, options);
        EXPECT_TRUE(managed.answersSelf());
        Object *const young = addOne(1), *const broken = addOne(2);
        managed.registerObject(young);
        managed.registerObject(broken);
        broken->setTranslation(fcl::Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN()));
        EXPECT_THROW(selfPairs(*managed), std::invalid_argument);
        managed.unregisterObject(broken);
        translate(*old, {0.1, 0.05, 0});
        if (update == 0) managed->update(old);
        if (update == 1) managed->update({scene[3], old});
        if (update == 2) managed->update({young, old});
        if (update == 3) managed->update();
        EXPECT_TRUE(managed.answersSelf());
        EXPECT_TRUE(managed.answersWith(young));
        EXPECT_TRUE(managed.answersWith(old));
      }
    }
  }
}

// A step would begin where an object was two steps ago, or one that has come have a way.
TEST(ComingAndGoingInSteps, AnswersAreThoseOfANewManager) {
  using Config = LayeredAabb<double, Topology::kBundle>;
  using Object = fcl::CollisionObject<double>;
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  options.motion = true;
  std::size_t found = 0, only_on_their_way = 0;
  for (std::uint64_t seed = 341; seed < 345; ++seed) {
    Visitors<double> visitors(seed);
    options.margin = seed % 2 == 0 ? 0.01 : 0;
    const auto manager = Config::make(options);
    // The poses at the start and at the end of the step, of what is registered.
    struct Poses {
      fcl::Transform3d start, end;
    };
    std::vector<Object*> inside = visitors.scene.objects(), outside;
    std::map<Object*, Poses> poses;
    for (std::size_t i = 0; i < 12; ++i) {
      outside.push_back(inside.back());
      inside.pop_back();
    }
    // Half of the closed meshes.
    const std::set<const Object*> solid{visitors.all[0], visitors.all[8], visitors.all[16]};
    const auto enter = [&](FiberCollisionManager<double>& its, Object* object) {
      its.registerObstacle(object, ObstacleOptions{solid.count(object) > 0});
    };
    for (Object* object : inside) {
      enter(*manager, object);
      poses[object] = {object->getTransform(), object->getTransform()};
    }
    const auto numbersOf = [&](const Calls<double>& calls) {
      std::set<std::pair<Object*, Object*>> pairs;
      for (const auto& [a, b] : calls) EXPECT_TRUE(pairs.insert(std::minmax(a, b)).second);
      return pairs;
    };
    const auto check = [&] {
      const auto pairs = numbersOf(selfPairs(*manager));
      const auto anew = Config::make(options);
      for (Object* object : inside) {
        object->setTransform(poses[object].start);
        enter(*anew, object);
      }
      const auto at_start = numbersOf(selfPairs(*anew));
      anew->beginStep();
      for (Object* object : inside) object->setTransform(poses[object].end);
      anew->update();
      EXPECT_TRUE(pairs == numbersOf(selfPairs(*anew)));
      anew->endStep();
      const auto at_end = numbersOf(selfPairs(*anew));
      found += pairs.size();
      for (const auto& pair : pairs) {
        only_on_their_way += at_start.count(pair) + at_end.count(pair) == 0 ? 1 : 0;
      }
      manager->beginStep();
      for (auto& [object, its] : poses) its.start = its.end;
    };
    const auto moveThen = [&](const std::vector<Object*>& moved, auto&& update) {
      update();
      for (Object* object : moved) poses[object].end = object->getTransform();
    };
    check();
    Random random(seed + 10);
    for (int round = 0; round < 40 && !HasFailure(); ++round) {
      const std::size_t what = random.below(9);
      SCOPED_TRACE("seed " + std::to_string(seed) + ", round " + std::to_string(round) + ", call " +
                   std::to_string(what));
      if (what < 2 && !outside.empty()) {
        Object* const one = outside.back();
        outside.pop_back();
        inside.push_back(one);
        enter(*manager, one);
        // Where it is read first, it rests.
        poses[one] = {one->getTransform(), one->getTransform()};
        check();
      } else if (what == 2) {
        const std::size_t i = round % 2 == 0 ? inside.size() - 1 : random.below(inside.size());
        manager->unregisterObject(inside[i]);
        poses.erase(inside[i]);
        outside.insert(outside.begin(), inside[i]);
        inside.erase(inside.begin() + static_cast<std::ptrdiff_t>(i));
      } else if (what < 5) {
        Object* const one = inside[random.below(inside.size())];
        jolt(*one, random, 0.4, 0.3);
        moveThen({one}, [&] { manager->update(one); });
      } else if (what < 7) {
        std::vector<Object*> some;
        for (std::size_t i = random.below(5); i < inside.size(); i += 5) some.push_back(inside[i]);
        jolt(some, random, 0.2, 0.2);
        moveThen(some, [&] { manager->update(some); });
      } else {
        jolt(inside, random, 0.2, 0.2);
        moveThen(inside, [&] { manager->update(); });
      }
      // Several updates may be one step.
      if (random.below(3) > 0) check();
    }
  }
  EXPECT_GT(found, 5000u);
  EXPECT_GT(only_on_their_way, 50u);
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

// A program that adds, removes or updates few objects would wait for all to be read, or one that
// does so with many have a tree that answers slowly.
TYPED_TEST(ComingAndGoing, ManyBuildTheTreeAnewAndFewDoNot) {
  using S = typename TypeParam::Scalar;
  // Two that overlap, one of which moves away and is not updated. It counts there once all are
  // read.
  const auto readsAll = [](std::size_t count, auto&& change) {
    Scene<S> scene;
    for (std::size_t i = 0; i < 2 * count; ++i) {
      scene.addSphere({3.0 * static_cast<double>(i < 2 ? 0 : i), 0, 0}, 1);
    }
    const std::vector<fcl::CollisionObject<S>*> first(
        scene.objects().begin(), scene.objects().begin() + static_cast<std::ptrdiff_t>(count));
    Managed<TypeParam> manager(first);
    EXPECT_EQ(selfPairs(*manager).size(), 1u);
    moveTo(*scene[0], makePose<S>(Eigen::Quaterniond::Identity(), {0, 50, 0}));
    change(manager, scene);
    return selfPairs(*manager).empty();
  };
  for (const std::size_t count : {std::size_t{48}, std::size_t{400}}) {
    SCOPED_TRACE(count);
    const auto readsAllIfAdded = [&](std::size_t added) {
      return readsAll(count, [&](auto& manager, const Scene<S>& scene) {
        for (std::size_t i = 0; i < added; ++i) manager.registerObject(scene[count + i]);
      });
    };
    const auto readsAllIfRemoved = [&](std::size_t removed) {
      return readsAll(count, [&](auto& manager, const Scene<S>&) {
        for (std::size_t i = 0; i < removed; ++i) manager.unregister(count - 1 - i);
      });
    };
    const auto readsAllIfUpdated = [&](std::size_t updated) {
      return readsAll(count, [&](auto& manager, const Scene<S>& scene) {
        manager->update({scene.objects().begin() + 2,
                         scene.objects().begin() + 2 + static_cast<std::ptrdiff_t>(updated)});
      });
    };
    std::size_t few = 0;
    const auto isFew = [&](std::size_t added) {
      const double all = static_cast<double>(count + added), young = static_cast<double>(added);
      return young <= std::sqrt(2 * all) && young <= all / 8;
    };
    while (isFew(few + 1)) ++few;
    EXPECT_FALSE(readsAllIfAdded(few));
    EXPECT_TRUE(readsAllIfAdded(few + 1));
    few = 0;
    while (8 * (few + 1) <= count - (few + 1)) ++few;
    EXPECT_FALSE(readsAllIfRemoved(few));
    EXPECT_TRUE(readsAllIfRemoved(few + 1));
    EXPECT_FALSE(readsAllIfUpdated(count / 4));
    EXPECT_TRUE(readsAllIfUpdated(count / 4 + 1));
  }
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
