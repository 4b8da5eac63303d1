// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

#include "support/managers_under_test.h"
#include "support/pair_queries.h"
#include "support/scene_count.h"
#include "support/scene_generators.h"

// A manager with a skin reports what one without it does, and tells which pairs begin and end.

namespace fcl_fibers::test {
namespace {

template <typename S>
using Objects = std::vector<fcl::CollisionObject<S>*>;

template <typename S>
using Live = std::vector<LiveObjectPair<S>>;

template <typename S>
Live<S> livePairs(const FiberCollisionManager<S>& manager) {
  Live<S> pairs;
  manager.findLivePairs(pairs);
  return pairs;
}

template <typename S>
bool isRound(const fcl::CollisionObject<S>& object) {
  return object.getNodeType() == fcl::GEOM_CAPSULE || object.getNodeType() == fcl::GEOM_SPHERE;
}

/// What a program knows of the pairs of a manager that live, by what the manager has told it.
template <typename S>
class Told {
 public:
  using Object = fcl::CollisionObject<S>;

  /// Objects get a name with each registration.
  void add(const Objects<S>& objects) {
    for (Object* object : objects) names_[object] = next_++;
  }

  /// Checks what the last update() has told. Objects that are gone have the names that they had.
  void update(const FiberCollisionManager<S>& manager) {
    std::set<std::int32_t> ended_slots;
    for (const auto& pair : manager.endedPairs()) {
      const auto known = pairs_.find({pair.a, pair.b});
      ASSERT_TRUE(known != pairs_.end()) << "a pair ends that did not live, or twice";
      EXPECT_EQ(known->second.slot, pair.slot);
      EXPECT_TRUE(ended_slots.insert(pair.slot).second);
      pairs_.erase(known);
    }
    // A pair of which an object was unregistered ended, even if it came back.
    for (const auto& [objects, pair] : pairs_) {
      EXPECT_EQ(names_.at(objects.first), pair.a) << "a pair outlives its object";
      EXPECT_EQ(names_.at(objects.second), pair.b) << "a pair outlives its object";
    }
    for (const auto& pair : manager.begunPairs()) {
      EXPECT_LT(names_.at(pair.a), names_.at(pair.b));
      EXPECT_EQ(ended_slots.count(pair.slot), 0u) << "a slot is used before its end is told";
      const Known begun{names_.at(pair.a), names_.at(pair.b), pair.slot};
      EXPECT_TRUE((pairs_.emplace(Names{pair.a, pair.b}, begun).second)) << "a pair begins twice";
    }
    expectLive(manager);
  }

  /// That those live of which it was told, each in its slot.
  void expectLive(const FiberCollisionManager<S>& manager) const {
    const Live<S> live = livePairs(manager);
    EXPECT_EQ(live.size(), pairs_.size());
    std::set<std::int32_t> slots;
    for (const auto& pair : live) {
      const auto known = pairs_.find({pair.a, pair.b});
      ASSERT_TRUE(known != pairs_.end()) << "a pair lives that has not begun";
      EXPECT_EQ(known->second.slot, pair.slot);
      EXPECT_TRUE(pair.slot >= 0 && pair.slot < manager.liveSlotCount());
      EXPECT_TRUE(slots.insert(pair.slot).second) << "two pairs have one slot";
    }
  }

  /// That those of capsules and spheres are what a query reports.
  void expectTouching(const Calls<S>& reported) const {
    std::set<Names> live, touching;
    for (const auto& [objects, pair] : pairs_) {
      if (isRound(*objects.first) && isRound(*objects.second)) live.insert(objects);
    }
    for (const auto& [a, b] : reported) {
      if (isRound(*a) && isRound(*b)) touching.insert({a, b});
    }
    EXPECT_TRUE(live == touching);
  }

  std::size_t size() const { return pairs_.size(); }

 private:
  using Names = std::pair<const Object*, const Object*>;
  struct Known {
    int a, b;
    std::int32_t slot;
  };

  std::map<const Object*, int> names_;
  int next_ = 0;
  std::map<Names, Known> pairs_;
};

/// Two managers that are told the same; one has a skin.
template <typename Config>
class Twins {
 public:
  using S = typename Config::Scalar;
  using Object = fcl::CollisionObject<S>;

