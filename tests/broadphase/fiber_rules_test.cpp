// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "support/distance_search.h"
#include "support/managers_under_test.h"
#include "support/pair_oracle.h"
#include "support/pair_queries.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

// What the fiber managers promise beyond FCL's contract: fibers, neighbours, margins, statistics.

FiberManagerOptions ignoring(int neighbors, Report report = Report::kVolumes, double margin = 0) {
  FiberManagerOptions options;
  options.ignored_neighbors = neighbors;
  options.report = report;
  options.margin = margin;
  return options;
}

template <typename S>
std::vector<FiberManagerOptions> neighborOptions() {
  std::vector<FiberManagerOptions> all;
  for (const int neighbors : {0, 1, 2, 5, 1000}) {
    for (const Report report : {Report::kVolumes, Report::kCapsules}) {
      for (const double margin : {0.0, 0.03}) all.push_back(ignoring(neighbors, report, margin));
    }
  }
  return all;
}

template <typename Config>
class FiberRules : public testing::Test {};
TYPED_TEST_SUITE(FiberRules, FiberManagers, ManagerNames);

template <typename Config>
class Cascade : public testing::Test {};
TYPED_TEST_SUITE(Cascade, WrappedManagers, ManagerNames);

// A rope's ends that meet would be a contact; or segments be ignored by their number where the rule
// is a length.
TYPED_TEST(FiberRules, NeighborsByArcLengthAndAcrossTheSeam) {
  using S = typename TypeParam::Scalar;
  // A ring so thick that all touch all, its segments of lengths 1, 2, 1, 2, ...
  constexpr int kSegments = 12;
  std::vector<Eigen::Vector3d> points;
  const double perimeter = 1.5 * kSegments, radius = perimeter / (2 * 3.141592653589793);
  for (int i = 0; i <= kSegments; ++i) {
    const double arc = i % kSegments == 0 ? 0 : 1.5 * i - (i % 2 == 1 ? 0.5 : 0);
    const double angle = arc / radius;
    points.push_back({radius * std::cos(angle), radius * std::sin(angle), 0});
  }
  Scene<S> scene;
  const auto ring = scene.addFiber(points, 2 * radius);
  for (const FiberEnds ends : {FiberEnds::kOpen, FiberEnds::kClosed}) {
    for (const int neighbors : {0, 2}) {
      for (const double length : {0.0, 2.5}) {
        for (const Report report : {Report::kVolumes, Report::kCapsules}) {
          FiberManagerOptions options = ignoring(neighbors, report);
          options.ignored_arc_length = length;
          const auto manager = TypeParam::make(options);
          manager->registerFiber(ring, ends);
          std::size_t expected = 0;
          for (int i = 0; i < kSegments; ++i) {
            for (int j = i + 1; j < kSegments; ++j) {
              // Chords are a little shorter than 1 and 2, so that two of them are below 2.5 once.
              const auto near = [&](int from, int to) {
                const int apart = to - from;
                double between = 0;
                for (int k = from + 1; k < to; ++k) between += k % 2 == 0 ? 1 : 2;
                return apart <= neighbors || (length > 0 && between <= length);
              };
              const bool ignored =
                  near(i, j) || (ends == FiberEnds::kClosed && near(j, i + kSegments));
              expected += !ignored;
            }
          }
          EXPECT_EQ(selfPairs(*manager).size(), expected)
              << (ends == FiberEnds::kClosed ? "closed, " : "open, ") << describe(options)
              << ", arc " << length;
        }
      }
    }
  }
}

// Neighbours along a fiber, which always touch, would drown real contacts; or real ones be ignored.
TYPED_TEST(FiberRules, NeighborsAlongAFiberAreIgnoredAndNoOthers) {
  using S = typename TypeParam::Scalar;
  const Scene<S> curled = curledScene<S>(150, 141);
  const Scene<S> unequal = unequalScene<S>(142);
  for (const FiberManagerOptions& options : neighborOptions<S>()) {
    for (const Scene<S>* scene : {&curled, &unequal}) {
      SCOPED_TRACE(describe(options));
      const auto manager = TypeParam::make(options);
      registerFibers(*manager, *scene);
      const PairOracle<S> oracle(scene->objects(), rulesOf<TypeParam>(options), scene->fibers());
      const Calls<S> pairs = selfPairs(*manager);
      EXPECT_TRUE(oracle.answersSelf(pairs, scene->objects()));
      EXPECT_EQ(pairsWith(*manager, *manager), pairs);
      for (std::size_t i = 0; i < scene->size(); i += 19) {
        fcl::CollisionObject<S>* object = (*scene)[i];
        EXPECT_TRUE(
            oracle.answersBetween(pairsWith(*manager, *object), scene->objects(), {object}));
      }
    }
  }
}

