// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

#include "support/allocation_faults.h"
#include "support/managers_under_test.h"
#include "support/pair_queries.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

// A manager of some fibers and shapes, one of others, and what more there is to register.
template <typename Config>
class ManagerFaults : public testing::Test {
 protected:
  using S = typename Config::Scalar;
  using Object = fcl::CollisionObject<S>;
  using Objects = std::vector<Object*>;
  using Manager = FiberCollisionManager<S>;
  using Base = fcl::BroadPhaseCollisionManager<S>;

  struct Subject {
    std::unique_ptr<Manager> manager, other;
    PairCollector<S> collector;
  };
  using Act = std::function<void(Subject&)>;
  using Acts = std::vector<std::pair<std::string, Act>>;

  ManagerFaults() : scene_(strandScene<S>(5, 9, 181)), others_(curledScene<S>(30, 182)) {
    addShapes(scene_, 6, 0.3, 183);
    scene_.addHalfspace({0, 0, 1}, -0.5);
    addShapes(others_, 6, 0.3, 184);
    others_.addPlane({0, 1, 0}, 0.1);
    newcomers_ = strandScene<S>(1, 70, 185);
    // oneTBB waits for ever once memory has run out while it started.
    FiberManagerOptions threaded;
    threaded.threads = 2;
    Config::make(threaded)->setup();
  }

  Subject make(const FiberManagerOptions& options) const { return make(options, scene_, others_); }
  Subject makeReady(const FiberManagerOptions& options) const {
    return makeReady(options, scene_, others_);
  }
  static Subject make(const FiberManagerOptions& options, const Scene<S>& scene,
                      const Scene<S>& others) {
    Subject subject{Config::make(options), Config::make(options), {}};
    registerFibers<S>(*subject.manager, scene);
    subject.other->registerObjects(others.objects());
    // Recording pairs is not to be what fails.
    subject.collector.calls.reserve(10000);
    return subject;
  }
  static Subject makeReady(const FiberManagerOptions& options, const Scene<S>& scene,
                           const Scene<S>& others) {
    Subject subject = make(options, scene, others);
    subject.manager->setup();
    subject.other->setup();
    return subject;
  }

  /// Every query, of the manager itself, one object, the other manager and a foreign one.
  static Acts queries(Object* one, Base& foreign) {
    using Partner = std::function<QueryPartner<S>(Subject&)>;
    const std::vector<std::pair<std::string, Partner>> partners = {
        {"itself", [](Subject&) { return QueryPartner<S>(); }},
        {"an object", [one](Subject&) { return QueryPartner<S>(one); }},
        {"the other", [](Subject& s) { return QueryPartner<S>(*s.other, {}); }},
        {"a foreign one", [&foreign](Subject&) { return QueryPartner<S>(foreign, {}); }}};
    Acts acts;
    for (const auto& entry : partners) {
      acts.emplace_back("collide with " + entry.first, [partner = entry.second](Subject& s) {
        partner(s).collide(*s.manager, &s.collector, &PairCollector<S>::collide);
      });
      acts.emplace_back("distance to " + entry.first, [partner = entry.second](Subject& s) {
        partner(s).distance(*s.manager, &s.collector, [](auto* a, auto* b, void* data, S&) {
          return PairCollector<S>::collide(a, b, data);
        });
      });
    }
    return acts;
  }

  /// Their order is another one where the tree had to be built anew.
  static Calls<S> sortedPairs(const Manager& manager) {
    Calls<S> pairs = selfPairs<S>(manager);
    std::sort(pairs.begin(), pairs.end());
    return pairs;
  }

  /// The scene where it was at first.
  void moveBack() {
    for (std::size_t i = 0; i < scene_.size(); ++i) moveTo(*scene_[i], poses_[i]);
  }
  void rememberPoses() {
    for (Object* object : scene_.objects()) poses_.push_back(object->getTransform());
  }