  Twins(FiberManagerOptions options, double skin) : plain_(Config::make(options)) {
    options.skin = skin;
    skinned_ = Config::make(options);
  }

  template <class Call>
  void both(const Call& call) {
    call(*plain_);
    call(*skinned_);
  }
  void add(const Objects<S>& objects) {
    both([&](auto& manager) { manager.registerObjects(objects); });
    told_.add(objects);
  }
  void addFiber(const Objects<S>& fiber, FiberEnds ends, FiberGroup group) {
    both([&](auto& manager) { manager.registerFiber(fiber, ends, group); });
    told_.add(fiber);
  }
  void update() {
    both([](auto& manager) { manager.update(); });
    told_.update(*skinned_);
    told_.expectTouching(selfPairs<S>(*skinned_));
  }
  /// That both report the same of all queries.
  void expectSame(Object* one = nullptr, const FiberCollisionManager<S>* other = nullptr) const {
    const auto found = asSet<S>(selfPairs<S>(*skinned_));
    EXPECT_TRUE(found == asSet<S>(selfPairs<S>(*plain_)));
    pairs_seen += found.size();
    told_.expectLive(*skinned_);
    if (one != nullptr) {
      EXPECT_TRUE(asSet<S>(pairsWith<S>(*skinned_, *one)) == asSet<S>(pairsWith<S>(*plain_, *one)));
    }
    if (other == nullptr) return;
    auto& its = const_cast<FiberCollisionManager<S>&>(*other);
    EXPECT_TRUE(asSet<S>(pairsWith<S>(*skinned_, its)) == asSet<S>(pairsWith<S>(*plain_, its)));
    EXPECT_TRUE(asSet<S>(pairsWith<S>(*other, *skinned_)) ==
                asSet<S>(pairsWith<S>(*other, *plain_)));
    const Calls<S> near = nearPairs(*skinned_), plain_near = nearPairs(*plain_);
    EXPECT_TRUE(hasAll(near, plain_near) && hasAll(plain_near, near));
  }
  const FiberCollisionManager<S>& skinned() const { return *skinned_; }
  const FiberCollisionManager<S>& plain() const { return *plain_; }
  const Told<S>& told() const { return told_; }

  static inline std::size_t pairs_seen = 0;

 private:
  static Calls<S> nearPairs(const FiberCollisionManager<S>& manager) {
    Calls<S> near;
    manager.distance(&near, [](Object* a, Object* b, void* data, S& distance) {
      static_cast<Calls<S>*>(data)->emplace_back(a, b);
      distance = S(0.02);
      return false;
    });
    return near;
  }
  /// Whether the second has what the first has. What comes first may be far apart.
  static bool hasAll(const Calls<S>& all, const Calls<S>& near) {
    const auto set = asSet<S>(all);
    return near.empty() || std::all_of(near.begin() + 1, near.end(),
                                       [&](const auto& pair) { return set.count(pair) > 0; });
  }

