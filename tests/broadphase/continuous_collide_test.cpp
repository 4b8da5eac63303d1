// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/halfspace.h>

#include "support/moving_pairs.h"
#include "support/moving_scene.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

template <typename S>
class ContinuousCollide : public testing::Test {};
TYPED_TEST_SUITE(ContinuousCollide, Scalars, ScalarName);

// Objects that meet on their way would pass through each other, or those be reported that do not
// meet at any one time.
TYPED_TEST(ContinuousCollide, TranslationsMeetExactlyIfTheirBoxesDo) {
  using S = TypeParam;
  for (const FiberOptions& options : assortedContinuousOptions()) {
    MovingScene<S> scene, others;
    fill(scene, 150, {MotionKind::kTranslation}, 811);
    fill(others, 40, {MotionKind::kTranslation}, 812);
    Manager<S> manager(options), other(options);
    Foreign<S> foreign;
    manager.registerObjects(scene.objects());
    for (auto* object : others.objects()) {
      other.registerObject(object);
      foreign.registerObject(object);
    }
    expectPairs<S>(collide(manager), scene.objects(), nullptr, options.margin, true);
    using Base = typename Manager<S>::Base;
    expectPairs<S>(collide<S, Base*>(manager, &other), scene.objects(), &others.objects(),
                   options.margin, true);
    expectPairs<S>(collide<S, Base*>(manager, &foreign), scene.objects(), &others.objects(),
                   options.margin, true);
    Calls<S> one_by_one;
    for (auto* object : others.objects()) {
      for (const auto& call : collide(manager, object)) one_by_one.push_back(call);
    }
    expectPairs<S>(one_by_one, scene.objects(), &others.objects(), options.margin, true);
    // A managed object does not meet itself.
    const std::vector<Moving<S>*> one = {scene[7]};
    expectPairs<S>(collide(manager, one[0]), scene.objects(), &one, options.margin, true);
    EXPECT_EQ((collide<S, Base*>(manager, &manager)), collide(manager));
  }
}

// Objects that turn or go round a bend would be missed, or bounded without any sense.
TYPED_TEST(ContinuousCollide, MotionsOfEveryKindMeet) {
  using S = TypeParam;
  for (const FiberOptions& options : assortedContinuousOptions()) {
    MovingScene<S> scene;
    fill(scene, 80, motionKinds<S>(), 813, 0.05);
    Manager<S> manager(options);
    manager.registerObjects(scene.objects());
    expectPairs<S>(collide(manager), scene.objects(), nullptr, options.margin, false);
  }
}

// What is fast would pass through what is thin, as it does when the start or the end is looked at;
// and a boundary that one reaches after the other has left would be a contact.
TYPED_TEST(ContinuousCollide, WhatPassesIsFoundAndWhatFollowsIsNot) {
  using S = TypeParam;
  MovingScene<S> scene;
  Moving<S>* bullet = scene.addSphere({-1e3, 0, 0}, {1e3, 0, 0}, 1e-3);
  Moving<S>* target = scene.addSphere({0, 0, 0}, {0, 0, 0}, 1e-2);
  Moving<S>* crossing = scene.addSphere({0, -1e3, 0}, {0, 1e3, 0}, 1e-3);
  scene.addSphere({500, -400, 0}, {500, -1e3, 0},
                  1);  // on the way of the bullet, never at its time
  scene.addSphere({-1e3 - 5, 0, 0}, {1e3 - 5, 0, 0}, 1);  // follows the bullet
  Manager<S> manager;
  manager.registerObjects(scene.objects());
  Calls<S> calls = collide(manager);
  const auto by_place = [&](const auto& call) {
    return std::make_pair(scene.indexOf(call.first), scene.indexOf(call.second));
  };
  std::sort(calls.begin(), calls.end(),
            [&](const auto& p, const auto& q) { return by_place(p) < by_place(q); });
  // The follower meets what stands on its way, too.
  const Calls<S> expected = {
      {bullet, target}, {bullet, crossing}, {target, crossing}, {target, scene[4]}};
  EXPECT_EQ(calls, expected);
}

/// A capsule or sphere of a scene at its start and end.
template <typename S>
struct CapsuleLine {
  Point a[2], b[2];
  Real radius;

  explicit CapsuleLine(const Moving<S>& object) {
    const auto& shape = *object.collisionGeometry();
    const bool is_sphere = shape.getNodeType() == fcl::GEOM_SPHERE;
    const Real half = is_sphere ? 0 : Real(static_cast<const fcl::Capsule<S>&>(shape).lz) / 2;
    radius = is_sphere ? Real(static_cast<const fcl::Sphere<S>&>(shape).radius)
                       : Real(static_cast<const fcl::Capsule<S>&>(shape).radius);
    for (const int end : {0, 1}) {
      const fcl::CollisionObject<S> posed = poseAt(object, end);
      const Point axis = posed.getRotation().col(2).template cast<Real>();
      const Point middle = posed.getTranslation().template cast<Real>();
      a[end] = middle - half * axis;
      b[end] = middle + half * axis;
    }
  }
  Real distanceAt(Real t, const CapsuleLine& other) const {
    const auto at = [t](const Point(&p)[2]) { return Point((1 - t) * p[0] + t * p[1]); };
    return segmentDistance(at(a), at(b), at(other.a), at(other.b)) - radius - other.radius;
  }
  Real path() const { return (a[1] - a[0]).norm(); }
};

