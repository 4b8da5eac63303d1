// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/fiber_objects.h>

#include "support/branched_fibers.h"
#include "support/managed.h"

namespace fcl_fibers::test {
namespace {

using Numbers = std::vector<std::pair<std::size_t, std::size_t>>;

/// Objects of branched fibers, each of which is named by its first point.
template <typename S>
class BranchedObjects {
 public:
  using Object = fcl::CollisionObject<S>;

  explicit BranchedObjects(FiberPolylines scene)
      : scene_(std::move(scene)),
        owned_(makeObjects<S>(scene_)),
        fibers_(objectsByFiber(scene_, owned_)) {
    for (std::size_t f = 0; f < fibers_.size(); ++f) {
      for (std::size_t i = 0; i < fibers_[f].objects.size(); ++i) {
        names_.emplace_back(fibers_[f].objects[i], scene_.point_begin[f] + i);
      }
    }
    std::sort(names_.begin(), names_.end());
  }

  const FiberPolylines& scene() const { return scene_; }
  const FiberObjects<Object>& operator[](std::size_t f) const { return fibers_[f]; }
  std::size_t size() const { return fibers_.size(); }

  Numbers pairsOf(const fcl::BroadPhaseCollisionManager<S>& manager) const {
    struct Data {
      const BranchedObjects* self;
      Numbers pairs;
    } data{this, {}};
    manager.collide(&data, [](Object* a, Object* b, void* to) {
      auto& [self, pairs] = *static_cast<Data*>(to);
      pairs.push_back(std::minmax(self->nameOf(a), self->nameOf(b)));
      return false;
    });
    std::sort(data.pairs.begin(), data.pairs.end());
    return data.pairs;
  }
  std::size_t nameOf(const Object* object) const {
    return std::lower_bound(names_.begin(), names_.end(),
                            std::pair<const Object*, std::size_t>(object, 0))
        ->second;
  }