  std::unique_ptr<FiberCollisionManager<S>> plain_, skinned_;
  Told<S> told_;
};

FiberManagerOptions byCapsules() {
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = 1;
  return options;
}

MANAGER_SUITE(LiveManagers, LayeredManagers);

// A pair would be missed, or told twice, after some combination of calls.
TYPED_TEST(LiveManagers, ReportWhatOthersDoWhateverIsCalled) {
  using S = typename TypeParam::Scalar;
  constexpr int kCalls = 70;
  const int seeds = static_cast<int>(sceneCount(5));
  std::size_t most_live = 0;
  Twins<TypeParam>::pairs_seen = 0;
  for (int seed = 0; seed < seeds && !this->HasFailure(); ++seed) {
    Random random(static_cast<std::uint64_t>(400 + seed));
    FiberManagerOptions options = byCapsules();
    options.ignored_neighbors = seed % 3;
    options.margin = seed % 2 == 0 ? 0 : 0.02;
    options.threads = 1 + seed % 2;
    options.bounds = seed % 4 == 3 ? Bounds::kShapes : Bounds::kShapesAndMargins;
    constexpr double kSkins[] = {-1, 0.03, 1e-3, 0.5, 1e9};
    Twins<TypeParam> twins(options, kSkins[seed % 5]);
    SCOPED_TRACE(describe(options) + ", seed " + std::to_string(seed));

    Scene<S> scene = strandScene<S>(8, 10, static_cast<std::uint64_t>(seed));
    const std::size_t in_fibers = scene.size();
    for (int i = 0; i < 6; ++i) {
      const Eigen::Vector3d place = random.inCube(0.5);
      scene.addCapsule(place, place + 0.2 * random.direction(), 0.04);
      scene.addSphere(random.inCube(0.5), 0.1);
    }
    addShapes(scene, 12, 0.3, static_cast<std::uint64_t>(seed));
    scene.addHalfspace({0, 0, 1}, -0.4);
    scene.addPlane({0, 1, 0}, 0.1);
    for (std::size_t i = 0; i < in_fibers; i += 9) widenShape(*scene[i], 0.03);
    Scene<S> other_scene = strandScene<S>(3, 6, static_cast<std::uint64_t>(seed + 50));
    addShapes(other_scene, 4, 0.3, 3);
    const auto other = TypeParam::make(options);
    other->registerObjects(other_scene.objects());

    if (seed % 5 >= 3) {  // far from the origin
      const Eigen::Vector3d place = (std::is_same_v<S, float> ? 30 : 1e6) * random.direction();
      for (Scene<S>* const all : {&scene, &other_scene}) {
        for (auto* object : all->objects()) translate(*object, place);
      }
    }

    Objects<S> outside = scene.loose(), inside;
    std::vector<std::pair<fcl::CollisionObject<S>*, fcl::Transform3<S>>> away;
    const auto enter = [&](const Objects<S>& objects) {
      inside.insert(inside.end(), objects.begin(), objects.end());
    };
    const auto addFiber = [&](std::size_t fiber) {
      twins.addFiber(scene.fibers()[fiber], fiber % 4 == 1 ? FiberEnds::kClosed : FiberEnds::kOpen,
                     FiberGroup{static_cast<int>(fiber % 3)});
      enter(scene.fibers()[fiber]);
    };
    for (std::size_t f = 0; f < scene.fibers().size(); ++f) addFiber(f);
    for (int call = 0; call < kCalls && !this->HasFailure(); ++call) {
      const std::size_t what = random.below(19);
      SCOPED_TRACE("call " + std::to_string(call) + ": " + std::to_string(what));
      if (inside.empty()) {
        enter(outside);
        twins.add(outside);
        outside.clear();
      }
      if (what < 4) {  // steps of a solver
        for (int i = 0; i < 3; ++i) {
          jolt(inside, random, 0.004, 0.01);
          twins.update();
        }
      } else if (what == 4) {  // all move as one
        const Eigen::Vector3d by = random.inCube(0.1);
        for (auto* object : inside) translate(*object, by);
        twins.update();
      } else if (what == 5) {  // one swings
        jolt(*inside[random.below(inside.size())], random, 0.4, 1);
        twins.update();
      } else if (what == 6) {  // some radii grow, and others shrink
        for (std::size_t i = random.below(7); i < in_fibers; i += 7) {
          scene.capsule(i).radius *= S(random.between(0.8, 1.25));
          scene.capsule(i).computeLocalAABB();
          scene[i]->computeAABB();
        }
        twins.update();
      } else if (what < 9) {
        Objects<S> some;
        const std::size_t every = what == 7 ? 3 : 11;  // the former are so many that all are read
        for (std::size_t i = 0; i < inside.size(); i += every) some.push_back(inside[i]);
        jolt(some, random, 0.05, 0.2);
        twins.both([&](auto& manager) { manager.update(some); });
      } else if (what == 9) {
        auto* const one = inside[random.below(inside.size())];
        jolt(*one, random, 0.3, 1);
        twins.both([&](auto& manager) { manager.update(one); });
      } else if (what == 10 && !outside.empty()) {
        for (std::size_t i = 1 + random.below(3); i > 0 && !outside.empty(); --i) {
          twins.add({outside.back()});
          enter({outside.back()});
          outside.pop_back();
        }
      } else if (what < 13) {  // some go, and come back at once or later
        for (std::size_t i = what == 11 ? 1 : 1 + random.below(12); i > 0 && !inside.empty(); --i) {
          const std::size_t place = random.below(inside.size());
          auto* const one = inside[place];
          twins.both([&](auto& manager) { manager.unregisterObject(one); });
          inside.erase(inside.begin() + static_cast<std::ptrdiff_t>(place));
          outside.push_back(one);
          if (random.below(3) > 0) continue;
          twins.add({one});
          enter({one});
          outside.pop_back();
        }
      } else if (what == 13 && random.below(4) == 0) {
        twins.both([](auto& manager) { manager.clear(); });
        outside.insert(outside.end(), inside.begin(), inside.end());
        inside.clear();
      } else if (what == 14) {
        Scene<S> copies = scene.reallocated(static_cast<std::uint64_t>(call));
        Objects<S> of_clone;
        for (const auto* object : objectsOf<S>(twins.skinned())) {
          const auto place = std::find(scene.objects().begin(), scene.objects().end(), object);
          of_clone.push_back(copies[static_cast<std::size_t>(place - scene.objects().begin())]);
        }
        const auto clone = cloneOf<S>(twins.skinned(), of_clone);
        EXPECT_TRUE(livePairs<S>(*clone).empty() && clone->begunPairs().empty());
        EXPECT_EQ(selfPairs<S>(*clone).size(), selfPairs<S>(twins.plain()).size());
        clone->update();
        EXPECT_EQ(clone->begunPairs().size(), livePairs<S>(*clone).size());
        EXPECT_EQ(selfPairs<S>(*clone).size(), selfPairs<S>(twins.plain()).size());
      } else if (what == 15) {  // an update that fails tells nothing
        auto* const one = inside[random.below(inside.size())];
        const fcl::Transform3<S> pose = one->getTransform();
        fcl::Transform3<S> broken = pose;
        broken.translation()[1] = std::numeric_limits<S>::quiet_NaN();
        one->setTransform(broken);
        const std::size_t begun = twins.skinned().begunPairs().size();
        twins.both([](auto& manager) {
          EXPECT_THROW(manager.update(), std::invalid_argument);
          EXPECT_THROW(selfPairs<S>(manager), std::invalid_argument);
        });
        EXPECT_EQ(twins.skinned().begunPairs().size(), begun);
        twins.told().expectLive(twins.skinned());
        one->setTransform(pose);
        random.below(2) == 0 ? twins.both([](auto& manager) { manager.setup(); }) : twins.update();
      } else if (what == 16) {
        twins.both([](auto& manager) { manager.setup(); });
        twins.update();
      } else if (what == 17) {  // all rest
        twins.update();
        const std::size_t live = twins.told().size();
        twins.update();
        EXPECT_EQ(twins.told().size(), live);
        EXPECT_TRUE(twins.skinned().begunPairs().empty() && twins.skinned().endedPairs().empty());
      } else if (what == 18) {  // some are at the end of the world for a while
        if (away.empty()) {
          const double far = std::pow(10, random.between(1, std::is_same_v<S, float> ? 5 : 12));
          for (std::size_t i = 1 + random.below(3); i > 0; --i) {
            auto* const one = inside[random.below(inside.size())];
            away.emplace_back(one, one->getTransform());
            translate(*one, far * random.direction());
          }
        } else {
          for (; !away.empty(); away.pop_back()) {
            moveTo(*away.back().first, away.back().second);
          }
        }
        twins.update();
      }
      auto* const one = call % 4 == 0 ? scene[random.below(scene.size())] : nullptr;
      twins.expectSame(one, call % 6 == 0 ? &*other : nullptr);
      most_live = std::max(most_live, twins.told().size());
    }
  }
  EXPECT_GT(Twins<TypeParam>::pairs_seen, 20000u);
  EXPECT_GT(most_live, 50u);
}

// A program would believe that it has a list, or not know why it has none.
TEST(LiveManagerOptions, ThatHaveNoListAreRefused) {
  const auto refusalOf = [](const FiberManagerOptions& options, bool spheres = false) {
    try {
      spheres ? (void)makeWrappedSphereTree<double>(options)
              : (void)makeLayeredAabbTree<double>(options);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  FiberManagerOptions options = byCapsules();
  for (const double skin : {-1.0, 0.0, 0.1, 1e300}) {
    options.skin = skin;
    EXPECT_EQ(refusalOf(options), "");
  }
  EXPECT_THAT(refusalOf(options, /*spheres=*/true), testing::HasSubstr("wrapped spheres"));
  options.motion = true;
  EXPECT_THAT(refusalOf(options), testing::HasSubstr("skin and motion"));
  options.motion = false;
  options.report = Report::kVolumes;
  EXPECT_THAT(refusalOf(options), testing::HasSubstr("Report::kVolumes"));
  options.skin = 0;
  EXPECT_EQ(refusalOf(options), "");
  for (const double skin :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
        -std::numeric_limits<double>::infinity()}) {
    options.skin = skin;
    EXPECT_THAT(refusalOf(options), testing::HasSubstr("NaN or infinite"));
  }

  const auto without = makeLayeredAabbTree<double>(byCapsules());
  Live<double> pairs;
  EXPECT_THROW(without->findLivePairs(pairs), std::invalid_argument);
  EXPECT_THROW(without->begunPairs(), std::invalid_argument);
  EXPECT_THROW(without->endedPairs(), std::invalid_argument);
  EXPECT_THROW(without->liveSlotCount(), std::invalid_argument);
}

/// Rods side by side, each of which touches the next one.
template <typename S>
Scene<S> rods(std::size_t count) {
  Scene<S> scene;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = 0.19 * static_cast<double>(i);
    scene.addFiber({{x, 0, 0}, {x, 0, 1}}, 0.1);
  }
  return scene;
}

template <typename S>
std::map<std::pair<const void*, const void*>, std::int32_t> slotsOf(const Live<S>& pairs) {
  std::map<std::pair<const void*, const void*>, std::int32_t> slots;
  for (const auto& pair : pairs) slots[{pair.a, pair.b}] = pair.slot;
  return slots;
}

/// A manager with a skin of a part of a rod's radius.
template <typename Config>
auto managerOfRods(const Scene<typename Config::Scalar>& scene) {
  FiberManagerOptions options = byCapsules();
  options.skin = 0.02;
  auto manager = Config::make(options);
  for (const auto& fiber : scene.fibers()) manager->registerFiber(fiber);
  manager->update();
  return manager;
}

// A solver's friction would be that of other contacts once the tree is built anew, or once ids
// have moved up because many objects have gone.
TYPED_TEST(LiveManagers, PairsOutliveBuildsAndNewIds) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = rods<S>(400);
  const auto manager = managerOfRods<TypeParam>(scene);
  const auto slots = slotsOf<S>(livePairs<S>(*manager));
  ASSERT_EQ(slots.size(), 399u);
  EXPECT_EQ(manager->begunPairs().size(), 399u);

