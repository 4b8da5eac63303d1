// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "support/managed.h"
#include "support/scene_generators.h"
#include "support/text_of.h"

namespace fcl_fibers::test {
namespace {

// A scene for each thread: clones of a manager over copies of its objects.

template <typename Config>
class Clone : public testing::Test {
 protected:
  using S = typename Config::Scalar;
  using Object = fcl::CollisionObject<S>;
  using Objects = std::vector<Object*>;
  using Manager = FiberCollisionManager<S>;

  Clone() : scene_(strandScene<S>(9, 14, 191)) {
    addShapes(scene_, 6, 0.3, 192);
    scene_.addHalfspace({0, 0, 1}, -0.5);
    for (int f = 0; f < 9; ++f) groups_.push_back(f % 3);
  }

  void expectAnswers(const Managed<Config>& clone) const {
    EXPECT_TRUE(clone.answersSelf());
    clone.expectEveryPair();
    clone.expectAnswersWith(clone.every(23));
  }
  static void expectSameNumbers(const Manager& original, const Manager& clone) {
    const Objects here = objectsOf<S>(original), there = objectsOf<S>(clone);
    ASSERT_EQ(here.size(), there.size());
    for (std::size_t i = 0; i < here.size(); ++i) {
      EXPECT_EQ(original.fiberSegment(here[i]).fiber, clone.fiberSegment(there[i]).fiber);
      EXPECT_EQ(original.fiberSegment(here[i]).number, clone.fiberSegment(there[i]).number);
    }
  }

  Managed<Config> original(const FiberManagerOptions& options, bool is_set_up = true) const {
    Managed<Config> manager(options);
    manager.registerFibers(scene_, groups_);
    if (is_set_up) manager->setup();
    return manager;
  }