// A program that asks for what touches would get all boxes that meet, or miss a touch.
TYPED_TEST(ContinuousCollide, CapsulesThatMoveAlongLinesMeetIfTheyTouch) {
  using S = TypeParam;
  using Base = typename Manager<S>::Base;
  Random random(824);
  MovingScene<S> scene;
  for (int i = 0; i < 60; ++i) {
    std::shared_ptr<fcl::CollisionGeometry<S>> shape;
    if (i % 3 == 0) shape = std::make_shared<fcl::Sphere<S>>(S(0.1));
    if (i % 3 != 0) shape = std::make_shared<fcl::Capsule<S>>(S(0.02), S(0.7));
    // Some matrices have drifted.
    const double drift = i % 4 == 0 ? 0.999e-3 : 0;
    scene.add(shape,
              makeMotion<S>(MotionKind::kTranslation, random.inCube(0.4), 0.5, 0, random, drift));
  }
  const std::vector<Moving<S>*> first(scene.objects().begin(), scene.objects().begin() + 40),
      rest(scene.objects().begin() + 40, scene.objects().end());
  // How near each pair comes, at some of many times.
  constexpr int kTimes = 100;
  std::vector<CapsuleLine<S>> lines;
  for (auto* object : scene.objects()) lines.emplace_back(*object);
  std::map<std::pair<std::size_t, std::size_t>, Real> nearest;
  for (std::size_t a = 0; a < first.size(); ++a) {
    for (std::size_t b = a + 1; b < scene.size(); ++b) {
      Real least = std::numeric_limits<Real>::max();
      for (int k = 0; k <= kTimes; ++k) {
        least = std::min(least, lines[a].distanceAt(Real(k) / kTimes, lines[b]));
      }
      nearest[{a, b}] = least;
    }
  }
  for (FiberOptions options : assortedContinuousOptions()) {
    options.report = Report::kCapsules;
    FiberOptions plain = options;
    plain.report = Report::kVolumes;
    Manager<S> manager(options), same(options), volumes(plain);
    FiberOptions others = options;
    others.topology =
        options.topology == Topology::kBundle ? Topology::kSuperThread : Topology::kBundle;
    Manager<S> turned(others);
    manager.registerObjects(first);
    for (Manager<S>* other : {&same, &volumes, &turned}) other->registerObjects(rest);
    std::vector<Calls<S>> answers(4, collide(manager));
    for (auto* object : rest) {
      for (const auto& call : collide(manager, object)) answers[0].push_back(call);
    }
    Manager<S>* partners[] = {&same, &volumes, &turned};
    for (std::size_t i = 0; i < 3; ++i) {
      for (const auto& call : collide<S, Base*>(manager, partners[i])) {
        answers[i + 1].push_back(call);
      }
    }
    std::vector<std::set<std::pair<std::size_t, std::size_t>>> found(4);
    for (std::size_t i = 0; i < 4; ++i) {
      for (const auto& [a, b] : answers[i]) {
        EXPECT_TRUE(found[i].emplace(scene.indexOf(a), scene.indexOf(b)).second);
      }
    }
    std::size_t due = 0;
    for (const auto& [pair, distance] : nearest) {
      const auto [a, b] = pair;
      const Real least = distance - Real(options.margin);
      const Real between = (lines[a].path() + lines[b].path()) / (2 * kTimes) + 1e-4L;
      due += least < 0 ? 1 : 0;
      for (const auto& pairs : found) {
        const bool is_found = pairs.count(pair) > 0;
        if (least < -1e-4L) {
          EXPECT_TRUE(is_found) << a << ", " << b;
        } else if (least > between) {
          EXPECT_FALSE(is_found) << a << ", " << b;
        }
      }
    }
    EXPECT_GT(due, 20u);
  }
}

// What comes from far outside would be lost in the unit of what is small.
TEST(ContinuousCollideDouble, WhatPassesFromTheEndOfTheNumbersIsFound) {
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    FiberOptions options;
    options.report = report;
    MovingScene<double> scene;
    Random random(825);
    for (int i = 0; i < 50; ++i) {
      scene.addSphere(random.inCube(1e-6), random.inCube(1e-6), 1e-7);
    }
    Manager<double> manager(options);
    manager.registerObjects(scene.objects());
    MovingScene<double> others;
    constexpr double kFar = 5e307;
    EXPECT_EQ(collide(manager, others.addSphere({kFar, 0, 0}, {-kFar, 0, 0}, 1)).size(), 50u);
    EXPECT_EQ(collide(manager, others.addSphere({0, 0, 0}, {0, 0, 0}, kFar)).size(), 50u);
    EXPECT_EQ(collide(manager, others.addSphere({kFar, 0, 0}, {kFar, 1, 0}, 1)).size(), 0u);
    // The same if the tree has been built without it.
    dynamic_cast<fcl::TranslationMotion<double>&>(*scene[7]->getMotion()) =
        dynamic_cast<const fcl::TranslationMotion<double>&>(*others[0]->getMotion());
    manager.update(scene[7]);
    EXPECT_EQ(collide(manager, scene[7]).size(), 49u);
  }
}