// Fibers that were only guessed would lose pairs that the user asked for.
TYPED_TEST(FiberRules, NeighborsAreNeverIgnoredInGuessedFibers) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = unequalScene<S>(143);
  const FiberManagerOptions options = ignoring(3);
  const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>(options));
  const auto at_once = TypeParam::make(options);
  at_once->registerObjects(scene.objects());
  EXPECT_TRUE(oracle.answersSelf(selfPairs(*at_once), scene.objects()));
  const auto one_by_one = TypeParam::make(options);
  for (fcl::CollisionObject<S>* object : scene.objects()) one_by_one->registerObject(object);
  EXPECT_TRUE(oracle.answersSelf(selfPairs(*one_by_one), scene.objects()));

  // Some registered as fibers, some not, even where one goes on where the other ends.
  const auto mixed = TypeParam::make(options);
  std::vector<std::vector<fcl::CollisionObject<S>*>> given;
  for (std::size_t f = 0; f < scene.fibers().size(); ++f) {
    if (f % 2 == 0) {
      mixed->registerObjects(scene.fibers()[f]);
      continue;
    }
    const auto& fiber = scene.fibers()[f];
    const auto half = fiber.begin() + static_cast<std::ptrdiff_t>(fiber.size() / 2);
    for (const auto& part : {std::vector<fcl::CollisionObject<S>*>(fiber.begin(), half),
                             std::vector<fcl::CollisionObject<S>*>(half, fiber.end())}) {
      mixed->registerFiber(part);
      given.push_back(part);
    }
  }
  const PairOracle<S> mixed_oracle(scene.objects(), rulesOf<TypeParam>(options), given);
  EXPECT_TRUE(mixed_oracle.answersSelf(selfPairs(*mixed), scene.objects()));
}

// Removing one segment would make neighbours of those that it kept apart.
TYPED_TEST(FiberRules, SegmentNumbersStayWhenOneIsUnregistered) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = curledScene<S>(60, 144);
  for (const int neighbors : {1, 2, 5}) {
    SCOPED_TRACE(neighbors);
    const FiberManagerOptions options = ignoring(neighbors);
    const auto manager = TypeParam::make(options);
    manager->registerFiber(scene.objects());
    std::vector<fcl::CollisionObject<S>*> left = scene.objects();
    for (const std::size_t i : std::initializer_list<std::size_t>{59, 31, 30, 12, 0}) {
      manager->unregisterObject(scene[i]);
      left.erase(left.begin() + static_cast<std::ptrdiff_t>(i));
      // The oracle counts along the fiber as it was given.
      const PairOracle<S> oracle(left, rulesOf<TypeParam>(options), scene.fibers());
      EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), left));
      EXPECT_EQ(manager->fiberSegment(scene[29]).segment, 29u);
      EXPECT_EQ(manager->fiberSegment(scene[58]).segment, 58u);
    }
    // One that comes back by itself is no part of the fiber any more.
    manager->registerObject(scene[30]);
    left.push_back(scene[30]);
    std::vector<fcl::CollisionObject<S>*> fiber = scene.objects();
    fiber[30] = nullptr;
    const PairOracle<S> oracle(left, rulesOf<TypeParam>(options), {fiber});
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), left));
    EXPECT_NE(manager->fiberSegment(scene[30]).fiber, manager->fiberSegment(scene[29]).fiber);
  }
}

// After many segments were taken out, numbers would be dealt anew and neighbours be mixed up.
TYPED_TEST(FiberRules, SegmentNumbersStayWhenManyAreUnregistered) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = curledScene<S>(200, 159);
  const Scene<S> second = curledScene<S>(120, 160);
  std::vector<fcl::CollisionObject<S>*> left = scene.objects();
  left.insert(left.end(), second.objects().begin(), second.objects().end());
  const FiberManagerOptions options = ignoring(3);
  const auto manager = TypeParam::make(options);
  manager->registerFiber(scene.objects());
  manager->registerFiber(second.objects());
  // One that is only guessed has no neighbours to ignore, and must not come to have some.
  const Scene<S> guessed = curledScene<S>(80, 166);
  manager->registerObjects(guessed.objects());
  left.insert(left.end(), guessed.objects().begin(), guessed.objects().end());
  Random random(161);
  while (left.size() > 60) {
    const std::size_t i = random.below(left.size());
    manager->unregisterObject(left[i]);
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(i));
    if (left.size() % 23 != 0) continue;
    const PairOracle<S> oracle(left, rulesOf<TypeParam>(options),
                               {scene.objects(), second.objects()});
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), left)) << left.size() << " left";
  }
  for (std::size_t i = 0; i < scene.size(); ++i) {
    if (std::find(left.begin(), left.end(), scene[i]) == left.end()) continue;
    EXPECT_EQ(manager->fiberSegment(scene[i]).segment, i);
  }
}

