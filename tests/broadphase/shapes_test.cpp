// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cylinder.h>

#include "support/managed.h"
#include "support/scene_generators.h"
#include "support/text_of.h"

namespace fcl_fibers::test {
namespace {

using NumberPairs = std::set<std::pair<std::size_t, std::size_t>>;

/// Of this length along its z axis: a cylinder, a box or a capsule.
template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> makeSegment(std::size_t kind, double thickness,
                                                       double length) {
  const S r = static_cast<S>(thickness), l = static_cast<S>(length);
  if (kind % 3 == 0) return std::make_shared<fcl::Cylinder<S>>(r, l);
  if (kind % 3 == 1) return std::make_shared<fcl::Box<S>>(2 * r, r, l);
  return std::make_shared<fcl::Capsule<S>>(r, l);
}

MANAGER_SUITE(ShapeFibers, FiberManagers);

// Turned shapes would have other pairs after computeAABB(), those of FCL's cubes.
TYPED_TEST(ShapeFibers, TurnedShapesHaveTheSamePairsAfterComputeAABB) {
  using S = typename TypeParam::Scalar;
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0.03)) {
    SCOPED_TRACE(describe(options));
    Scene<S> scene;
    addShapes(scene, 120, 0.4, 411);
    Random random(412);
    for (auto* object : scene.objects()) {
      object->setTransform(somePose<S>(random, 1));
    }
    Managed<TypeParam> manager(scene, options);
    const NumberPairs without = numbersOf(selfPairs<S>(*manager), scene.objects());
    for (auto* object : scene.objects()) object->computeAABB();
    EXPECT_FALSE(manager->movedSinceUpdate());
    manager->update();
    EXPECT_EQ(numbersOf(selfPairs<S>(*manager), scene.objects()), without);
    std::size_t in_fcl = 0;
    for (std::size_t i = 0; i < scene.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        in_fcl += scene[i]->getAABB().overlap(scene[j]->getAABB());
      }
    }
    EXPECT_TRUE(without.size() < in_fcl || TypeParam::kVolume == LeafVolume::kSphere);
  }
}

// Rods of cylinders and flat ribbons of boxes would meet themselves at every joint.
TYPED_TEST(ShapeFibers, HaveTheRulesOfFibers) {
  using S = typename TypeParam::Scalar;
  const double lengths[] = {1, 2, 1, 3, 0.5, 2, 1, 1, 4, 0.25, 2, 1};
  constexpr std::size_t kCount = std::size(lengths);
  for (FiberManagerOptions options : optionsToTest<TypeParam>(0)) {
    for (const Bounds bounds : {Bounds::kShapes, Bounds::kShapesAndMargins, Bounds::kObjects}) {
      for (int rule = 0; rule < 8; ++rule) {
        options.bounds = bounds;
        options.ignored_neighbors = rule % 2 == 0 ? 2 : 0;
        options.ignored_arc_length = rule / 2 % 2 == 0 ? 3.125 : 0;
        const bool is_closed = rule / 4 == 0;
        SCOPED_TRACE(describe(options) + ", rule " + std::to_string(rule));
        // So thick that all touch all.
        Random random(414);
        Scene<S> scene;
        for (std::size_t i = 0; i < kCount; ++i) {
          scene.add(makeSegment<S>(i, 40, lengths[i]), somePose<S>(random, 4));
        }
        NumberPairs expected;
        const auto areNeighbors = [&](std::size_t from, std::size_t to) {
          double between = 0;
          for (std::size_t steps = 1; steps < kCount; ++steps) {
            if (++from == kCount && !is_closed) return false;
            from %= kCount;
            if (from == to) {
              return static_cast<int>(steps) <= options.ignored_neighbors ||
                     (options.ignored_arc_length > 0 && between <= options.ignored_arc_length);
            }
            between += lengths[from];
          }
          return false;
        };
        for (std::size_t i = 0; i < kCount; ++i) {
          for (std::size_t j = i + 1; j < kCount; ++j) {
            if (!areNeighbors(i, j) && !areNeighbors(j, i)) expected.insert({i, j});
          }
        }
        const auto ends = is_closed ? FiberEnds::kClosed : FiberEnds::kOpen;
        const auto manager = TypeParam::make(options);
        manager->registerFiber(scene.objects(), ends);
        EXPECT_EQ(numbersOf(selfPairs<S>(*manager), scene.objects()), expected);
        EXPECT_EQ(manager->fiberSegment(scene[7]).number, 7u);
        jolt(scene.objects(), random, 1, 1);
        manager->update();
        EXPECT_EQ(numbersOf(selfPairs<S>(*manager), scene.objects()), expected);

        const auto group = TypeParam::make(options);
        group->registerFiber(scene.objects(), ends, FiberGroup{3});
        EXPECT_TRUE(selfPairs<S>(*group).empty());
        const auto loose = TypeParam::make(options);
        loose->registerObjects(scene.objects());
        EXPECT_EQ(selfPairs<S>(*loose).size(), kCount * (kCount - 1) / 2);
      }
    }
  }
}