  Scene<S> scene_, others_, newcomers_;
  std::vector<fcl::Transform3<S>> poses_;
};
TYPED_TEST_SUITE(ManagerFaults, FiberManagers, ManagerNames);

// An object would be half registered: counted but not found, or found but not counted.
TYPED_TEST(ManagerFaults, RegisteringWithoutMemoryChangesNothing) {
  using Test = ManagerFaults<TypeParam>;
  using S = typename TypeParam::Scalar;
  const typename Test::Acts acts = {
      {"registerObject",
       [&](auto& subject) { subject.manager->registerObject(this->newcomers_[0]); }},
      {"registerObjects",
       [&](auto& subject) { subject.manager->registerObjects(this->newcomers_.objects()); }},
      {"registerFiber",
       [&](auto& subject) { subject.manager->registerFiber(this->newcomers_.objects()); }},
      {"unregisterObject",
       [&](auto& subject) { subject.manager->unregisterObject(this->scene_[3]); }},
      {"clear", [&](auto& subject) { subject.manager->clear(); }},
  };
  for (const FiberManagerOptions& options : assortedOptions()) {
    for (const auto& [name, act] : acts) {
      auto plain = this->makeReady(options);
      const auto objects_before = objectsOf<S>(*plain.manager);
      const Calls<S> pairs_before = selfPairs<S>(*plain.manager);
      act(plain);
      const auto objects_after = objectsOf<S>(*plain.manager);
      const Calls<S> pairs_after = selfPairs<S>(*plain.manager);
      ASSERT_NE(objects_before, objects_after);
      strikeEverywhere(
          name + ", " + describe(options), [&] { return this->makeReady(options); }, act,
          [&, &name = name](const auto& subject, bool failed) {
            EXPECT_EQ(objectsOf<S>(*subject.manager), failed ? objects_before : objects_after);
            EXPECT_EQ(selfPairs<S>(*subject.manager), failed ? pairs_before : pairs_after);
            // As these two need no memory, they do not fail.
            EXPECT_FALSE(failed && (name == "unregisterObject" || name == "clear"));
          });
    }
  }
}

// A tree, or an index of the young objects, that was built half would be searched.
TYPED_TEST(ManagerFaults, ReadingWithoutMemoryIsMadeUpFor) {
  using Test = ManagerFaults<TypeParam>;
  const typename Test::Acts acts = {
      {"setup", [](auto& subject) { subject.manager->setup(); }},
      {"first query",
       [](auto& subject) {
         subject.collector.calls.clear();
         subject.manager->collide(&subject.collector, &PairCollector<typename Test::S>::collide);
       }},
      {"update(object)", [&](auto& subject) { subject.manager->update(this->scene_[3]); }},
  };
  for (const FiberManagerOptions& options : assortedOptions()) {
    for (const bool has_young : {false, true}) {
      const auto make = [&] {
        if (!has_young) return this->make(options);
        auto subject = this->makeReady(options);
        const auto& newcomers = this->newcomers_.objects();
        subject.manager->registerObjects({newcomers.begin(), newcomers.begin() + 5});
        return subject;
      };
      const auto pairs = Test::sortedPairs(*make().manager);
      for (const auto& [name, act] : acts) {
        strikeEverywhere(name + (has_young ? ", young objects, " : ", ") + describe(options), make,
                         act, [&, &name = name](const auto& subject, bool) {
                           // What an update leaves half is refused until one succeeds.
                           try {
                             EXPECT_EQ(Test::sortedPairs(*subject.manager), pairs);
                           } catch (const std::invalid_argument&) {
                             EXPECT_EQ(name, "update(object)");
                           }
                           // No query is taken to be running.
                           EXPECT_NO_THROW(subject.manager->update());
                           EXPECT_EQ(Test::sortedPairs(*subject.manager), pairs);
                         });
      }
    }
  }
}