// The nearest pair would always be one of neighbours, at distance zero.
TYPED_TEST(FiberRules, DistanceIgnoresNeighborsToo) {
  using S = typename TypeParam::Scalar;
  // Thin fibers, far apart compared to their radius.
  Scene<S> scene;
  Random random(145);
  for (int f = 0; f < 9; ++f) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i <= 12; ++i) {
      points.push_back(Eigen::Vector3d(f % 3, f / 3, 0.3 * i) + random.inCube(0.2));
    }
    scene.addFiber(points, 0.005);
  }
  for (const int neighbors : {1, 2, 5, 1000}) {
    for (const Report report : {Report::kVolumes, Report::kCapsules}) {
      const FiberManagerOptions options = ignoring(neighbors, report, 0.01);
      SCOPED_TRACE(describe(options));
      const auto manager = TypeParam::make(options);
      registerFibers(*manager, scene);
      const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>(options), scene.fibers());
      const S smallest = oracle.smallestDistance(scene.objects());
      ASSERT_GT(smallest, 0);
      DistanceSearch<S> search(oracle);
      search.run(*manager);
      EXPECT_TRUE(search.keepsToTheRules());
      EXPECT_EQ(search.result(), smallest);

      DistanceSearch<S> all(oracle);
      all.lowers = false;
      all.run(*manager);
      EXPECT_TRUE(all.keepsToTheRules());
      EXPECT_EQ(all.calls.size(), oracle.pairCount(scene.objects()));

      for (std::size_t i = 0; i < scene.size(); i += 10) {
        DistanceSearch<S> one(oracle);
        one.run(*manager, *scene[i]);
        EXPECT_TRUE(one.keepsToTheRules());
        EXPECT_EQ(one.result(), oracle.smallestDistance(scene.objects(), {scene[i]}));
      }
    }
  }
}

// The neighbours of a segment that another manager holds as well would come back through that one.
TYPED_TEST(FiberRules, NeighborsAreIgnoredThroughAnotherManager) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = curledScene<S>(40, 147);
  fcl::CollisionObject<S>* shared = scene[20];
  for (const FiberManagerOptions& options : neighborOptions<S>()) {
    SCOPED_TRACE(describe(options));
    const auto manager = TypeParam::make(options);
    registerFibers(*manager, scene);
    const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>(options), scene.fibers());
    std::vector<std::unique_ptr<fcl::BroadPhaseCollisionManager<S>>> others;
    others.push_back(TypeParam::make(options));
    others.push_back(TypeParam::OtherTopology::make(options));
    others.push_back(makeFclNaive<S>());
    for (const auto& other : others) {
      other->registerObject(shared);
      EXPECT_TRUE(oracle.answersBetween(pairsWith(*manager, *other), scene.objects(), {shared}));
      DistanceSearch<S> search(oracle);
      search.lowers = false;
      search.run(*manager, *other);
      EXPECT_TRUE(search.keepsToTheRules());
    }
  }
}

/// Fibers of which most are in groups: none, and 1 to 3; and what is in no fiber.
template <typename S>
struct Grouped {
  explicit Grouped(std::uint64_t seed) : scene(strandScene<S>(12, 14, seed)) {
    for (int f = 0; f < 12; ++f) groups.push_back(f % 4);
    addShapes(scene, 6, 0.3, seed + 1);
    scene.addHalfspace({0, 0, 1}, 0);
  }
  PairOracle<S> oracle(const PairRules& rules) const {
    return PairOracle<S>(scene.objects(), rules, scene.fibers(), groups);
  }

  Scene<S> scene;
  std::vector<int> groups;
};