// A clone would have a mesh for a neighbour, or refuse what the rules do not concern.
TYPED_TEST(ShapeFibers, ACloneKeepsWhatIsASegment) {
  using S = typename TypeParam::Scalar;
  FiberManagerOptions options;
  options.ignored_neighbors = 1;
  Random random(415);
  Scene<S> scene, copies;
  for (std::size_t i = 0; i < 6; ++i) {
    for (auto* s : {&scene, &copies}) {
      s->add(makeSegment<S>(s == &scene ? i : i + 1, 4, 1), somePose<S>(random, 1));
    }
  }
  Managed<TypeParam> original(options);
  auto all = scene.objects();
  original->registerFiber({all.begin(), all.begin() + 4});
  original->registerObjects({all.begin() + 4, all.end()});
  const NumberPairs expected = numbersOf(selfPairs<S>(*original), all);
  EXPECT_EQ(expected.size(), 15u - 3u);
  auto managed = copies.objects();
  EXPECT_EQ(numbersOf(selfPairs<S>(*cloneOf<S>(*original, managed)), managed), expected);
  // What is in no fiber may be anything.
  managed[5] = copies.addMesh({0, 0, 0}, 4);
  EXPECT_EQ(numbersOf(selfPairs<S>(*cloneOf<S>(*original, managed)), managed), expected);
  for (const std::size_t i : {0u, 3u}) {
    managed = copies.objects();
    managed.resize(6);
    managed[i] = copies.addSphere({0, 0, 0}, 1);
    expectRefusal([&] { cloneOf<S>(*original, managed); },
                  "object " + std::to_string(i) + " is not a capsule, cylinder or box");
  }
}

// An arc would be NaN long, and nobody a neighbour from there on.
TYPED_TEST(ShapeFibers, BadLengthsAreRefused) {
  using S = typename TypeParam::Scalar;
  for (const Bounds bounds : {Bounds::kShapes, Bounds::kShapesAndMargins, Bounds::kObjects}) {
    for (const S bad : {S(-1), std::numeric_limits<S>::quiet_NaN()}) {
      for (std::size_t kind = 0; kind < 3; ++kind) {
        FiberManagerOptions options;
        options.bounds = bounds;
        options.ignored_arc_length = 1;
        const auto shape = makeSegment<S>(kind, 0.1, 1);
        Scene<S> scene;
        scene.add(shape, fcl::Transform3<S>::Identity());
        if (kind == 0) static_cast<fcl::Cylinder<S>&>(*shape).lz = bad;
        if (kind == 1) static_cast<fcl::Box<S>&>(*shape).side[2] = bad;
        if (kind == 2) static_cast<fcl::Capsule<S>&>(*shape).lz = bad;
        const auto manager = TypeParam::make(options);
        EXPECT_THROW(manager->registerFiber(scene.objects()), std::invalid_argument);
        EXPECT_TRUE(manager->empty());
      }
    }
  }
}

// A cylinder or a box that has moved since the update would be taken from where it was.
TYPED_TEST(ShapeFibers, ThatHaveMovedCountNoLessThanAtTheLastUpdate) {
  using S = typename TypeParam::Scalar;
  for (const Bounds bounds : {Bounds::kShapes, Bounds::kShapesAndMargins}) {
    for (FiberManagerOptions options : optionsToTest<TypeParam>(0.02)) {
      options.bounds = bounds;
      SCOPED_TRACE(describe(options));
      Random random(421);
      Scene<S> scene, others;
      for (Scene<S>* s : {&scene, &others}) {
        for (std::size_t i = 0; i < 45; ++i) {
          s->add(makeSegment<S>(i, 0.03, 0.5), somePose<S>(random, 0.5));
        }
      }
      // A manager in the frame of which the other's shapes are read.
      FiberManagerOptions its_options = options;
      its_options.margin = 0.01;
      const Managed<TypeParam> manager(scene, options), other(others, its_options);
      for (int step = 0; step < 3; ++step) {
        SCOPED_TRACE(step);
        EXPECT_TRUE(manager.answersSelf(20));
        EXPECT_TRUE(manager.answersWith(other, 20));
        EXPECT_TRUE(other.answersWith(manager, 20));
        const auto truth = manager.oracle(others.objects()),
                   its_truth = other.oracle(scene.objects());
        // Some stay, some turn where they are, and some go away.
        for (Scene<S>* s : {&scene, &others}) {
          for (std::size_t i = 0; i < s->size(); ++i) {
            if (i % 4 == 1) jolt(*(*s)[i], random, 0, 1);
            if (i % 4 == 2) translate(*(*s)[i], {50, 0, 0});
            if (i % 4 == 3) jolt(*(*s)[i], random, 0.05, 0.3);
          }
        }
        EXPECT_TRUE(manager->movedSinceUpdate());
        const auto self = asSet(selfPairs(*manager)), with = asSet(pairsWith(*manager, *other)),
                   back = asSet(pairsWith(*other, *manager));
        std::size_t kept = 0;
        for (std::size_t i = 0; i < scene.size(); ++i) {
          for (std::size_t j = i + 1; j < scene.size(); ++j) {
            if (truth.verdict(scene[i], scene[j]) != Verdict::kMust) continue;
            EXPECT_TRUE(self.count({scene[i], scene[j]})) << i << ", " << j;
            ++kept;
          }
          // What the other manager counts by its volume is read as it is now.
          if (options.report == Report::kVolumes) continue;
          for (std::size_t j = 0; j < others.size(); ++j) {
            if (truth.verdict(scene[i], others[j]) == Verdict::kMust) {
              EXPECT_TRUE(with.count({scene[i], others[j]})) << i << ", " << j;
            }
            if (its_truth.verdict(others[j], scene[i]) == Verdict::kMust) {
              EXPECT_TRUE(back.count({others[j], scene[i]})) << i << ", " << j;
            }
          }
        }
        EXPECT_GT(kept, 20u);
        // Where they are back they count as they are, and after an update.
        for (Scene<S>* s : {&scene, &others}) {
          for (std::size_t i = 2; i < s->size(); i += 4) translate(*(*s)[i], {-50, 0, 0});
        }
        manager->update();
        other->update();
        EXPECT_FALSE(manager->movedSinceUpdate());
      }
    }
  }
}