// An update of another object would make up for the query, and what had come would not be found.
TYPED_TEST(ManagerFaults, AfterAReadingWithoutMemoryAnUpdateOfAnotherObjectIsNotEnough) {
  using Test = ManagerFaults<TypeParam>;
  using S = typename TypeParam::Scalar;
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    FiberManagerOptions options;
    options.report = report;
    Scene<S> walls;
    auto* const old = walls.addHalfspace({0, 1, 0}, -0.4);
    auto* const young = walls.addHalfspace({1, 0, 0}, -0.3);
    const auto make_grown = [&] {
      auto subject = Test::make(options, this->scene_, this->others_);
      subject.manager->registerObject(old);
      subject.manager->setup();
      subject.manager->registerObject(young);
      return subject;
    };
    const Calls<S> expected = Test::sortedPairs(*make_grown().manager);
    ASSERT_TRUE(std::any_of(expected.begin(), expected.end(),
                            [&](const auto& pair) { return pair.second == young; }));
    strikeEverywhere(
        describe(options), make_grown, [](auto& subject) { subject.manager->setup(); },
        [&](const auto& subject, bool) {
          subject.manager->update(old);
          EXPECT_TRUE(Test::sortedPairs(*subject.manager) == expected);
        });
  }
}

// Answers would be those for some of the objects where they were and some where they are.
TYPED_TEST(ManagerFaults, UpdatingWithoutMemoryKeepsOrRefusesAnswers) {
  using Test = ManagerFaults<TypeParam>;
  using S = typename TypeParam::Scalar;
  using Objects = typename Test::Objects;
  this->rememberPoses();
  const auto move = [&](const Objects& moved, double distance) {
    Random random(186);
    for (auto* object : moved) jolt(*object, random, distance, 0.5);
  };
  const Objects few(this->scene_.objects().begin() + 20, this->scene_.objects().begin() + 24);
  // So far that the bundle is made anew.
  const double far = 40;
  const typename Test::Acts acts = {
      {"update()",
       [&](auto& subject) {
         move(this->scene_.objects(), 0.2);
         subject.manager->update();
       }},
      {"update() of fibers that fly apart",
       [&](auto& subject) {
         move(this->scene_.objects(), far);
         subject.manager->update();
       }},
      {"update(objects)",
       [&](auto& subject) {
         move(few, 0.3);
         subject.manager->update(few);
       }},
      {"update(object)",
       [&](auto& subject) {
         move({few[0]}, 0.3);
         subject.manager->update(few[0]);
       }},
  };
  for (const FiberManagerOptions& options : assortedOptions()) {
    for (const auto& [name, act] : acts) {
      auto plain = this->makeReady(options);
      const Calls<S> pairs_before = Test::sortedPairs(*plain.manager);
      act(plain);
      const Calls<S> pairs_after = Test::sortedPairs(*plain.manager);
      this->moveBack();
      strikeEverywhere(
          name + ", " + describe(options),
          [&] {
            this->moveBack();
            return this->makeReady(options);
          },
          [&, &act = act](auto& subject) {
            this->moveBack();
            act(subject);
          },
          [&](const auto& subject, bool failed) {
            EXPECT_EQ(subject.manager->size(), this->scene_.size());
            if (!failed) {
              EXPECT_EQ(Test::sortedPairs(*subject.manager), pairs_after);
              return;
            }
            try {
              // With objects that are read again for queries, where they are.
              this->moveBack();
              EXPECT_EQ(Test::sortedPairs(*subject.manager), pairs_before);
            } catch (const std::invalid_argument&) {
            }
          });
      this->moveBack();
    }
  }
}

// Capsules that each have a few poses, in a manager that follows them from one to the next.
class MotionFaults : public testing::Test {
 protected:
  using Objects = std::vector<fcl::CollisionObject<double>*>;
  using Manager = LayeredAABBTreeCollisionManager<double>;

