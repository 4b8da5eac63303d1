// SPDX-License-Identifier: BSD-3-Clause
// What programs do with FCL's managers beside asking them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "support/managed.h"
#include "support/mesh_models.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

template <typename Config>
auto makeByValue(const FiberManagerOptions& options) {
  using S = typename Config::Scalar;
  if constexpr (Config::kVolume == LeafVolume::kBox) {
    return LayeredAABBTreeCollisionManager<S>(options);
  } else {
    return WrappedSphereTreeCollisionManager<S>(options);
  }
}

MANAGER_SUITE(Swap, FiberManagers);

// A manager in a struct that a container moves would not compile, or leave its objects behind.
TYPED_TEST(Swap, AManagerMayBeMoved) {
  using S = typename TypeParam::Scalar;
  using Manager = decltype(makeByValue<TypeParam>({}));
  static_assert(std::is_nothrow_move_constructible_v<Manager>);
  static_assert(std::is_nothrow_move_assignable_v<Manager>);
  static_assert(!std::is_copy_constructible_v<Manager>);
  FiberManagerOptions options;
  options.topology = TypeParam::make()->options().topology;
  for (const int threads : {1, 2}) {
    for (const Report report : {Report::kVolumes, Report::kCapsules}) {
      options.threads = threads;
      options.report = report;
      options.ignored_neighbors = 1;
      const Scene<S> scene = strandScene<S>(5, 12, 321), more = strandScene<S>(3, 12, 322);
      Manager first = makeByValue<TypeParam>(options);
      for (const auto& fiber : scene.fibers()) first.registerFiber(fiber);
      const Calls<S> pairs = selfPairs<S>(first);
      ASSERT_GT(pairs.size(), 10u);

      // Many times, in a container, before and after queries.
      std::vector<Manager> managers;
      managers.push_back(std::move(first));
      for (int i = 0; i < 5; ++i) managers.push_back(makeByValue<TypeParam>({}));
      EXPECT_EQ(selfPairs<S>(managers[0]), pairs);
      Manager second = makeByValue<TypeParam>({});
      second.registerObjects(more.objects());
      second = std::move(managers[0]);
      EXPECT_EQ(selfPairs<S>(second), pairs);
      EXPECT_EQ(objectsOf<S>(second), scene.objects());
      EXPECT_EQ(second.options().ignored_neighbors, 1);
      EXPECT_EQ(second.fiberSegment(scene[13]).fiber, 1u);
      second.update(scene[3]);
      second.update();
      EXPECT_EQ(selfPairs<S>(second), pairs);

      // What it was moved from is empty, answers, and is of use again.
      Manager& from = managers[0];
      EXPECT_TRUE(from.empty());
      EXPECT_EQ(from.size(), 0u);
      EXPECT_TRUE(objectsOf<S>(from).empty());
      EXPECT_TRUE(selfPairs<S>(from).empty());
      EXPECT_TRUE(pairsWith<S>(from, *scene[0]).empty());
      EXPECT_TRUE(pairsWith<S>(from, second).empty());
      EXPECT_TRUE(pairsWith<S>(second, from).empty());
      EXPECT_FALSE(from.isRegistered(scene[0]));
      EXPECT_FALSE(from.movedSinceUpdate());
      EXPECT_THROW(from.fiberSegment(scene[0]), std::invalid_argument);
      EXPECT_THROW(from.unregisterObject(scene[0]), std::invalid_argument);
      from.setup();
      from.update();
      from.update(scene[0]);
      from.clear();
      EXPECT_EQ(from.options().ignored_neighbors, 1);
      for (const auto& fiber : scene.fibers()) from.registerFiber(fiber);
      EXPECT_EQ(selfPairs<S>(from), pairs);
      managers[1] = std::move(from);
      from = makeByValue<TypeParam>(options);
      EXPECT_EQ(from.size(), 0u);
      EXPECT_EQ(selfPairs<S>(managers[1]), pairs);
      const auto clone = std::move(managers[1]).clone(scene.objects());
      EXPECT_EQ(selfPairs<S>(*clone), pairs);
    }
  }
}

// What a program asks a manager that was moved from would be answered for other options, or fill
// memory that is never freed and that all such managers share.
TYPED_TEST(Swap, AManagerThatWasMovedFromAnswersForItself) {
  using S = typename TypeParam::Scalar;
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  options.motion = TypeParam::kVolume == LeafVolume::kBox;
  auto from = makeByValue<TypeParam>(options), second = makeByValue<TypeParam>(options);
  const auto to = std::move(from), its = std::move(second);
  const std::size_t empty = makeByValue<TypeParam>(options).memoryUsage();
  EXPECT_EQ(from.memoryUsage(), empty);

  Scene<S> scene;
  auto* const capsule = scene.addFiber({{0, 0, 0}, {1, 0, 0}}, 0.1).front();
  for (int i = 0; i < 20; ++i) {
    const auto model = makeModel<S>(modelTypes<S>().front(), blob(0.3, 0, 6, 4));
    auto* const mesh = scene.add(model, fcl::Transform3<S>::Identity());
    std::vector<MeshContact> contacts;
    EXPECT_TRUE(from.findMeshContacts(capsule, mesh, 0, contacts));
    EXPECT_FALSE(contacts.empty());
    from.margin(mesh);
    EXPECT_TRUE(pairsWith<S>(from, *mesh).empty());
    EXPECT_EQ(from.memoryUsage(), empty);
    EXPECT_EQ(second.memoryUsage(), empty);
  }

  TimedContact contact;
  const char* const refusal = options.motion ? "not registered" : "has no steps";
  EXPECT_THAT([&] { from.findImpact(capsule, scene[1], nullptr, contact); },
              testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(refusal)));
  EXPECT_THAT([&] { from.findImpact(capsule, scene[1], &second, contact); },
              testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(refusal)));

  // A clone of it has its options, too.
  const auto clone = from.clone({});
  EXPECT_EQ(clone->options().motion, options.motion);
  clone->registerObjects(scene.objects());
  EXPECT_FALSE(selfPairs<S>(*clone).empty());
}

