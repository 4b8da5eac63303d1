// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "support/managed.h"
#include "support/mesh_models.h"
#include "support/scene_generators.h"

// Few objects that come and go beside many that stay: the tree is not built anew for them, and
// every answer has to be as if it were.

namespace fcl_fibers::test {
namespace {

MANAGER_SUITE(ComingAndGoing, FiberManagers);

/// Meshes, half-spaces, planes and other shapes, which may come and go beside a few strands.
template <typename S>
void addVisitors(Scene<S>& scene, std::uint64_t seed) {
  Random random(seed);
  const auto model = makeModel<S>(modelTypes<S>().front(), blob(0.3, 0.2, 6, 4));
  for (int i = 0; i < 24; ++i) {
    const Eigen::Vector3d place = random.inCube(0.6), normal = random.direction();
    const Eigen::Quaterniond turn = random.rotation();
    if (i % 4 == 0) scene.add(model, makePose<S>(turn, place));
    if (i % 8 == 1) scene.addHalfspace(normal, -0.3);
    if (i % 8 == 5) scene.addPlane(normal, random.between(-0.3, 0.3));
    if (i % 8 == 2) scene.addMesh(place, 0.2);
    if (i % 8 == 6) scene.addHalfspace(Eigen::Vector3d::Unit(i % 3), -0.4);
    if (i % 8 == 3) scene.addBox(place, turn, {0.2, 0.1, 0.3});
    if (i % 8 == 7) scene.addSphere(place, 0.1);
  }
}

// What comes or goes one by one would be read with all others, or not at all.
TYPED_TEST(ComingAndGoing, WhatIsBesideTheTreeMayComeAndGoOneByOne) {
  using S = typename TypeParam::Scalar;
  FiberManagerOptions by_capsules;
  by_capsules.report = Report::kCapsules;
  by_capsules.margin = 0.02;
  by_capsules.ignored_neighbors = 2;
  for (const FiberManagerOptions& options : {FiberManagerOptions(), by_capsules}) {
    Scene<S> scene = strandScene<S>(4, 8, 331);
    addVisitors(scene, 332);
    Scene<S> other_scene = strandScene<S>(2, 6, 333);
    other_scene.addHalfspace({0, 0.6, 0.8}, -0.3);
    other_scene.addMesh({0, 0.2, 0}, 0.2);
    Managed<TypeParam> managed(options), other(options);
    for (const auto& fiber : scene.fibers()) managed.registerFiber(fiber);
    other.registerEach(other_scene.objects());
    std::vector<fcl::CollisionObject<S>*> outside = scene.loose(), inside;
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
        for (auto* object : scene.loose()) EXPECT_TRUE(managed.answersWith(object, 0));
        managed.expectNearest();
      }
    }
    EXPECT_GT(inside.size(), 4u);
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

// A segment, a tool or a wall that comes and goes each frame would cost a tree, make the manager
// grow, be answered for when it has gone, or be forgotten in the order of registration.
TYPED_TEST(ComingAndGoing, OneMayComeAndGoForever) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(12, 16, 304);
  auto* const tool = scene.addSphere({0.1, 0, 0}, 0.1);
  auto* const wall = scene.addHalfspace({0, 0, 1}, -0.4);
  for (auto* const visitor : {tool, wall, static_cast<decltype(tool)>(nullptr)}) {
    Managed<TypeParam> managed;
    for (const auto& fiber : scene.fibers()) managed.registerFiber(fiber);
    managed->setup();
    Random random(306);
    // Ids of those that left are dealt anew from time to time, so that memory goes up and down.
    const auto peak = [&] {
      std::size_t bytes = 0;
      for (int frame = 0; frame < 600; ++frame) {
        auto* one = visitor;
        if (one == nullptr) one = managed.unregister(random.below(managed.size()));
        if (one == tool) {
          moveTo(*one, makePose<S>(Eigen::Quaterniond::Identity(), {0.1, 0, 0}));
          jolt(*one, random, 0.02, 0.1);
        }
        managed.registerObject(one);
        if (frame % 50 == 0) {
          EXPECT_TRUE(managed.answersWith(one)) << frame;
          EXPECT_TRUE(managed.answersSelf()) << frame;
        }
        bytes = std::max(bytes, managed->memoryUsage());
        if (visitor == nullptr) continue;
        managed.unregisterObject(one);
        if (frame % 100 == 0) {
          EXPECT_TRUE(managed.answersSelf()) << frame;
        }
      }
      return bytes;
    };
    // Trees of as many segments differ by some nodes. Two bytes lost each time would be more.
    const std::size_t first = peak();
    EXPECT_LE(peak(), first + 1100);
    if (visitor == nullptr) continue;
    EXPECT_EQ(managed->fiberSegment(scene.fibers()[3][2]).fiber, 3u);
    EXPECT_EQ(managed->fiberSegment(scene.fibers()[3][2]).number, 2u);
  }
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

// The tree is of two spheres and has nothing of the meshes, each of which would cost a reading of
// all as it goes.
TYPED_TEST(ComingAndGoing, WhatGoesFromBesideTheTreeLeavesItAlone) {
  using S = typename TypeParam::Scalar;
  constexpr std::size_t kMeshes = 200;
  FiberManagerOptions by_capsules;
  by_capsules.report = Report::kCapsules;
  Scene<S> scene;
  for (int i = 0; i < 2; ++i) scene.addSphere({0, 0, 0}, 1);
  const auto model = makeModel<S>(modelTypes<S>().front(), blob(0.3, 0.2, 6, 4));
  for (std::size_t i = 1; i <= kMeshes; ++i) {
    const Eigen::Vector3d place(3 * static_cast<double>(i), 0, 0);
    scene.add(model, makePose<S>(Eigen::Quaterniond::Identity(), place));
  }
  Managed<TypeParam> manager(scene, by_capsules);
  EXPECT_EQ(selfPairs(*manager).size(), 1u);
  moveTo(*scene[0], makePose<S>(Eigen::Quaterniond::Identity(), {0, 50, 0}));
  for (std::size_t i = 0; i < kMeshes / 3; ++i) {
    manager.unregister(manager.size() - 1);
    EXPECT_EQ(selfPairs(*manager).size(), 1u) << i;
  }
  manager->update();
  EXPECT_TRUE(selfPairs(*manager).empty());
}

}  // namespace
}  // namespace fcl_fibers::test