  Scene<S> scene_;
  std::vector<int> groups_;
};
TYPED_TEST_SUITE(Clone, FiberManagers, ManagerNames);

// A clone would have forgotten fibers, neighbours or groups, or see the original's objects; and be
// searched with a tree that fits the other objects.
TYPED_TEST(Clone, AnswersForItsOwnObjectsByTheSameRules) {
  using S = typename TypeParam::Scalar;
  for (const FiberManagerOptions& options : assortedOptions()) {
    for (const bool is_set_up : {false, true}) {
      SCOPED_TRACE(describe(options) + (is_set_up ? ", set up" : ", not set up"));
      auto original = this->original(options, is_set_up);
      const Scene<S> copies = this->scene_.reallocated(193);
      const auto clone = original.clone(copies.objects());
      EXPECT_EQ(clone->options().ignored_neighbors, options.ignored_neighbors);
      EXPECT_EQ(clone->options().threads, options.threads);
      EXPECT_EQ(clone->options().topology, original->options().topology);

      // Where nothing has moved, the same pairs in the same order.
      EXPECT_EQ(clone.numbered(selfPairs<S>(*clone)), original.numbered(selfPairs<S>(*original)));
      this->expectSameNumbers(*original, *clone);

      // Each goes its own way.
      const Calls<S> before = selfPairs<S>(*original);
      EXPECT_FALSE(before.empty());
      Random random(194);
      jolt(copies.objects(), random, 0.1, 0.5);
      clone->update();
      this->expectAnswers(clone);
      EXPECT_EQ(selfPairs<S>(*original), before);
      original.unregisterObject(this->scene_[5]);
      original.clear();
      this->expectAnswers(clone);
    }
  }
}

// The first query of a clone would count objects where the original's are.
TYPED_TEST(Clone, ReadsItsObjectsAtItsFirstQueryOrUpdate) {
  using S = typename TypeParam::Scalar;
  const auto original = this->original(assortedOptions()[1]);
  // So far that another bundle is made, too.
  for (const double far : {0.1, 40.0}) {
    const std::vector<std::pair<std::string, std::function<void(typename TestFixture::Manager&)>>>
        acts = {
            {"a query", [](auto&) {}},
            {"setup", [](auto& clone) { clone.setup(); }},
            {"update", [](auto& clone) { clone.update(); }},
            {"update of one", [](auto& clone) { clone.update(objectsOf<S>(clone)[3]); }},
            {"update of none",
             [](auto& clone) { clone.update(std::vector<typename TestFixture::Object*>()); }},
        };
    for (const auto& [name, act] : acts) {
      SCOPED_TRACE(name);
      const Scene<S> copies = this->scene_.reallocated(195);
      const auto clone = original.clone(copies.objects());
      Random random(196);
      jolt(copies.objects(), random, far, 0.5);
      act(*clone);
      this->expectAnswers(clone);
    }
  }
}

// Objects of other shapes would be left in the tree, or out of it, as those they stand for were.
TYPED_TEST(Clone, OtherShapesMayStandForOtherShapes) {
  for (const FiberManagerOptions& options : assortedOptions()) {
    const auto original = this->original(options);
    Scene<typename TypeParam::Scalar> copies = this->scene_.reallocated(198);
    const std::size_t shapes = 9 * 14;
    auto managed = copies.objects();
    managed[shapes] = copies.addHalfspace({1, 0, 0}, 0);
    managed[shapes + 6] = copies.addSphere({0, 0, 0}, 0.2);
    managed[shapes + 1] = copies.addBox({0.1, 0, 0}, Eigen::Quaterniond::Identity(), {1, 1, 1});
    managed[7] = copies.addCapsule({0, 0, 0}, {0.5, 0, 0.1}, 0.1);
    this->expectAnswers(original.clone(managed));
  }
}

// A group would meet itself where one of it is beside the tree, as a fiber of one object may be in
// a clone.
TYPED_TEST(Clone, AGroupHasNoPairsWithWhatHasComeBesideTheTree) {
  for (const FiberManagerOptions& options : assortedOptions()) {
    SCOPED_TRACE(describe(options));
    Scene<typename TypeParam::Scalar> scene;
    const auto first = scene.addFiber({{0, 0, 0}, {1, 0, 0}}, 0.1),
               second = scene.addFiber({{0, 0.1, 0}, {1, 0.1, 0}}, 0.1);
    auto* const floor = scene.addHalfspace({0, 0, 1}, 0);
    auto* const wall = scene.addHalfspace({0.6, 0.8, 0}, 0);
    for (const int its_group : {7, 8}) {
      Managed<TypeParam> original(options);
      original.registerFiber(first, FiberEnds::kOpen, FiberGroup{7});
      original.registerFiber(second, FiberEnds::kOpen, FiberGroup{its_group});
      const std::size_t expected = its_group == 7 ? 0 : 1;
      EXPECT_EQ(selfPairs(*original).size(), expected);
      for (auto* one : {floor, wall}) {
        EXPECT_EQ(selfPairs(*original.clone({one, second[0]})).size(), expected);
        EXPECT_EQ(selfPairs(*original.clone({first[0], one})).size(), expected);
      }
      EXPECT_EQ(selfPairs(*original.clone({floor, wall})).size(), expected);
    }
  }
}

// A clone of what is refused would be made of some of the objects; or the original be changed.
TYPED_TEST(Clone, RefusesWhatDoesNotFit) {
  using S = typename TypeParam::Scalar;
  using Objects = typename Clone<TypeParam>::Objects;
  const auto original = this->original(assortedOptions()[0]);
  const Calls<S> pairs = selfPairs<S>(*original);
  ASSERT_FALSE(pairs.empty());
  Scene<S> copies = this->scene_.reallocated(199);
  const Objects good = copies.objects();
  const auto refused = [&](const Objects& objects, const std::string& why) {
    expectRefusal([&] { cloneOf<S>(*original, objects); }, "fcl_fibers: clone: ");
    expectRefusal([&] { cloneOf<S>(*original, objects); }, why);
    EXPECT_EQ(selfPairs<S>(*original), pairs);
  };
  Objects objects = good;
  objects.pop_back();
  refused(objects, "132 objects are given for 133");
  objects = good;
  objects.push_back(copies.addSphere({0, 0, 0}, 1));
  refused(objects, "134 objects are given for 133");
  refused({}, "0 objects are given for 133");
  objects = good;
  objects[20] = nullptr;
  refused(objects, "object 20 is null");
  objects = good;
  objects[20] = objects[40];
  refused(objects, "object 40 is passed twice");
  objects = good;
  objects[20] = copies.addSphere({0, 0, 0}, 1);
  refused(objects, "object 20 is not a capsule");
  objects = good;
  fcl::Transform3<S> pose = objects[20]->getTransform();
  pose.translation()[1] = std::numeric_limits<S>::quiet_NaN();
  objects[20]->setTransform(pose);
  refused(objects, "object 20: its pose is NaN");
  EXPECT_NO_THROW(cloneOf<S>(*original, this->scene_.objects())) << "in both managers";
}

// Cloning would disturb queries of other threads, or read a tree that one of them is building.
TYPED_TEST(Clone, MayBeMadeWhileTheOriginalIsAsked) {
  using S = typename TypeParam::Scalar;
  const FiberManagerOptions options = assortedOptions()[1];
  const auto model = this->original(options);
  const Calls<S> expected = selfPairs<S>(*model);
  const auto expected_numbers = model.numbered(expected);
  for (int round = 0; round < 4; ++round) {
    // The first of the queries builds.
    const auto original = this->original(options, false);
    std::atomic<int> wrong{0};
    std::vector<std::thread> threads;
    for (std::uint64_t t = 0; t < 4; ++t) {
      threads.emplace_back([&, t] {
        if (t % 2 == 0) {
          wrong += selfPairs<S>(*original) != expected;
          return;
        }
        const Scene<S> copies = this->scene_.reallocated(t);
        const auto clone = original.clone(copies.objects());
        wrong += clone.numbered(selfPairs<S>(*clone)) != expected_numbers;
      });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, 0);
  }
  // From a callback, too.
  struct Cloning {
    FiberCollisionManager<S>& original;
    Scene<S> copies;
    std::size_t calls = 0, pairs = 0;
  } cloning{*model, this->scene_.reallocated(201)};
  model->collide(&cloning, [](fcl::CollisionObject<S>*, fcl::CollisionObject<S>*, void* data) {
    auto& self = *static_cast<Cloning*>(data);
    if (self.calls++ == 0) {
      self.pairs = selfPairs<S>(*cloneOf<S>(self.original, self.copies.objects())).size();
    }
    return false;
  });
  EXPECT_EQ(cloning.calls, expected.size());
  EXPECT_EQ(cloning.pairs, expected.size());
}

// A clone of a clone, or of nothing, would be of another kind.
TYPED_TEST(Clone, OfAnEmptyManagerIsEmpty) {
  using S = typename TypeParam::Scalar;
  const auto original = TypeParam::make();
  const auto clone = cloneOf<S>(*original, {});
  EXPECT_TRUE(clone->empty());
  EXPECT_TRUE(selfPairs<S>(*clone).empty());
  original->setup();
  const auto second = cloneOf<S>(*cloneOf<S>(*original, {}), {});
  second->registerObjects(this->scene_.objects());
  EXPECT_FALSE(selfPairs<S>(*second).empty());
}

// A user would have to cast.
TEST(CloneType, IsThatOfTheOriginal) {
  const LayeredAABBTreeCollisionManagerd boxes;
  const std::unique_ptr<LayeredAABBTreeCollisionManagerd> boxes_too = boxes.clone({});
  EXPECT_TRUE(boxes_too->empty());
  const WrappedSphereTreeCollisionManagerf spheres;
  const std::unique_ptr<WrappedSphereTreeCollisionManagerf> spheres_too = spheres.clone({});
  EXPECT_TRUE(spheres_too->empty());
}

}  // namespace
}  // namespace fcl_fibers::test