// Fibers that never meet would be reported; or others be lost with them.
TYPED_TEST(FiberRules, FibersOfOneGroupAreNotReportedWithOneAnother) {
  using S = typename TypeParam::Scalar;
  const Grouped<S> grouped(171);
  const Scene<S>& scene = grouped.scene;
  const auto all = scene.objects();
  for (const int neighbors : {0, 2}) {
    for (const Report report : {Report::kVolumes, Report::kCapsules}) {
      for (const int threads : {1, 2}) {
        FiberManagerOptions options = ignoring(neighbors, report, 0.01);
        options.threads = threads;
        SCOPED_TRACE(describe(options) + ", threads " + std::to_string(threads));
        const auto manager = TypeParam::make(options);
        registerFibers(*manager, scene, grouped.groups);
        const auto oracle = grouped.oracle(rulesOf<TypeParam>(options));
        const Calls<S> pairs = selfPairs(*manager);
        EXPECT_TRUE(oracle.answersSelf(pairs, all));
        EXPECT_EQ(manager->selfCollisionStatistics().pairs, pairs.size());
        EXPECT_EQ(pairsWith(*manager, *manager), pairs);
        DistanceSearch<S> every(oracle);
        every.lowers = false;
        every.run(*manager);
        EXPECT_TRUE(every.keepsToTheRules());
        EXPECT_EQ(every.calls.size(), oracle.pairCount(all));
        for (std::size_t i = 0; i < scene.size(); i += 17) {
          EXPECT_TRUE(oracle.answersBetween(pairsWith(*manager, *scene[i]), all, {scene[i]}));
          DistanceSearch<S> one(oracle);
          one.lowers = false;
          one.run(*manager, *scene[i]);
          EXPECT_TRUE(one.keepsToTheRules());
        }
      }
    }
  }
}

// A group would come together again through a manager that has an object of it as well.
TYPED_TEST(FiberRules, GroupsHoldThroughAnotherManager) {
  using S = typename TypeParam::Scalar;
  const Grouped<S> grouped(172);
  const auto all = grouped.scene.objects();
  // Of one group: others that are in both would meet twice, as (a, b) and (b, a).
  const auto& shared = grouped.scene.fibers()[5];
  const FiberManagerOptions options = ignoring(0, Report::kCapsules, 0.01);
  const auto manager = TypeParam::make(options);
  registerFibers(*manager, grouped.scene, grouped.groups);
  const auto oracle = grouped.oracle(rulesOf<TypeParam>(options));
  std::vector<std::unique_ptr<fcl::BroadPhaseCollisionManager<S>>> others;
  others.push_back(TypeParam::make(options));
  others.push_back(TypeParam::OtherTopology::make(options));
  others.push_back(makeFclNaive<S>());
  for (const auto& other : others) {
    other->registerObjects(shared);
    EXPECT_TRUE(oracle.answersBetween(pairsWith(*manager, *other), all, shared));
    DistanceSearch<S> search(oracle);
    search.lowers = false;
    search.run(*manager, *other);
    EXPECT_TRUE(search.keepsToTheRules());
  }
  // What the other manager calls a group is its own affair.
  const auto same_numbers = TypeParam::make(options);
  const Grouped<S> strangers(173);
  registerFibers(*same_numbers, strangers.scene, strangers.groups);
  auto both = all;
  both.insert(both.end(), strangers.scene.objects().begin(), strangers.scene.objects().end());
  const PairOracle<S> ungrouped(both, rulesOf<TypeParam>(options));
  EXPECT_TRUE(
      ungrouped.answersBetween(pairsWith(*manager, *same_numbers), all, strangers.scene.objects()));
}

// Groups would be forgotten or mixed up where objects come late, leave, move, or fly apart.
TYPED_TEST(FiberRules, GroupsStayThroughAllChanges) {
  using S = typename TypeParam::Scalar;
  Grouped<S> grouped(174);
  Scene<S>& scene = grouped.scene;
  const FiberManagerOptions options = ignoring(1);
  const auto manager = TypeParam::make(options);
  registerFibers(*manager, scene, grouped.groups);
  auto managed = scene.objects();
  const auto check = [&](const char* when) {
    const PairOracle<S> oracle(managed, rulesOf<TypeParam>(options), scene.fibers(),
                               grouped.groups);
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), managed)) << when;
    DistanceSearch<S> every(oracle);
    every.lowers = false;
    every.run(*manager);
    EXPECT_TRUE(every.keepsToTheRules()) << when;
    EXPECT_EQ(every.calls.size(), oracle.pairCount(managed)) << when;
    for (std::size_t i = 3; i < managed.size(); i += 31) {
      EXPECT_TRUE(oracle.answersBetween(pairsWith(*manager, *managed[i]), managed, {managed[i]}))
          << when;
    }
  };
  check("at first");
  const auto leave = [&](std::size_t i) {
    manager->unregisterObject(managed[i]);
    managed.erase(managed.begin() + static_cast<std::ptrdiff_t>(i));
  };
  for (const std::size_t i : std::initializer_list<std::size_t>{100, 42, 3}) leave(i);
  check("some are gone");

  // Few, so that they stay outside the tree: with a group that is there, and a new one.
  Random random(175);
  for (const int group : {1, 9, 9, 0}) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i <= 4; ++i) points.push_back(random.inCube(0.6));
    const auto late = scene.addFiber(points, 0.05);
    manager->registerFiber(late, FiberEnds::kOpen, FiberGroup{group});
    managed.insert(managed.end(), late.begin(), late.end());
    grouped.groups.push_back(group);
    check("one is late");
  }
  for (const double far : {0.05, 40.0}) {
    for (auto* object : managed) {
      if (object->collisionGeometry()->getNodeType() == fcl::GEOM_CAPSULE) {
        jolt(*object, random, far, 0.3);
      }
    }
    manager->update();
    check("all have moved");
    for (std::size_t i = 0; i < 3; ++i) jolt(*managed[50 * i], random, far, 0.3);
    manager->update({managed[0], managed[50], managed[100]});
    check("some have moved");
  }
  // Until ids are dealt anew.
  while (managed.size() > 40) leave(random.below(managed.size()));
  check("most are gone");
  manager->clear();
  grouped.groups.clear();
  registerFibers(*manager, scene);
  managed = objectsOf<S>(*manager);
  check("groups went with clear()");
}