// Things would fall through the floor, or be in contact with it wherever they are.
TYPED_TEST(ContinuousCollide, AFloorMeetsWhatFallsOnIt) {
  using S = TypeParam;
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    FiberOptions options;
    options.report = report;
    MovingScene<S> scene;
    const auto half_space = std::make_shared<fcl::Halfspace<S>>(S(0), S(0), S(1), S(0));
    half_space->computeLocalAABB();
    Moving<S>* floor = scene.add(half_space, scene.translation({0, 0, 0}, {0, 0, 1}));
    Moving<S>* falling = scene.addSphere({1, 2, 50}, {3, 4, -50}, 0.1);
    scene.addSphere({0, 0, 3}, {0, 0, 2}, 0.1);
    Moving<S>* caught = scene.addSphere({1e3, 1e3, 0.5}, {1e3, 1e3, 0.5}, 0.1);
    Moving<S>* under = scene.addSphere({5, 5, -1e3}, {5, 5, -1e3}, 0.1);
    Manager<S> manager(options);
    manager.registerObjects(scene.objects());
    Calls<S> calls = collide(manager);
    std::sort(calls.begin(), calls.end(), [&](const auto& p, const auto& q) {
      return scene.indexOf(p.second) < scene.indexOf(q.second);
    });
    EXPECT_EQ(calls, (Calls<S>{{floor, falling}, {floor, caught}, {floor, under}}));
    EXPECT_EQ(collide(manager, floor).size(), 3u);
  }
}

// Adjacent segments of a fiber would always be in contact.
TYPED_TEST(ContinuousCollide, NeighborsAndGroupsAreLeftOut) {
  using S = TypeParam;
  const auto fiberAt = [](MovingScene<S>& scene, double y) {
    std::vector<Moving<S>*> fiber;
    for (int i = 0; i < 6; ++i) {
      fcl::Transform3<S> from = fcl::Transform3<S>::Identity(), to = from;
      from.linear() =
          Eigen::AngleAxis<S>(S(std::acos(0.0)), fcl::Vector3<S>::UnitY()).toRotationMatrix();
      to.linear() = from.linear();
      from.translation() = fcl::Vector3<S>(S(i), S(y), 0);
      to.translation() = fcl::Vector3<S>(S(i), S(-y), 0);
      fiber.push_back(scene.add(std::make_shared<fcl::Capsule<S>>(S(0.1), S(1)),
                                std::make_shared<fcl::TranslationMotion<S>>(from, to)));
    }
    return fiber;
  };
  for (const int ignored : {0, 1, 2}) {
    for (const int group : {0, 1}) {
      for (const bool by_length : {false, true}) {
        MovingScene<S> scene;
        FiberOptions options;
        (by_length ? options.ignored_arc_length : options.margin) = 0;
        options.ignored_neighbors = by_length ? 0 : ignored;
        if (by_length && ignored > 0) options.ignored_arc_length = ignored - 0.5;
        Manager<S> manager(options);
        const auto first = fiberAt(scene, 1), second = fiberAt(scene, -1);
        manager.registerFiber(first, FiberEnds::kOpen, FiberGroup{group});
        manager.registerFiber(second, FiberEnds::kOpen, FiberGroup{group});
        EXPECT_EQ(manager.fiberSegment(second[4]).fiber, 1u);
        EXPECT_EQ(manager.fiberSegment(second[4]).segment, 4u);
        // Segments touch the next ones of their fiber, and three of the other as they pass.
        const std::size_t within = group == 1 || ignored > 0 ? 0 : 10, across = group == 1 ? 0 : 16;
        EXPECT_EQ(collide(manager).size(), within + across) << ignored << by_length << group;
        EXPECT_EQ(collide(manager, first[0]).size(),
                  (group == 1 ? 0 : 2) + (within == 0 ? 0u : 1u));
      }
    }
  }
  // A ring.
  MovingScene<S> scene;
  FiberOptions options;
  options.ignored_neighbors = 1;
  std::vector<Moving<S>*> ring;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d place(i == 1 || i == 2 ? 1 : 0, i > 1 ? 1 : 0, 0);
    ring.push_back(scene.add(std::make_shared<fcl::Box<S>>(S(1.1), S(1.1), S(1)),
                             MovingScene<S>::translation(place, place)));
  }
  Manager<S> manager(options);
  manager.registerFiber(ring, FiberEnds::kClosed);
  EXPECT_EQ(collide(manager).size(), 2u);  // the diagonals
}

}  // namespace
}  // namespace fcl_fibers::test
