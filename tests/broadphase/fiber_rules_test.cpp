// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "support/managed.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

// What the fiber managers promise beyond FCL's contract: fibers, neighbours, margins.

FiberManagerOptions ignoring(int neighbors, Report report = Report::kVolumes, double margin = 0) {
  FiberManagerOptions options;
  options.ignored_neighbors = neighbors;
  options.report = report;
  options.margin = margin;
  return options;
}

std::vector<FiberManagerOptions> neighborOptions() {
  std::vector<FiberManagerOptions> all;
  for (const int neighbors : {0, 1, 2, 5, 1000}) {
    for (const Report report : {Report::kVolumes, Report::kCapsules}) {
      for (const double margin : {0.0, 0.03}) all.push_back(ignoring(neighbors, report, margin));
    }
  }
  for (const int neighbors : {0, 4}) {
    all.push_back(ignoring(neighbors));
    all.back().ignored_arc_length = 0.5;
  }
  return all;
}

MANAGER_SUITE(FiberRules, FiberManagers);

// A rope's ends that meet would be a contact; or segments be ignored by their number where the rule
// is a length.
TYPED_TEST(FiberRules, NeighborsByArcLengthAndAcrossTheSeam) {
  // A ring so thick that all touch all, its segments of lengths 1, 2, 1, 2, ...
  constexpr int kSegments = 12;
  std::vector<Eigen::Vector3d> points;
  const double perimeter = 1.5 * kSegments, radius = perimeter / (2 * 3.141592653589793);
  for (int i = 0; i <= kSegments; ++i) {
    const double arc = i % kSegments == 0 ? 0 : 1.5 * i - (i % 2 == 1 ? 0.5 : 0);
    const double angle = arc / radius;
    points.push_back({radius * std::cos(angle), radius * std::sin(angle), 0});
  }
  Scene<typename TypeParam::Scalar> scene;
  const auto ring = scene.addFiber(points, 2 * radius);
  for (const FiberEnds ends : {FiberEnds::kOpen, FiberEnds::kClosed}) {
    for (const int neighbors : {0, 2}) {
      for (const double length : {0.0, 2.5}) {
        for (const Report report : {Report::kVolumes, Report::kCapsules}) {
          FiberManagerOptions options = ignoring(neighbors, report);
          options.ignored_arc_length = length;
          SCOPED_TRACE(describe(options) + ", arc " + std::to_string(length) +
                       (ends == FiberEnds::kClosed ? ", closed" : ", open"));
          Managed<TypeParam> manager(options);
          manager.registerFiber(ring, ends);
          EXPECT_TRUE(manager.answersSelf(10));
          manager.expectEveryPair();
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
  for (const FiberManagerOptions& options : neighborOptions()) {
    for (const Scene<S>* scene : {&curled, &unequal}) {
      for (const FiberEnds ends : {FiberEnds::kOpen, FiberEnds::kClosed}) {
        SCOPED_TRACE(describe(options) + (ends == FiberEnds::kClosed ? ", closed" : ""));
        Managed<TypeParam> manager(options);
        for (const auto& fiber : scene->fibers()) manager.registerFiber(fiber, ends);
        const bool all_ignored = scene == &curled && options.ignored_neighbors == 1000;
        EXPECT_TRUE(manager.answersSelf(all_ignored ? 0 : 1));
        EXPECT_EQ(pairsWith(*manager, *manager), selfPairs(*manager));
        for (auto* object : manager.every(19)) EXPECT_TRUE(manager.answersWith(object, 0));
      }
    }
  }
}

// Fibers that were only guessed would lose pairs that the user asked for; or the way in which they
// are registered would change answers, not only speed.
TYPED_TEST(FiberRules, NeighborsAreNeverIgnoredInGuessedFibers) {
  const auto scene = unequalScene<typename TypeParam::Scalar>(143);
  const FiberManagerOptions options = ignoring(3);
  EXPECT_TRUE(Managed<TypeParam>(scene, options).answersSelf());
  Managed<TypeParam> one_by_one(options), mixed(options);
  one_by_one.registerEach(scene.objects());
  EXPECT_TRUE(one_by_one.answersSelf());

  // Some registered as fibers, some not, even where one goes on where the other ends.
  for (std::size_t f = 0; f < scene.fibers().size(); ++f) {
    const auto& fiber = scene.fibers()[f];
    const auto half = fiber.begin() + static_cast<std::ptrdiff_t>(fiber.size() / 2);
    if (f % 2 == 0) {
      mixed.registerObjects(fiber);
    } else {
      mixed.registerFiber({fiber.begin(), half});
      mixed.registerFiber({half, fiber.end()});
    }
    if (f == 5) mixed->setup();
  }
  mixed.registerFiber({});
  EXPECT_TRUE(mixed.answersSelf());
}

// Removing one segment would make neighbours of those that it kept apart.
TYPED_TEST(FiberRules, SegmentNumbersStayWhenOneIsUnregistered) {
  const auto scene = curledScene<typename TypeParam::Scalar>(60, 144);
  for (const int neighbors : {1, 2, 5}) {
    SCOPED_TRACE(neighbors);
    Managed<TypeParam> manager(ignoring(neighbors));
    manager.registerFiber(scene.objects());
    for (const std::size_t i : std::initializer_list<std::size_t>{59, 31, 30, 12, 0}) {
      manager.unregister(i);
      // The oracle counts along the fiber as it was given.
      EXPECT_TRUE(manager.answersSelf());
      EXPECT_EQ(manager->fiberSegment(scene[29]).number, 29u);
      EXPECT_EQ(manager->fiberSegment(scene[58]).number, 58u);
    }
    // One that comes back by itself is no part of the fiber any more.
    manager.registerObject(scene[30]);
    EXPECT_TRUE(manager.answersSelf());
    EXPECT_NE(manager->fiberSegment(scene[30]).fiber, manager->fiberSegment(scene[29]).fiber);
  }
}

// After many segments were taken out, numbers would be dealt anew and neighbours be mixed up.
TYPED_TEST(FiberRules, SegmentNumbersStayWhenManyAreUnregistered) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = curledScene<S>(200, 159);
  const Scene<S> second = curledScene<S>(120, 160);
  // One that is only guessed has no neighbours to ignore, and must not come to have some.
  const Scene<S> guessed = curledScene<S>(80, 166);
  Managed<TypeParam> manager(ignoring(3));
  manager.registerFiber(scene.objects());
  manager.registerFiber(second.objects());
  manager.registerObjects(guessed.objects());
  Random random(161);
  while (manager.size() > 60) {
    manager.unregister(random.below(manager.size()));
    if (manager.size() % 23 != 0) continue;
    EXPECT_TRUE(manager.answersSelf()) << manager.size() << " left";
  }
  const auto& left = manager.objects();
  for (std::size_t i = 0; i < scene.size(); ++i) {
    if (std::find(left.begin(), left.end(), scene[i]) == left.end()) continue;
    EXPECT_EQ(manager->fiberSegment(scene[i]).number, i);
  }
}

// Two fibers would have one number, if one of them is gone.
TYPED_TEST(FiberRules, FiberNumbersAreNotDealtTwice) {
  using S = typename TypeParam::Scalar;
  const Scene<S> few = strandScene<S>(13, 5, 167), many = strandScene<S>(30, 5, 168);
  Managed<TypeParam> manager(ignoring(1));
  std::size_t count = 0;
  const auto registerNext = [&](const auto& fiber, const char* when) {
    manager.registerFiber(fiber);
    EXPECT_EQ(manager->fiberSegment(fiber[3]).fiber, count) << when;
    ++count;
  };
  for (const auto& fiber : few.fibers()) registerNext(fiber, "at first");
  // So many that ids are dealt anew with the last of them.
  while (manager.size() > 0) manager.unregister(0);
  for (const auto& fiber : many.fibers()) registerNext(fiber, "all were gone");
  // And where some are left.
  while (manager.size() > 10) manager.unregister(0);
  EXPECT_EQ(manager->fiberSegment(many.fibers()[29][3]).fiber, count - 1) << "its number stays";
  registerNext(few.fibers()[0], "most are gone");
  manager.clear();
  count = 0;
  registerNext(many.fibers()[0], "after clear()");
}

// The neighbours of a segment that another manager holds as well would come back through that one.
TYPED_TEST(FiberRules, NeighborsAreIgnoredThroughAnotherManager) {
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = curledScene<S>(40, 147);
  for (const FiberManagerOptions& options : neighborOptions()) {
    Managed<TypeParam> manager(options);
    manager.registerFibers(scene);
    for (const auto& [name, other] : makeEachManager<S>(options)) {
      SCOPED_TRACE(name + ", " + describe(options));
      other->registerObject(scene[20]);
      EXPECT_TRUE(manager.answersWith({*other, {scene[20]}}, 0));
      manager.expectEveryPair({*other, {scene[20]}});
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
  Scene<S> scene;
  std::vector<int> groups;
};

// Fibers that never meet would be reported; or others be lost with them.
TYPED_TEST(FiberRules, FibersOfOneGroupAreNotReportedWithOneAnother) {
  const Grouped<typename TypeParam::Scalar> grouped(171);
  for (const int neighbors : {0, 2}) {
    for (const Report report : {Report::kVolumes, Report::kCapsules}) {
      for (const int threads : {1, 2}) {
        FiberManagerOptions options = ignoring(neighbors, report, 0.01);
        options.threads = threads;
        SCOPED_TRACE(describe(options) + ", threads " + std::to_string(threads));
        Managed<TypeParam> manager(options);
        manager.registerFibers(grouped.scene, grouped.groups);
        EXPECT_TRUE(manager.answersSelf());
        const auto pairs = selfPairs(*manager);
        EXPECT_EQ(pairsWith(*manager, *manager), pairs);
        manager.expectEveryPair();
        manager.expectAnswersWith(manager.every(17));
        for (auto* object : manager.every(17)) manager.expectEveryPair(object);
      }
    }
  }
}

// A group would come together again through a manager that has an object of it as well.
TYPED_TEST(FiberRules, GroupsHoldThroughAnotherManager) {
  using S = typename TypeParam::Scalar;
  const Grouped<S> grouped(172);
  // Of one group: others that are in both would meet twice, as (a, b) and (b, a).
  const auto& shared = grouped.scene.fibers()[5];
  const FiberManagerOptions options = ignoring(0, Report::kCapsules, 0.01);
  Managed<TypeParam> manager(options);
  manager.registerFibers(grouped.scene, grouped.groups);
  for (const auto& [name, other] : makeEachManager<S>(options)) {
    SCOPED_TRACE(name);
    other->registerObjects(shared);
    EXPECT_TRUE(manager.answersWith({*other, shared}));
    manager.expectEveryPair({*other, shared});
  }
  // What the other manager calls a group is its own affair.
  const Grouped<S> strangers(173);
  Managed<TypeParam> same_numbers(options);
  same_numbers.registerFibers(strangers.scene, strangers.groups);
  EXPECT_TRUE(manager.answersWith(same_numbers));
}

// The narrow phase would be asked for every pair whose boxes overlap, however far the capsules are.
TYPED_TEST(FiberRules, NoCapsulesAreVisitedThatAreFartherThanTheNearest) {
  using S = typename TypeParam::Scalar;
  Scene<S> scene;
  for (int i = 0; i < 12; ++i) {
    const Eigen::Vector3d from(0.1 * i, -0.1 * i, 0);
    scene.addCapsule(from, from + Eigen::Vector3d(4, 4, 4), 0.01);
  }
  std::size_t calls = 0;
  const auto visit = [](fcl::CollisionObject<S>*, fcl::CollisionObject<S>*, void* data, S& least) {
    ++*static_cast<std::size_t*>(data);
    least = S(0.1);
    return false;
  };
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    const Managed<TypeParam> manager(scene, ignoring(0, report));
    calls = 0;
    manager->distance(&calls, visit);
    EXPECT_EQ(calls, 1u);
    calls = 0;
    manager->distance(scene[5], &calls, visit);
    EXPECT_EQ(calls, 1u);
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
      const double radius = random.between(0, size / 4);
      fcl::CollisionObject<S>* partner =
          scene.addCapsule(scene[i]->getTransform(), radius, random.between(0, size));
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
    EXPECT_TRUE(Managed<TypeParam>(scene, options).answersSelf());
    // And between two managers, each with its own place.
    const Scene<S> far_part = soupScene<S>(30, 0.5, 165, {Eigen::Vector3d(offset + 7, 0, 0), 3});
    const auto middle = scene.objects().begin() + static_cast<std::ptrdiff_t>(count);
    const Managed<TypeParam> mine({scene.objects().begin(), middle}, options);
    Managed<TypeParam> theirs(options);
    theirs.registerObjects({middle, scene.objects().end()});
    theirs.registerObjects(far_part.objects());
    EXPECT_TRUE(mine.answersWith(theirs));
    theirs.expectAnswersWith(mine.every(3));
  }
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
  EXPECT_EQ(manager->fiberSegment(single[0]).number, 0u);
  for (std::size_t f = 0; f < scene.fibers().size(); ++f) {
    for (std::size_t i = 0; i < scene.fibers()[f].size(); ++i) {
      const FiberSegment place = manager->fiberSegment(scene.fibers()[f][i]);
      EXPECT_EQ(place.fiber, f + 1);
      EXPECT_EQ(place.number, i);
    }
  }
  EXPECT_EQ(manager->fiberSegment(single[1]).fiber, scene.fibers().size() + 1);
  EXPECT_EQ(manager->fiberSegment(single[1]).number, 0u);
  // The same after the tree was built.
  manager->setup();
  EXPECT_EQ(manager->fiberSegment(scene.fibers()[1][7]).fiber, 2u);
  EXPECT_EQ(manager->fiberSegment(scene.fibers()[1][7]).number, 7u);
  EXPECT_THROW(manager->fiberSegment(nullptr), std::invalid_argument);
  const Scene<S> unknown = soupScene<S>(1, 0.3, 153);
  EXPECT_THROW(manager->fiberSegment(unknown[0]), std::invalid_argument);
}

// Capsules of one fiber would be numbered as many, or those of many as one.
TYPED_TEST(FiberRules, CapsulesThatShareAnEndBecomeAFiber) {
  using S = typename TypeParam::Scalar;
  const double ulp = static_cast<double>(std::numeric_limits<S>::epsilon());  // of 1
  // Along z, from 0, each 0.25 long. No coordinate is larger than x.
  const auto add = [](Scene<S>& scene, int place, double x) {
    return scene.addCapsule(
        makePose<S>(Eigen::Quaterniond::Identity(), {x, 0, 0.25 * place + 0.125}), 0.01, 0.25);
  };
  for (const int apart : {0, 4, 5}) {
    Scene<S> scene;
    // The next one, the one before these two, one beside it, and one after a sphere.
    std::vector<fcl::CollisionObject<S>*> capsules = {
        add(scene, 1, 1), add(scene, 2, 1 + apart * ulp), add(scene, 1, 1), add(scene, 1, 1)};
    scene.addSphere({1, 0, 0}, 0.1);
    capsules.push_back(add(scene, 1, 1));
    const auto manager = TypeParam::make();
    manager->registerObjects(scene.objects());
    std::vector<std::pair<std::size_t, std::size_t>> places;
    for (const auto* capsule : capsules) {
      const FiberSegment place = manager->fiberSegment(capsule);
      places.emplace_back(place.fiber, place.number);
    }
    const std::vector<std::pair<std::size_t, std::size_t>> joined = {
        {0, 0}, {0, 1}, {0, 2}, {0, 3}, {2, 0}};
    const std::vector<std::pair<std::size_t, std::size_t>> apart_all = {
        {0, 0}, {1, 0}, {2, 0}, {2, 1}, {4, 0}};
    EXPECT_EQ(places, apart <= 4 ? joined : apart_all) << apart;
  }
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

}  // namespace
}  // namespace fcl_fibers::test