// One large group would be searched through and through for nothing.
TYPED_TEST(FiberRules, AGroupCostsNothingAmongItself) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(30, 40, 176);
  const auto tests = [&](const std::vector<int>& groups) {
    const auto manager = TypeParam::make();
    registerFibers(*manager, scene, groups);
    return manager->selfCollisionStatistics().volume_tests;
  };
  std::vector<int> groups(30, 4);
  EXPECT_EQ(tests(groups), 0u);
  groups[11] = 5;
  EXPECT_GT(tests(groups), 0u);
  EXPECT_LT(tests(groups), tests({}) / 8);
}

// After updates, neighbours would come back or others be ignored.
TYPED_TEST(FiberRules, NeighborsStayIgnoredAfterUpdates) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(6, 15, 146);
  const FiberManagerOptions options = ignoring(2, Report::kCapsules, 0.02);
  const auto manager = TypeParam::make(options);
  registerFibers(*manager, scene);
  Random random(147);
  for (int step = 0; step < 6; ++step) {
    for (fcl::CollisionObject<S>* object : scene.objects()) jolt(*object, random, 0.1, 0.3);
    manager->update();
    const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>(options), scene.fibers());
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects()));
  }
}

// A large margin would be handled by another path, or be lost in the traversal's pruning.
TYPED_TEST(FiberRules, AnyMarginIsKept) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = soupScene<S>(70, 0.1, 148);
  const Scene<S> others = soupScene<S>(9, 0.1, 149, {Eigen::Vector3d(1.5, 0, 0), 1});
  std::vector<fcl::CollisionObject<S>*> all = scene.objects();
  all.insert(all.end(), others.objects().begin(), others.objects().end());
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    for (const double margin : {1e-9, 1e-3, 0.1, 0.5, 2.0, 100.0}) {
      const FiberManagerOptions options = ignoring(0, report, margin);
      SCOPED_TRACE(describe(options));
      const PairOracle<S> oracle(all, rulesOf<TypeParam>(options));
      const auto manager = TypeParam::make(options);
      manager->registerObjects(scene.objects());
      const auto other = TypeParam::make(options);
      other->registerObjects(others.objects());
      EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects()));
      EXPECT_TRUE(
          oracle.answersBetween(pairsWith(*manager, *others[0]), scene.objects(), {others[0]}));
      EXPECT_TRUE(
          oracle.answersBetween(pairsWith(*manager, *other), scene.objects(), others.objects()));
    }
  }
}