 private:
  FiberPolylines scene_;
  std::vector<std::unique_ptr<Object>> owned_;
  std::vector<FiberObjects<Object>> fibers_;
  std::vector<std::pair<const Object*, std::size_t>> names_;
};

FiberManagerOptions branchOptions(int neighbors, double arc) {
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = neighbors;
  options.ignored_arc_length = arc;
  return options;
}

Numbers withoutNeighbors(const Numbers& pairs, const FiberPolylines& scene, int neighbors,
                         double arc) {
  const BranchOracle oracle(scene, neighbors, arc);
  Numbers kept;
  for (const auto& [a, b] : pairs) {
    if (!oracle.areNeighbors(a, b)) kept.emplace_back(a, b);
  }
  return kept;
}

MANAGER_SUITE(ManagerBranches, FiberManagers);

// Segments at a branching point, which always touch, would drown the contacts of a neuron.
TYPED_TEST(ManagerBranches, NeighborsCountAlongTheTree) {
  using S = typename TypeParam::Scalar;
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const BranchedObjects<S> objects(branchedFibers(seed));
    for (const auto& [neighbors, arc] : {std::pair(1, 0.0), {3, 0.0}, {0, 0.15}, {1, 0.4}}) {
      const auto all = TypeParam::make(branchOptions(0, 0));
      const auto manager = TypeParam::make(branchOptions(neighbors, arc));
      for (std::size_t f = 0; f < objects.size(); ++f) {
        all->registerFiber(objects[f].objects);
        manager->registerFiber(objects[f].objects, objects[f].ends, {}, {}, objects[f].joints);
      }
      const Numbers touching = objects.pairsOf(*all);
      const Numbers expected = withoutNeighbors(touching, objects.scene(), neighbors, arc);
      EXPECT_LT(expected.size(), touching.size());
      EXPECT_EQ(objects.pairsOf(*manager), expected) << seed << ' ' << neighbors << ' ' << arc;
      manager->update();
      EXPECT_EQ(objects.pairsOf(*manager), expected);
      std::vector<fcl::CollisionObject<S>*> same;
      manager->getObjects(same);
      std::vector<std::unique_ptr<fcl::CollisionObject<S>>> copies;
      // A clone with the objects of the original in their places.
      const auto clone = cloneOf<S>(*manager, same);
      EXPECT_EQ(objects.pairsOf(*clone), expected);
    }
  }
}

// Branches would start at a fiber that is gone, or at another one after many have gone. A list of
// pairs would lack those that are no neighbours any more.
TYPED_TEST(ManagerBranches, ChildrenOfAFiberThatIsGoneStartNowhere) {
  using S = typename TypeParam::Scalar;
  Random random(17);
  for (const double skin : {0.0, 0.0, 0.5}) {
    if (skin > 0 && TypeParam::kVolume != LeafVolume::kBox) continue;
    const BranchedObjects<S> objects(branchedFibers(random.below(100), 60, 2));
    FiberPolylines now = objects.scene();
    const auto fiberOf = [&](std::int32_t point) {
      return static_cast<std::size_t>(
          std::upper_bound(now.point_begin.begin(), now.point_begin.end(), point) -
          now.point_begin.begin() - 1);
    };
    const auto all = TypeParam::make(branchOptions(0, 0));
    FiberManagerOptions options = branchOptions(2, 0.1);
    options.skin = skin;
    const auto manager = TypeParam::make(options);
    std::vector<bool> is_there(objects.size(), true);
    const auto add = [&](std::size_t f) {
      std::vector<FiberJoint<fcl::CollisionObject<S>>> joints;
      for (const auto& joint : objects[f].joints) {
        if (joint.segment == nullptr ||
            is_there[fiberOf(static_cast<std::int32_t>(objects.nameOf(joint.segment)))]) {
          joints.push_back(joint);
        }
      }
      all->registerFiber(objects[f].objects);
      manager->registerFiber(objects[f].objects, objects[f].ends, {}, {}, joints);
    };
    const auto expectRight = [&](const char* when) {
      EXPECT_EQ(objects.pairsOf(*manager), withoutNeighbors(objects.pairsOf(*all), now, 2, 0.1))
          << when;
      if (skin > 0) manager->update();
    };
    const auto remove = [&](std::size_t f) {
      is_there[f] = false;
      for (auto* object : objects[f].objects) {
        all->unregisterObject(object);
        manager->unregisterObject(object);
      }
      for (auto* at : {&now.starts_at, &now.ends_at}) {
        (*at)[f] = -1;
        for (std::int32_t& point : *at) {
          if (point >= 0 && fiberOf(point) == f) point = -1;
        }
      }
    };
    for (std::size_t f = 0; f < objects.size(); ++f) add(f);
    expectRight("with all");
    for (const std::size_t f : {7u, 20u, 21u}) {
      remove(f);
      expectRight("without a few");
    }
    for (std::size_t f = 1; f < objects.size(); ++f) {
      if (is_there[f] && random.below(4) > 0) remove(f);
    }
    expectRight("without most");
    const FiberPolylines& before = objects.scene();
    for (std::size_t f = 1; f < objects.size(); ++f) {
      if (is_there[f]) continue;
      is_there[f] = true;
      add(f);
      const auto restore = [&](std::vector<std::int32_t>& at, std::int32_t point) {
        if (point >= 0 && is_there[fiberOf(point)]) at[f] = point;
      };
      restore(now.starts_at, before.starts_at[f]);
      restore(now.ends_at, before.ends_at[f]);
    }
    expectRight("with new ones");
    // A fiber that has lost some of its segments is there still.
    for (std::size_t f = 0; f < objects.size(); ++f) {
      if (objects[f].objects.size() < 2) continue;
      auto* const object = f % 2 == 0 ? objects[f].objects.front() : objects[f].objects.back();
      all->unregisterObject(object);
      manager->unregisterObject(object);
    }
    expectRight("without a segment");
  }
}

// A branch of another fiber than was meant, or of none, would be found by nobody.
TYPED_TEST(ManagerBranches, WhatIsNoSegmentOfAFiberIsRefused) {
  using S = typename TypeParam::Scalar;
  using Joint = FiberJoint<fcl::CollisionObject<S>>;
  Scene<S> scene;
  const auto trunk = scene.addFiber({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, 0.1);
  const auto branch = scene.addFiber({{1, 0, 0}, {1, 1, 0}, {1, 2, 0}, {1, 0, 0}}, 0.1);
  auto* const loose = scene.addCapsule({5, 0, 0}, {6, 0, 0}, 0.1);
  const auto manager = TypeParam::make(branchOptions(1, 0));
  manager->registerFiber(trunk);
  manager->registerObject(loose);
  const auto expectRefused = [&](const Joint& joint, const std::string& text) {
    EXPECT_THAT([&] { manager->registerFiber(branch, FiberEnds::kOpen, {}, {}, {joint}); },
                testing::ThrowsMessage<std::invalid_argument>(
                    testing::HasSubstr("registerFiber: joint 0 " + text)));
    EXPECT_EQ(manager->size(), 3u);
  };
  const std::string no_segment =
      "names an object that is no segment of a fiber; register that fiber before by "
      "registerFiber()";
  expectRefused({0, nullptr}, no_segment);
  EXPECT_THROW(manager->registerFiber({}, FiberEnds::kOpen, {}, {}, {{0, loose}}),
               std::invalid_argument);
  expectRefused({0, loose}, no_segment);
  Scene<S> other;
  expectRefused({0, other.addFiber({{0, 0, 0}, {1, 0, 0}}, 0.1)[0]}, no_segment);
  expectRefused({4, trunk[1]}, "is at point 4; give one from 0 to 3, the number of segments");

  // The point may be named by either segment, and the fiber's end may be at itself.
  manager->registerFiber(branch, FiberEnds::kOpen, {}, {}, {{0, trunk[1]}, {3, branch[0]}});
  EXPECT_TRUE(selfPairs(*manager).empty());
  for (auto* object : branch) manager->unregisterObject(object);
  manager->registerFiber(branch, FiberEnds::kOpen, {}, {}, {{0, trunk[0], /*at_end=*/true}});
  EXPECT_EQ(selfPairs(*manager).size(), 3u) << "the end, at the trunk and the start";
}

// What is registered behind a query would be looked up where joints know nothing of it, and an
// empty fiber would leave its joint to the next one.
TYPED_TEST(ManagerBranches, OtherFibersComeBehindAQuery) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  const auto trunk = scene.addFiber({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, 0.1);
  const auto branch = scene.addFiber({{1, 0, 0}, {1, 1, 0}, {1, 2, 0}}, 0.1);
  const auto manager = TypeParam::make(branchOptions(1, 0));
  manager->registerFiber(trunk);
  manager->registerFiber(branch, FiberEnds::kOpen, {}, {}, {{0, trunk[1]}});
  EXPECT_TRUE(selfPairs(*manager).empty());
  manager->registerFiber({}, FiberEnds::kOpen, {}, {}, {{0, trunk[1]}});
  for (std::size_t count = 1; count <= 200; ++count) {
    manager->registerFiber(scene.addFiber({{1, 0, 0}, {1, 0, 9}}, 0.01));
    // Each touches both segments of the trunk, the first one of the branch, and the others.
    if (count % 50 != 1) continue;
    EXPECT_EQ(selfPairs(*manager).size(), 3 * count + count * (count - 1) / 2);
  }
}

// No number is so large that segments of two trees would be neighbours.
TYPED_TEST(ManagerBranches, TheLargestRulesIgnoreNoOtherTree) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  for (const auto& [neighbors, arc] : {std::pair(std::numeric_limits<int>::max(), 0.0),
                                       std::pair(1, std::numeric_limits<double>::max())}) {
    const auto manager = TypeParam::make(branchOptions(neighbors, arc));
    for (int i = 0; i < 2; ++i) {
      const auto trunk = scene.addFiber({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, 0.1);
      manager->registerFiber(trunk);
      manager->registerFiber(scene.addFiber({{1, 0, 0}, {1, 1, 0}, {1, 2, 0}}, 0.1),
                             FiberEnds::kOpen, {}, {}, {{0, trunk[1]}});
    }
    // Of one tree with the other: all that are not the last of the branch and of the trunk beyond.
    EXPECT_EQ(selfPairs(*manager).size(), 12u) << neighbors << ", " << arc;
  }
}

// A scene without branches would pay for them.
TYPED_TEST(ManagerBranches, NothingIsKeptWithoutBranches) {
  using S = typename TypeParam::Scalar;
  const BranchedObjects<S> objects(branchedFibers(6));
  std::vector<std::size_t> bytes;
  for (const int joints : {0, 1}) {
    const auto manager = TypeParam::make(branchOptions(1, 0));
    for (std::size_t f = 0; f < objects.size(); ++f) {
      manager->registerFiber(objects[f].objects, objects[f].ends, {}, {},
                             joints == 0 ? decltype(objects[f].joints)() : objects[f].joints);
    }
    objects.pairsOf(*manager);
    bytes.push_back(manager->memoryUsage());
  }
  EXPECT_LT(bytes[0], bytes[1]);
}

}  // namespace
}  // namespace fcl_fibers::test