// A program could not find out that it has forgotten update().
TYPED_TEST(Swap, ItIsToldWhetherObjectsHaveMoved) {
  using S = typename TypeParam::Scalar;
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0)) {
    for (const bool has_floor : {false, true}) {
      SCOPED_TRACE(describe(options) + (has_floor ? ", with a floor" : ""));
      Scene<S> scene = strandScene<S>(5, 60, 323), late = strandScene<S>(1, 2, 324);
      addShapes(scene, 10, 0.2, 325);
      // What bounds a floor in a tree of spheres is the same wherever the floor is.
      if (has_floor) scene.addHalfspace({0, 0, 1}, -0.5);
      const bool sees_floor =
          TypeParam::kVolume == LeafVolume::kBox || options.report == Report::kCapsules;
      auto manager = TypeParam::make(options);
      EXPECT_FALSE(manager->movedSinceUpdate()) << "empty";
      manager->registerObjects(scene.objects());
      EXPECT_FALSE(manager->movedSinceUpdate()) << "the next query reads them";
      manager->setup();
      EXPECT_FALSE(manager->movedSinceUpdate());
      Random random(326);
      for (const std::size_t i : {std::size_t{0}, std::size_t{150}, scene.size() - 1}) {
        if (has_floor && !sees_floor && i == scene.size() - 1) continue;
        const fcl::Transform3<S> pose = scene[i]->getTransform();
        moveTo(*scene[i], somePose<S>(random, 1));
        EXPECT_TRUE(manager->movedSinceUpdate()) << i;
        manager->update(scene[i]);
        EXPECT_FALSE(manager->movedSinceUpdate()) << i;
        moveTo(*scene[i], pose);
        EXPECT_TRUE(manager->movedSinceUpdate()) << i;
        manager->update();
        EXPECT_FALSE(manager->movedSinceUpdate()) << i;
      }
      scene.capsule(7).lz *= S(1.01);
      EXPECT_TRUE(manager->movedSinceUpdate()) << "another length";
      manager->update();
      scene.capsule(7).radius = -1;
      EXPECT_TRUE(manager->movedSinceUpdate()) << "broken";
      EXPECT_THROW(manager->update(), std::invalid_argument);
      EXPECT_TRUE(manager->movedSinceUpdate()) << "the update failed";
      scene.capsule(7).radius = S(0.01);
      manager->update();
      EXPECT_FALSE(manager->movedSinceUpdate());

      // Those that have come since.
      manager->registerObjects(late.objects());
      EXPECT_FALSE(manager->movedSinceUpdate()) << "the next query reads them";
      selfPairs<S>(*manager);
      EXPECT_FALSE(manager->movedSinceUpdate());
      late[1]->setTranslation(fcl::Vector3<S>(1, 2, 3));
      EXPECT_TRUE(manager->movedSinceUpdate());
      manager->unregisterObject(late[1]);
      EXPECT_FALSE(manager->movedSinceUpdate());
      const auto clone = cloneOf<S>(*manager, objectsOf<S>(*manager));
      EXPECT_FALSE(clone->movedSinceUpdate()) << "its first query reads them";
    }
  }
}

// A program would slow down without end when its fibers change places, if it only ever updates
// some objects, or has a floor. That they are bundled anew shows in the order of the pairs.
TYPED_TEST(Swap, FibersThatHaveChangedPlacesAreBundledAnew) {
  using S = typename TypeParam::Scalar;
  constexpr std::size_t kFibers = 100, kSegments = 8;
  for (const bool has_floor : {false, true}) {
    SCOPED_TRACE(has_floor ? "with a floor" : "");
    Scene<S> scene;
    for (std::size_t f = 0; f < kFibers; ++f) {
      const double x = static_cast<double>(f % 10), y = static_cast<double>(f / 10);
      std::vector<Eigen::Vector3d> points;
      for (std::size_t i = 0; i <= kSegments; ++i) points.push_back({x, y, 0.5 * double(i)});
      scene.addFiber(points, 0.06);
    }
    std::vector<fcl::Transform3<S>> poses;
    for (const auto* object : scene.objects()) poses.push_back(object->getTransform());
    if (has_floor) scene.addHalfspace({0, 0, 1}, 0.1);
    const auto before = TypeParam::make(), after = TypeParam::make();
    registerFibers<S>(*before, scene);
    before->setup();

    std::vector<std::size_t> places(kFibers);
    std::iota(places.begin(), places.end(), std::size_t{0});
    Random(327).shuffle(places);
    std::vector<fcl::CollisionObject<S>*> moved;  // a fifth of all
    for (std::size_t f = 0; f < kFibers; ++f) {
      for (std::size_t i = 0; i < kSegments; ++i) {
        moveTo(*scene.fibers()[f][i], poses[kSegments * places[f] + i]);
      }
      if (has_floor) continue;
      moved.insert(moved.end(), scene.fibers()[f].begin(), scene.fibers()[f].end());
      if (f % 20 != 19) continue;
      before->update(moved);
      moved.clear();
    }
    if (has_floor) before->update();
    registerFibers<S>(*after, scene);
    const Calls<S> pairs = selfPairs<S>(*after);
    EXPECT_GE(pairs.size(), kFibers * (kSegments - 1));
    EXPECT_TRUE(selfPairs<S>(*before) == pairs);
  }
}

}  // namespace
}  // namespace fcl_fibers::test