// Bounds would be rounded inward: volumes that overlap by less than a bit of a float are missed.
TYPED_TEST(FiberRules, VolumesThatBarelyOverlapAreFound) {
  using S = typename TypeParam::Scalar;
  Random random(163);
  // Against the small ones, a bit of a coordinate is large.
  for (const auto& [offset, margin, size] :
       std::vector<std::tuple<double, double, double>>{{0, 0, 0.5},
                                                       {3, 0.125, 0.5},
                                                       {1e3, 0, 0.5},
                                                       {0, 0, 0.01},
                                                       {3, 0, 0.002},
                                                       {1e3, 0.001, 0.01}}) {
    const Placement placement{Eigen::Vector3d(offset, offset / 2, -offset), 1};
    Scene<S> scene = soupScene<S>(150, size, 164, placement);
    const std::size_t count = scene.size();
    for (std::size_t i = 0; i < count; ++i) {
      // A partner of this one whose box, or whose sphere, is within the margin to a few bits.
      fcl::CollisionObject<S>* partner = scene.addCapsule(
          scene[i]->getTransform(), random.between(0, size / 4), random.between(0, size));
      jolt(*partner, random, 0, 3);
      const bool boxes = i % 2 == 0;
      const Eigen::Vector3d along =
          boxes ? Eigen::Vector3d(Eigen::Vector3d::Unit(static_cast<int>(i / 2 % 3)))
                : random.direction();
      double reach = 0;
      for (const fcl::CollisionObject<S>* object : {scene[i], partner}) {
        const auto& capsule = dynamic_cast<const fcl::Capsule<S>&>(*object->collisionGeometry());
        const Eigen::Vector3d axis = object->getRotation().col(2).template cast<double>();
        reach += static_cast<double>(capsule.radius) +
                 static_cast<double>(capsule.lz) / 2 * (boxes ? std::abs(axis.dot(along)) : 1);
      }
      const double overlap = random.between(-0.3, 1) * std::pow(10.0, random.between(-13, -6.5));
      translate(*partner, (reach + margin - overlap) * along);
    }
    const FiberManagerOptions options = ignoring(0, Report::kVolumes, margin);
    SCOPED_TRACE(describe(options) + ", offset " + std::to_string(offset) + ", size " +
                 std::to_string(size));
    const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>(options));
    const auto manager = TypeParam::make(options);
    manager->registerObjects(scene.objects());
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects()));
    // And between two managers, each with its own place.
    Scene<S> far_part = soupScene<S>(30, 0.5, 165, {Eigen::Vector3d(offset + 7, 0, 0), 3});
    const auto mine = TypeParam::make(options);
    const auto theirs = TypeParam::make(options);
    std::vector<fcl::CollisionObject<S>*> others(
        scene.objects().begin() + static_cast<std::ptrdiff_t>(count), scene.objects().end());
    others.insert(others.end(), far_part.objects().begin(), far_part.objects().end());
    const std::vector<fcl::CollisionObject<S>*> own(
        scene.objects().begin(), scene.objects().begin() + static_cast<std::ptrdiff_t>(count));
    mine->registerObjects(own);
    theirs->registerObjects(others);
    std::vector<fcl::CollisionObject<S>*> all = own;
    all.insert(all.end(), others.begin(), others.end());
    const PairOracle<S> all_oracle(all, rulesOf<TypeParam>(options));
    EXPECT_TRUE(all_oracle.answersBetween(pairsWith(*mine, *theirs), own, others));
    for (std::size_t i = 0; i < own.size(); i += 3) {
      EXPECT_TRUE(all_oracle.answersBetween(pairsWith(*theirs, *own[i]), others, {own[i]}));
    }
  }
}

// Contact would be decided by rounding: capsules that just touch are left out, or those that do not
// are reported, worst where they are nearly parallel.
TYPED_TEST(FiberRules, ContactIsDecidedToTheLastBits) {
  using S = typename TypeParam::Scalar;
  Random random(162);
  for (int i = 0; i < 1500; ++i) {
    // Axes that cross at a point of both, at any angle, the one moved along their normal until the
    // gap is nothing but a few bits.
    const double angle = std::pow(10.0, random.between(-13, 0));
    const double offset = i % 3 == 0 ? 0 : std::pow(10.0, random.between(0, 5));
    const FiberManagerOptions options = ignoring(0, Report::kCapsules, i % 2 == 0 ? 0 : 0.125);
    const double first_radius = i % 5 == 0 ? 0 : random.between(0, 0.5);
    const double second_radius = i % 5 == 0 ? 0 : random.between(0, 0.5);
    const Eigen::Vector3d axis = random.direction();
    const Eigen::Vector3d normal = axis.cross(random.direction()).normalized();
    const Eigen::Vector3d other_axis = Eigen::AngleAxisd(angle, normal) * axis;
    const Eigen::Vector3d center = offset * random.direction();
    const double unit = static_cast<double>(std::numeric_limits<S>::epsilon()) * (1 + offset);
    const double gap = random.between(-1, 1) * std::pow(10.0, random.between(-1, 3)) * unit;
    const double apart = first_radius + second_radius + options.margin + gap;
    const Eigen::Vector3d other_center = center + apart * normal;
    Scene<S> scene;
    scene.addCapsule(center - random.between(0.1, 1) * axis, center + random.between(0.1, 1) * axis,
                     first_radius);
    scene.addCapsule(other_center - random.between(0.1, 1) * other_axis,
                     other_center + random.between(0.1, 1) * other_axis, second_radius);
    const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>(options));
    const auto manager = TypeParam::make(options);
    manager->registerObjects(scene.objects());
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects()))
        << i << ": angle " << angle << ", offset " << offset << ", gap " << gap;
    EXPECT_TRUE(oracle.answersBetween(pairsWith(*manager, *scene[0]), scene.objects(), {scene[0]}))
        << i << ": angle " << angle << ", offset " << offset << ", gap " << gap;
    const auto other = TypeParam::make(options);
    other->registerObject(scene[1]);
    manager->unregisterObject(scene[1]);
    EXPECT_TRUE(oracle.answersBetween(pairsWith(*manager, *other), {scene[0]}, {scene[1]}))
        << i << ": angle " << angle << ", offset " << offset << ", gap " << gap;
  }
}