  for (std::size_t i = 0; i < 240; ++i) manager->unregisterObject(scene[i]);
  EXPECT_EQ(slotsOf<S>(livePairs<S>(*manager)), slots) << "other calls bring no changes";
  Scene<S> more = rods<S>(60);
  for (auto* object : more.objects()) translate<S>(*object, {-50, 0, 0});
  manager->registerObjects(more.objects());
  manager->unregisterObject(scene[241]);
  manager->update();
  // Those left of 0 ... 239, the two of 241, and the one of 239 and 240.
  EXPECT_EQ(manager->endedPairs().size(), 242u);
  EXPECT_EQ(manager->begunPairs().size(), 59u);
  auto left = slots;
  for (const auto& pair : manager->endedPairs()) {
    const auto known = left.find({pair.a, pair.b});
    ASSERT_TRUE(known != left.end());
    EXPECT_EQ(known->second, pair.slot);
    left.erase(known);
  }
  for (const auto& pair : manager->begunPairs()) left[{pair.a, pair.b}] = pair.slot;
  EXPECT_EQ(slotsOf<S>(livePairs<S>(*manager)), left);

  manager->clear();
  manager->update();
  EXPECT_EQ(slotsOf<S>(manager->endedPairs()), left);
  EXPECT_TRUE(manager->begunPairs().empty() && livePairs<S>(*manager).empty());
  manager->update();
  EXPECT_TRUE(manager->endedPairs().empty()) << "a pair ends once";
}

// A solver would keep what it knows of a pair for another object at the same address.
TYPED_TEST(LiveManagers, PairsBeginAnewIfAnObjectComesBack) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = rods<S>(3);
  const auto manager = managerOfRods<TypeParam>(scene);
  const auto slots = slotsOf<S>(livePairs<S>(*manager));
  manager->unregisterObject(scene[2]);
  manager->registerObject(scene[2]);
  manager->update();
  ASSERT_EQ(manager->endedPairs().size(), 1u);
  ASSERT_EQ(manager->begunPairs().size(), 1u);
  const auto ended = manager->endedPairs()[0], begun = manager->begunPairs()[0];
  EXPECT_TRUE(ended.a == scene[1] && ended.b == scene[2]);
  EXPECT_TRUE(begun.a == scene[1] && begun.b == scene[2]);
  EXPECT_EQ(ended.slot, (slots.at({scene[1], scene[2]})));
  EXPECT_NE(begun.slot, ended.slot);
}