  MotionFaults() : scene_(soupScene<double>(100, 1, 192)) {
    Random random(193);
    for (auto& poses : poses_) {
      for (auto* object : scene_.objects()) poses.push_back(object->getTransform());
      // The last is so far that the bundle is made anew.
      jolt(scene_.objects(), random, &poses == &poses_[2] ? 40 : 0.3, 0.5);
    }
    options_.report = Report::kCapsules;
    options_.motion = true;
  }

  Objects some(std::size_t begin, std::size_t end) const {
    const auto first = scene_.objects().begin();
    return {first + static_cast<std::ptrdiff_t>(begin), first + static_cast<std::ptrdiff_t>(end)};
  }
  void place(std::size_t pose, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) moveTo(*scene_[i], poses_[pose][i]);
  }
  /// Of some objects, in the step from the first poses to the second.
  std::unique_ptr<Manager> makeMoving(std::size_t begin, std::size_t end) {
    place(0, 0, scene_.size());
    auto manager = std::make_unique<Manager>(options_);
    manager->registerObjects(scene_.objects());
    for (auto* object : some(0, begin)) manager->unregisterObject(object);
    for (auto* object : some(end, scene_.size())) manager->unregisterObject(object);
    manager->beginStep();
    place(1, 0, scene_.size());
    manager->update();
    return manager;
  }
  static Calls<double> sortedPairs(const Manager& manager) {
    Calls<double> pairs = selfPairs<double>(manager);
    std::sort(pairs.begin(), pairs.end());
    return pairs;
  }

  Scene<double> scene_;
  std::vector<fcl::Transform3<double>> poses_[4];
  FiberManagerOptions options_;
};

// An object would be unregistered while the index still has the ids of before.
TEST_F(MotionFaults, UnregisteringWithoutMemoryKeepsTheStep) {
  // So few are left that another removal gives them new ids.
  const std::size_t begin = 80, end = 98;
  const auto act = [&](auto& manager) { manager->unregisterObject(scene_[begin + 3]); };
  auto plain = makeMoving(begin, end);
  const auto pairs_before = sortedPairs(*plain);
  act(plain);
  const auto pairs_after = sortedPairs(*plain);
  ASSERT_NE(pairs_before, pairs_after);
  plain->endStep();
  ASSERT_NE(pairs_after, sortedPairs(*plain)) << "motion does not matter";
  bool has_failed = false;
  strikeEverywhere(
      "unregisterObject", [&] { return makeMoving(begin, end); }, act,
      [&](const auto& manager, bool failed) {
        EXPECT_EQ(manager->size(), end - begin - (failed ? 0 : 1));
        EXPECT_EQ(sortedPairs(*manager), failed ? pairs_before : pairs_after);
        has_failed |= failed;
      });
  EXPECT_TRUE(has_failed) << "ids do not change";
}

// An update that is repeated would lose where its step began.
TEST_F(MotionFaults, AnUpdateWithoutMemoryKeepsTheStart) {
  const std::size_t young = 92, last = 97;
  const auto makeGrown = [&] {
    auto manager = makeMoving(0, young);
    // These rest before.
    manager->registerObjects(some(young, last));
    manager->beginStep();
    return manager;
  };
  const std::size_t few = 85;
  const std::vector<std::pair<std::string, std::function<void(std::unique_ptr<Manager>&)>>> acts = {
      {"update()",
       [&](auto& manager) {
         place(2, 0, last);
         manager->update();
       }},
      {"update() of capsules that fly apart",
       [&](auto& manager) {
         place(3, 0, last);
         manager->update();
       }},
      {"update(objects)",
       [&](auto& manager) {
         place(2, few, last);
         manager->update(some(few, last));
       }},
  };
  for (const auto& [name, act] : acts) {
    auto plain = makeGrown();
    const auto pairs_before = sortedPairs(*plain);
    act(plain);
    const auto pairs = sortedPairs(*plain);
    ASSERT_NE(pairs, pairs_before);
    strikeEverywhere(name, makeGrown, act, [&](const auto& manager, bool failed) {
      if (failed) return;
      EXPECT_EQ(sortedPairs(*manager), pairs);
    });
  }
}