// kCapsules would leave out a contact that is there, or report one that kVolumes does not have.
TYPED_TEST(FiberRules, TouchingCapsulesAreAmongOverlappingVolumes) {
  using S = typename TypeParam::Scalar;
  for (const NamedScene<S>& named : standardScenes<S>()) {
    SCOPED_TRACE(named.name);
    const auto volumes = TypeParam::make(ignoring(0));
    volumes->registerObjects(named.scene.objects());
    const auto capsules = TypeParam::make(ignoring(0, Report::kCapsules));
    capsules->registerObjects(named.scene.objects());
    Calls<S> more = selfPairs(*volumes);
    Calls<S> fewer = selfPairs(*capsules);
    std::sort(more.begin(), more.end());
    std::sort(fewer.begin(), fewer.end());
    EXPECT_TRUE(std::includes(more.begin(), more.end(), fewer.begin(), fewer.end()));
  }
}

// The statistics would not explain the query that they are named after.
TYPED_TEST(FiberRules, StatisticsCountTheSelfQuery) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(9, 20, 150);
  for (const FiberManagerOptions& options : neighborOptions<S>()) {
    SCOPED_TRACE(describe(options));
    const auto manager = TypeParam::make(options);
    registerFibers(*manager, scene);
    const QueryStatistics statistics = manager->selfCollisionStatistics();
    EXPECT_EQ(statistics.pairs, selfPairs(*manager).size());
    EXPECT_GE(statistics.volume_tests, statistics.pairs / 8);
    if (options.report == Report::kVolumes) {
      EXPECT_EQ(statistics.capsule_tests, 0u);
    } else {
      EXPECT_GE(statistics.capsule_tests, statistics.pairs);
    }
  }
  const QueryStatistics none = TypeParam::make()->selfCollisionStatistics();
  EXPECT_EQ(none.pairs, 0u);
  EXPECT_EQ(none.capsule_tests, 0u);
}

// A user could not say which segments touched.
TYPED_TEST(FiberRules, FiberAndSegmentAreCountedInOrderOfRegistration) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = unequalScene<S>(151);
  const Scene<S> single = soupScene<S>(2, 0.3, 152);
  const auto manager = TypeParam::make();
  manager->registerObject(single[0]);
  for (const auto& fiber : scene.fibers()) manager->registerFiber(fiber);
  manager->registerObject(single[1]);
  EXPECT_EQ(manager->fiberSegment(single[0]).fiber, 0u);
  EXPECT_EQ(manager->fiberSegment(single[0]).segment, 0u);
  for (std::size_t f = 0; f < scene.fibers().size(); ++f) {
    for (std::size_t i = 0; i < scene.fibers()[f].size(); ++i) {
      const FiberSegment place = manager->fiberSegment(scene.fibers()[f][i]);
      EXPECT_EQ(place.fiber, f + 1);
      EXPECT_EQ(place.segment, i);
    }
  }
  EXPECT_EQ(manager->fiberSegment(single[1]).fiber, scene.fibers().size() + 1);
  EXPECT_EQ(manager->fiberSegment(single[1]).segment, 0u);
  // The same after the tree was built.
  manager->setup();
  EXPECT_EQ(manager->fiberSegment(scene.fibers()[1][7]).fiber, 2u);
  EXPECT_EQ(manager->fiberSegment(scene.fibers()[1][7]).segment, 7u);
  EXPECT_THROW(manager->fiberSegment(nullptr), std::invalid_argument);
  const Scene<S> unknown = soupScene<S>(1, 0.3, 153);
  EXPECT_THROW(manager->fiberSegment(unknown[0]), std::invalid_argument);
}