// Boxes that come to the margin on every axis, and so are further apart than it along a diagonal,
// would be taken for apart.
TYPED_TEST(LiveManagers, BoxesTouchAcrossTheirCorners) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  const auto addBox = [&](const Eigen::Vector3d& center) {
    scene.addBox(center, Eigen::Quaterniond::Identity(), {1, 1, 1});
  };
  addBox({0, 0, 0});
  addBox({3.05, 3.05, 0});
  for (int i = 1; i <= 20; ++i) addBox({0, 0, 5.0 * i});
  FiberManagerOptions options = byCapsules();
  options.margin = 1;
  options.skin = 1;
  const auto manager = TypeParam::make(options);
  manager->registerObjects(scene.objects());
  manager->update();
  EXPECT_TRUE(selfPairs<S>(*manager).empty());
  // On each of two axes it comes from 2.05 to 0.95, and along the diagonal by 1.56.
  translate<S>(*scene[1], {-1.1, -1.1, 0});
  manager->update();
  EXPECT_EQ(selfPairs<S>(*manager).size(), 1u);
  EXPECT_EQ(livePairs<S>(*manager).size(), 1u);
}

// A pair would live on while its objects are apart, or be told again after a partial update.
TYPED_TEST(LiveManagers, OnlyAnUpdateOfAllTellsOfPairs) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = rods<S>(20);
  const auto manager = managerOfRods<TypeParam>(scene);
  translate<S>(*scene[19], {1, 0, 0});
  manager->update(scene[19]);
  EXPECT_EQ(selfPairs<S>(*manager).size(), 18u);
  EXPECT_EQ(livePairs<S>(*manager).size(), 19u);
  manager->update(scene.objects());  // reads all, and is another call
  EXPECT_EQ(selfPairs<S>(*manager).size(), 18u);
  EXPECT_EQ(livePairs<S>(*manager).size(), 19u);
  EXPECT_EQ(manager->begunPairs().size(), 19u);
  manager->update();
  EXPECT_EQ(livePairs<S>(*manager).size(), 18u);
  ASSERT_EQ(manager->endedPairs().size(), 1u);
  EXPECT_TRUE(manager->endedPairs()[0].b == scene[19]);
  EXPECT_TRUE(manager->begunPairs().empty());
}