// A step would end in part, or objects that are gone would be left in a manager.
TEST_F(MotionFaults, StepsOfMeshesEndWithoutMemory) {
  Scene<double> scene;
  scene.addSphere({0, 0, 0}, 0.1);
  auto* mesh = scene.addMesh({-5, 0, 0}, 1);
  Manager manager(options_);
  const auto sweep = [&] {
    manager.registerObjects(scene.objects());
    manager.beginStep();
    moveTo(*mesh, makePose<double>(Eigen::Quaterniond::Identity(), {10, 0, 0}));
    manager.update();
    EXPECT_EQ(sortedPairs(manager).size(), 1u);
  };
  const fcl::Transform3<double> pose = mesh->getTransform();
  for (const auto& [name, act] : std::vector<std::pair<std::string, std::function<void()>>>{
           {"endStep()", [&] { manager.endStep(); }},
           {"beginStep()", [&] { manager.beginStep(); }}}) {
    SCOPED_TRACE(name);
    moveTo(*mesh, pose);
    sweep();
    EXPECT_FALSE(allocates(act));
    EXPECT_TRUE(sortedPairs(manager).empty());
    manager.clear();
  }
  moveTo(*mesh, pose);
  sweep();
  EXPECT_FALSE(allocates([&] { manager.clear(); }));
  EXPECT_TRUE(manager.empty());
  moveTo(*mesh, pose);
  sweep();
}

// A query would leave the manager locked, or with what it had found so far.
TYPED_TEST(ManagerFaults, AQueryWithoutMemoryChangesNothing) {
  using Test = ManagerFaults<TypeParam>;
  using S = typename TypeParam::Scalar;
  const auto naive = makeFclNaive<S>();
  naive->registerObjects(this->others_.objects());
  const auto acts = Test::queries(this->others_[0], *naive);
  for (const FiberManagerOptions& options : assortedOptions()) {
    for (const auto& [name, act] : acts) {
      auto plain = this->makeReady(options);
      act(plain);
      const Calls<S> calls = plain.collector.calls;
      ASSERT_FALSE(calls.empty()) << name;
      const Calls<S> pairs = selfPairs<S>(*plain.manager);
      strikeEverywhere(
          name + ", " + describe(options), [&] { return this->makeReady(options); },
          [&, &act = act](auto& subject) {
            subject.collector.calls.clear();
            act(subject);
          },
          [&](auto& subject, bool failed) {
            const Calls<S>& seen = subject.collector.calls;
            ASSERT_LE(seen.size(), calls.size());
            EXPECT_TRUE(std::equal(seen.begin(), seen.end(), calls.begin()));
            if (!failed) {
              EXPECT_EQ(seen.size(), calls.size());
            }
            EXPECT_EQ(selfPairs<S>(*subject.manager), pairs);
            // No query is taken to be running.
            EXPECT_NO_THROW(subject.manager->update());
            EXPECT_NO_THROW(subject.other->update());
          });
    }
  }
}

// A manager that could not be made would leave something behind.
TYPED_TEST(ManagerFaults, AManagerIsMadeWholeOrNotAtAll) {
  for (const FiberManagerOptions& options : assortedOptions()) {
    strikeEverywhere(
        "constructor, " + describe(options), [] { return 0; },
        [&](int) { TypeParam::make(options); }, [](int, bool) {});
  }
}