// A turn that leaves the box as it was would not be seen, and what it touched be lost.
TYPED_TEST(ShapeFibers, ATurnThatLeavesTheBoxIsAMotion) {
  using S = typename TypeParam::Scalar;
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  const auto turnBy = [](double angle, const Eigen::Vector3d& axis) {
    return makePose<S>(Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis)), {0.5, 0.25, 0});
  };
  const auto half_turn = [](int axis) {
    fcl::Transform3<S> pose = fcl::Transform3<S>::Identity();
    for (int i = 0; i < 3; ++i) pose.linear()(i, i) = i == axis ? S(1) : S(-1);
    pose.translation() = fcl::Vector3<S>(S(0.5), S(0.25), 0);
    return pose;
  };
  for (const Bounds bounds : {Bounds::kShapes, Bounds::kShapesAndMargins}) {
    options.bounds = bounds;
    for (const std::size_t kind : {0u, 1u}) {
      for (int axis = 0; axis < 3; ++axis) {
        SCOPED_TRACE(testing::Message() << "kind " << kind << ", axis " << axis);
        for (const double angle : {0.25, 0.5, 1.0}) {
          const Eigen::Vector3d about = Eigen::Vector3d::Unit(axis);
          const auto from = turnBy(angle, about), to = turnBy(-angle, about);
          Scene<S> scene;
          auto* shape = scene.add(makeSegment<S>(kind, 0.0625, 1), from);
          // At a corner of the box around it, which one of the two poses reaches.
          const fcl::Vector3<S> tip = from * fcl::Vector3<S>(0, 0, S(0.5));
          auto* capsule = scene.addCapsule(
              makePose<S>(Eigen::Quaterniond::Identity(), tip.template cast<double>()), 0.03125,
              0.0625);
          const Managed<TypeParam> manager(scene, options);
          EXPECT_EQ(selfPairs(*manager).size(), 1u);
          shape->setTransform(to);
          EXPECT_TRUE(manager->movedSinceUpdate());
          EXPECT_EQ(selfPairs(*manager).size(), 1u) << "lost before the update";
          EXPECT_EQ((pairsWith(*manager, *capsule)).size(), 1u) << "lost before the update";
          manager->update();
          EXPECT_FALSE(manager->movedSinceUpdate());
          EXPECT_TRUE(manager.answersSelf(0));
          EXPECT_EQ(selfPairs(*manager).size(), axis == 2 ? 1u : 0u);
        }
        Scene<S> scene;
        auto* shape = scene.add(makeSegment<S>(kind, 0.0625, 1), turnBy(0, {0, 0, 1}));
        scene.addSphere({0.5, 0.25, 0}, 0.1);
        const Managed<TypeParam> manager(scene, options);
        EXPECT_EQ(selfPairs(*manager).size(), 1u);
        shape->setTransform(half_turn(axis));
        EXPECT_TRUE(manager->movedSinceUpdate());
        EXPECT_EQ(selfPairs(*manager).size(), 1u);
        manager->update(shape);
        EXPECT_FALSE(manager->movedSinceUpdate());
        EXPECT_TRUE(manager.answersSelf());
      }
    }
  }
}

// The margin of a box would be said to be none.
TYPED_TEST(ShapeFibers, MarginsOfShapesAreTold) {
  using S = typename TypeParam::Scalar;
  Managed<TypeParam> manager;
  Scene<S> scene;
  Random random(416);
  addShapes(scene, 12, 0.5, 417);
  scene.addHalfspace({0, 0, 1}, 0);
  scene.addPlane({0, 1, 0}, 0);
  const double rounding = 128 * double{std::numeric_limits<S>::epsilon()};
  for (auto* object : scene.objects()) {
    EXPECT_EQ(manager->margin(object), 0);
    grow(aabbOf(*object), 0.125);
    EXPECT_NEAR(manager->margin(object), 0.125, rounding);
  }
}

}  // namespace
}  // namespace fcl_fibers::test