// Threads that ask first after an update would fit the tree together, or read a list in the making.
TYPED_TEST(LiveManagers, ManyThreadsMayAskAfterAnUpdate) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene = strandScene<S>(12, 20, 421), other_scene = strandScene<S>(4, 10, 422);
  FiberManagerOptions options = byCapsules();
  options.threads = 2;
  const auto plain = TypeParam::make(options), other = TypeParam::make(options);
  options.skin = 0.05;
  const auto manager = TypeParam::make(options);
  other->registerObjects(other_scene.objects());
  for (auto* one : {&*plain, &*manager}) registerFibers<S>(*one, scene);
  Random random(423);
  for (int step = 0; step < 5; ++step) {
    jolt(scene.objects(), random, 0.005, 0.01);
    plain->update();
    manager->update();
    const std::size_t self = selfPairs<S>(*plain).size(),
                      with = pairsWith<S>(*plain, *other).size();
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i) {
      threads.emplace_back([&, i] {
        if (i % 2 == 0) {
          EXPECT_EQ((pairsWith<S>(*manager, *other).size()), with);
        }
        EXPECT_EQ(selfPairs<S>(*manager).size(), self);
        EXPECT_EQ(livePairs<S>(*manager).size(), self);
      });
    }
    for (std::thread& thread : threads) thread.join();
  }
}

}  // namespace
}  // namespace fcl_fibers::test