// A clone would be made half, its original be changed, or something be left behind; or a tree that
// was fitted half be searched by its next query.
TYPED_TEST(ManagerFaults, ACloneIsMadeWholeOrNotAtAll) {
  using Test = ManagerFaults<TypeParam>;
  using S = typename TypeParam::Scalar;
  const Scene<S> copies = this->scene_.reallocated(187);
  for (auto* object : copies.objects()) translate(*object, {0.01, 0.02, 0});
  for (const FiberManagerOptions& options : assortedOptions()) {
    const auto plain = this->makeReady(options);
    const Calls<S> pairs = selfPairs<S>(*plain.manager);
    const Calls<S> pairs_of_clone = selfPairs<S>(*cloneOf<S>(*plain.manager, copies.objects()));
    ASSERT_FALSE(pairs_of_clone.empty());
    strikeEverywhere(
        "clone, " + describe(options), [&] { return this->makeReady(options); },
        [&](auto& subject) {
          // The plain one stays what it is, and is at hand when the clone has failed.
          subject.other = cloneOf<S>(*subject.manager, copies.objects());
        },
        [&](const auto& subject, bool failed) {
          EXPECT_EQ(selfPairs<S>(*subject.manager), pairs);
          if (!failed) {
            EXPECT_EQ(selfPairs<S>(*subject.other), pairs_of_clone);
          }
        });
    auto sorted = pairs_of_clone;
    std::sort(sorted.begin(), sorted.end());
    strikeEverywhere(
        "setup of a clone, " + describe(options),
        [&] {
          auto subject = this->makeReady(options);
          subject.manager = cloneOf<S>(*subject.manager, copies.objects());
          return subject;
        },
        [](auto& subject) { subject.manager->setup(); },
        [&](const auto& subject, bool) { EXPECT_EQ(Test::sortedPairs(*subject.manager), sorted); });
  }
}

// An exception from a callback, whichever call it is, would leave something behind.
TYPED_TEST(ManagerFaults, EveryCallOfACallbackMayThrow) {
  using Test = ManagerFaults<TypeParam>;
  using S = typename TypeParam::Scalar;
  // Small, so that it can be every call.
  Scene<S> scene = strandScene<S>(3, 6, 188), others = curledScene<S>(10, 189);
  addShapes(scene, 4, 0.3, 190);
  scene.addHalfspace({0, 0, 1}, 0);
  addShapes(others, 3, 0.3, 191);
  others.addPlane({0, 1, 0}, 0.1);
  auto* const one = others.addSphere({0, 0, 0}, 0.8);
  const auto naive = makeFclNaive<S>();
  naive->registerObjects(others.objects());
  const auto acts = Test::queries(one, *naive);
  for (const FiberManagerOptions& options : assortedOptions()) {
    auto subject = Test::makeReady(options, scene, others);
    for (const auto& [name, act] : acts) {
      SCOPED_TRACE(name + ", " + describe(options));
      const auto run = [&, &act = act](std::size_t throw_at) {
        subject.collector.calls.clear();
        subject.collector.throw_at = throw_at;
        try {
          act(subject);
        } catch (const CallbackError&) {
          return true;
        }
        return false;
      };
      ASSERT_FALSE(run(kNever));
      const Calls<S> calls = subject.collector.calls;
      ASSERT_FALSE(calls.empty());
      for (std::size_t at = 1; at <= calls.size(); ++at) {
        // A query keeps the memory of the last of its searches for the next query, and this one may
        // end in another search than the one before.
        ASSERT_TRUE(run(at));
        const std::size_t before = liveAllocations();
        ASSERT_TRUE(run(at));
        const Calls<S>& some = subject.collector.calls;
        ASSERT_EQ(some.size(), at);
        ASSERT_TRUE(std::equal(some.begin(), some.end(), calls.begin()));
        ASSERT_EQ(liveAllocations(), before);
      }
      ASSERT_FALSE(run(kNever));
      EXPECT_EQ(subject.collector.calls, calls);
      EXPECT_NO_THROW(subject.manager->update());
    }
  }
}