// Bytes a fiber could not be told, nor a leak be seen.
TYPED_TEST(FiberRules, MemoryUsageGrowsWithTheScene) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(30, 30, 154);
  const auto few = TypeParam::make();
  few->registerFiber(scene.fibers()[0]);
  few->setup();
  const auto many = TypeParam::make();
  for (const auto& fiber : scene.fibers()) many->registerFiber(fiber);
  many->setup();
  EXPECT_GT(few->memoryUsage(), 30 * sizeof(void*));
  EXPECT_GT(many->memoryUsage(), 5 * few->memoryUsage());
  const std::size_t before = many->memoryUsage();
  many->update();
  many->update();
  EXPECT_LE(many->memoryUsage(), 2 * before);
}

// A program could not tell how a manager was made.
TYPED_TEST(FiberRules, OptionsAreKept) {
  const FiberManagerOptions options = ignoring(4, Report::kCapsules, 0.125);
  const auto manager = TypeParam::make(options);
  EXPECT_EQ(manager->options().report, Report::kCapsules);
  EXPECT_EQ(manager->options().ignored_neighbors, 4);
  EXPECT_EQ(manager->options().margin, 0.125);
  const FiberManagerOptions defaults = TypeParam::make()->options();
  EXPECT_EQ(defaults.report, Report::kVolumes);
  EXPECT_EQ(defaults.ignored_neighbors, 0);
  EXPECT_EQ(defaults.margin, 0);
}

// Cages would be computed anew although nothing moved: the paper's update would be pointless.
TYPED_TEST(Cascade, KeepsEveryCageWhenNothingMoved) {
  using S = typename TypeParam::Scalar;
  for (const NamedScene<S>& named : standardScenes<S>()) {
    SCOPED_TRACE(named.name);
    const auto manager = TypeParam::make();
    manager->registerObjects(named.scene.objects());
    manager->setup();
    const CascadeStatistics built = manager->cascadeStatistics();
    EXPECT_EQ(built.cages_kept, 0u);
    EXPECT_GT(built.cages_recomputed, 0u);
    for (int step = 0; step < 3; ++step) {
      manager->update();
      const CascadeStatistics updated = manager->cascadeStatistics();
      EXPECT_EQ(updated.cages_recomputed, 0u);
      EXPECT_EQ(updated.cages_kept, built.cages_recomputed);
    }
  }
}

// A cage would be counted twice or not at all.
TYPED_TEST(Cascade, EveryCageIsKeptOrRecomputed) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(9, 18, 155);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  const std::size_t cages = manager->cascadeStatistics().cages_recomputed;
  Random random(156);
  std::size_t recomputed = 0;
  for (const double distance : {1e-4, 1e-2, 0.1, 1.0}) {
    for (fcl::CollisionObject<S>* object : scene.objects()) jolt(*object, random, distance, 0.01);
    manager->update();
    const CascadeStatistics updated = manager->cascadeStatistics();
    EXPECT_EQ(updated.cages_kept + updated.cages_recomputed, cages);
    recomputed += updated.cages_recomputed;
  }
  EXPECT_GT(recomputed, 0u);
}

// A scene that travels would lose pairs, or make every cage anew.
TYPED_TEST(Cascade, FollowsAShiftOfEverything) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = curledScene<S>(100, 157);
  const auto manager = TypeParam::make();
  manager->registerObjects(scene.objects());
  manager->setup();
  // Coordinates on a grid that survives the shift without rounding.
  for (fcl::CollisionObject<S>* object : scene.objects()) {
    fcl::Transform3<S> pose = object->getTransform();
    for (int i = 0; i < 3; ++i) {
      pose.translation()[i] = std::round(pose.translation()[i] * S(1024)) / S(1024);
    }
    moveTo(*object, pose);
  }
  manager->update();
  for (int step = 0; step < 6; ++step) {
    for (fcl::CollisionObject<S>* object : scene.objects()) translate(*object, {4, -2, 0.5});
    manager->update();
    const PairOracle<S> oracle(scene.objects(), rulesOf<TypeParam>({}));
    EXPECT_TRUE(oracle.answersSelf(selfPairs(*manager), scene.objects()));
  }
}

// A lone segment would be taken for a cage, or an empty manager have some.
TYPED_TEST(Cascade, NoCageIsCountedWithoutSegments) {
  using S = typename TypeParam::Scalar;
  const auto manager = TypeParam::make();
  EXPECT_EQ(manager->cascadeStatistics().cages_recomputed, 0u);
  manager->setup();
  EXPECT_EQ(manager->cascadeStatistics().cages_recomputed, 0u);
  const Scene<S> scene = soupScene<S>(5, 1, 158);
  manager->registerObjects(scene.objects());
  manager->setup();
  EXPECT_GT(manager->cascadeStatistics().cages_recomputed, 0u);
}

}  // namespace
}  // namespace fcl_fibers::test