// A frame that allocates is slow now and then.
TYPED_TEST(ManagerFaults, NothingIsAllocatedAfterTheFirstFrame) {
  using S = typename TypeParam::Scalar;
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    FiberManagerOptions options;
    options.report = report;
    options.ignored_neighbors = 1;
    Scene<S> scene = strandScene<S>(20, 40, 186);
    const auto manager = TypeParam::make(options);
    registerFibers<S>(*manager, scene);
    PairCollector<S> collector;
    collector.calls.reserve(100000);
    const auto frame = [&](S shift) {
      for (std::size_t i = 0; i < scene.size(); ++i) {
        fcl::Transform3<S> pose = scene[i]->getTransform();
        pose.translation()[2] += shift * static_cast<S>(i % 7);
        moveTo(*scene[i], pose);
      }
      collector.calls.clear();
      manager->update();
      manager->collide(&collector, &PairCollector<S>::collide);
    };
    frame(0);
    EXPECT_FALSE(allocates([&] { frame(S(0.001)); }));
    EXPECT_FALSE(collector.calls.empty());
  }
}

// After an update without memory some pairs would have ended, and nobody would ever be told.
TEST(LiveFaults, AnUpdateWithoutMemoryTellsNothing) {
  using Manager = FiberCollisionManager<double>;
  using Names = std::vector<std::pair<const void*, const void*>>;
  const auto named = [](const std::vector<LiveObjectPair<double>>& pairs) {
    Names names;
    for (const auto& pair : pairs) names.emplace_back(pair.a, pair.b);
    std::sort(names.begin(), names.end());
    return names;
  };
  const auto told = [&](const Manager& manager) {
    std::vector<LiveObjectPair<double>> live;
    manager.findLivePairs(live);
    return std::array{named(live), named(manager.begunPairs()), named(manager.endedPairs())};
  };
  Scene<double> scene = strandScene<double>(8, 12, 194);
  std::vector<fcl::Transform3<double>> poses[3];
  Random random(195);
  for (auto& some : poses) {
    for (auto* object : scene.objects()) some.push_back(object->getTransform());
    jolt(scene.objects(), random, 0.01, 0.02);
  }
  const auto place = [&](std::size_t pose) {
    for (std::size_t i = 0; i < scene.size(); ++i) moveTo(*scene[i], poses[pose][i]);
  };
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  options.skin = 0.1;
  const auto make = [&] {
    std::unique_ptr<Manager> manager = makeLayeredAabbTree<double>(options);
    registerFibers<double>(*manager, scene);
    for (const std::size_t pose : {std::size_t{0}, std::size_t{1}}) {
      place(pose);
      manager->update();
    }
    return manager;
  };
  // Without some, so that all is listed, and without so many that the others get new ids.
  for (const std::size_t removed : {std::size_t{0}, std::size_t{5}, std::size_t{85}}) {
    const auto makeLess = [&] {
      auto manager = make();
      for (std::size_t i = 0; i < removed; ++i) manager->unregisterObject(scene[i]);
      return manager;
    };
    const auto act = [&](auto& manager) {
      place(2);
      manager->update();
    };
    auto plain = makeLess();
    const auto before = told(*plain);
    act(plain);
    const auto after = told(*plain);
    ASSERT_NE(before, after);
    ASSERT_FALSE(after[0].empty());
    strikeEverywhere(std::to_string(removed) + " gone", makeLess, act,
                     [&](const auto& manager, bool failed) {
                       EXPECT_EQ(told(*manager), failed ? before : after);
                       if (failed) {
                         EXPECT_THROW(selfPairs<double>(*manager), std::invalid_argument);
                       } else {
                         EXPECT_EQ(selfPairs<double>(*manager).size(), after[0].size());
                       }
                     });
  }
  bool has_failed = false;
  for (const auto& act : std::vector<std::function<void(std::unique_ptr<Manager>&)>>{
           [&](auto& manager) { manager->unregisterObject(scene[3]); },
           [](auto& manager) { manager->clear(); }}) {
    auto plain = make();
    const auto before = told(*plain);
    strikeEverywhere("leaving", make, act, [&](const auto& manager, bool failed) {
      EXPECT_EQ(told(*manager), before);
      EXPECT_TRUE(!failed || manager->size() == scene.size());
      has_failed |= failed;
    });
  }
  EXPECT_TRUE(has_failed);
}

}  // namespace
}  // namespace fcl_fibers::test
