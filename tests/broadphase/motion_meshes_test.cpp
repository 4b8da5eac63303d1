// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl_fibers/impact_collector.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "broadphase/moving_program.h"
#include "support/mesh_models.h"
#include "support/scalars.h"
#include "support/scene.h"
#include "support/small_stack.h"

// Meshes that move in a manager with FiberManagerOptions::motion. ManagerDifferential has random
// ones against brute force.

namespace fcl_fibers::test {
namespace {

template <typename S>
using Object = fcl::CollisionObject<S>;

template <typename S>
class ManagerMotionMeshes : public testing::Test {};
TYPED_TEST_SUITE(ManagerMotionMeshes, Scalars, ScalarName);

/// A small capsule at a place.
template <typename S>
std::unique_ptr<Object<S>> capsuleAt(const Eigen::Vector3d& place) {
  return std::make_unique<Object<S>>(std::make_shared<fcl::Capsule<S>>(S(0.01), S(0.02)),
                                     makePose<S>(Eigen::Quaterniond::Identity(), place));
}

// What is inside a solid would be lost, or come twice when it leaves, or a new surface would sweep.
TYPED_TEST(ManagerMotionMeshes, MayBeSolidRestOrChangeTheirTriangles) {
  using S = TypeParam;
  const auto type = modelTypes<S>().front();
  LayeredAABBTreeCollisionManager<S> manager(movingOptions());
  Object<S> head(makeModel<S>(type, blob(1, 0, 12, 9)));
  const auto inside = capsuleAt<S>({0.1, 0, 0}), passing = capsuleAt<S>({3, 0.1, 0.1});
  manager.registerFiber({inside.get()});
  manager.registerFiber({passing.get()});
  manager.registerObstacle(&head, ObstacleOptions{/*solid=*/true});
  const Calls<S> with_inside{{inside.get(), &head}};
  const Calls<S> with_both{{inside.get(), &head}, {passing.get(), &head}};
  const auto place = [](Object<S>& object, double x) {
    object.setTransform(makePose<S>(Eigen::Quaterniond::Identity(), {x, 0.1, 0.1}));
  };
  EXPECT_EQ(selfPairs(manager), with_inside);

  // All rest, one leaves the solid, and one passes through it.
  manager.beginStep();
  manager.update();
  EXPECT_EQ(selfPairs(manager), with_inside);
  place(*inside, 0.1);
  place(*passing, -3);
  manager.update();
  EXPECT_EQ(selfPairs(manager), with_both);
  ImpactCollector<S> collector(manager);
  manager.collide(&collector, &ImpactCollector<S>::callback);
  ASSERT_EQ(collector.impacts().size(), 2u);
  for (const auto& impact : collector.impacts()) {
    EXPECT_TRUE(impact.has_time);
    EXPECT_TRUE(impact.is_exact);
    EXPECT_GE(impact.triangle, 0);
  }
  EXPECT_EQ(collector.impacts()[0].time, 0);
  EXPECT_LT(collector.impacts()[0].distance, -0.3) << "it is not moved out of the solid";
  EXPECT_NEAR(collector.impacts()[1].time, 2.0 / 6, 0.02);
  EXPECT_NEAR(collector.impacts()[1].normal[0], -1, 0.2);
  manager.beginStep();
  place(*inside, 2);
  manager.update(inside.get());
  EXPECT_EQ(selfPairs(manager), with_inside);
  manager.beginStep();
  manager.update(inside.get());
  EXPECT_TRUE(selfPairs(manager).empty());

  // The mesh moves over a capsule that rests, and so it does if named alone.
  head.setTranslation(fcl::Vector3<S>(S(5), 0, 0));
  manager.update(&head);
  EXPECT_EQ(selfPairs(manager), with_inside);
  manager.beginStep();
  EXPECT_TRUE(selfPairs(manager).empty()) << "it has arrived";

  // With other triangles it has no way from where it was.
  head.setTranslation(fcl::Vector3<S>(S(-1), 0, 0));
  auto* const triangles =
      arraysOf(const_cast<fcl::CollisionGeometry<S>&>(*head.collisionGeometry())).triangles;
  std::swap(triangles[0], triangles[1]);
  manager.update();
  EXPECT_TRUE(selfPairs(manager).empty());

  manager.beginStep();

  // An object that has moved since the update is where it was read, in each query.
  place(*inside, -1);
  EXPECT_TRUE(pairsWith(manager, *inside).empty());
  TimedContact contact;
  EXPECT_FALSE(manager.findImpact(inside.get(), &head, nullptr, contact));
  manager.update();
  ASSERT_EQ(pairsWith(manager, *inside).size(), 1u);
  EXPECT_TRUE(manager.findImpact(&head, inside.get(), nullptr, contact));
}

// A hair that starts in the head would be pushed out on its far side.
TYPED_TEST(ManagerMotionMeshes, WhatCrossesASolidTouchesTheTriangleThatItCrosses) {
  using S = TypeParam;
  LayeredAABBTreeCollisionManager<S> manager(movingOptions());
  Object<S> head(makeModel<S>(modelTypes<S>().front(), blob(1, 0, 12, 9)));
  manager.registerObstacle(&head, ObstacleOptions{/*solid=*/true});
  // From x = -0.5 to 1.5, and the same with its ends exchanged.
  std::vector<std::unique_ptr<Object<S>>> hairs;
  for (const double angle : {0.5, -0.5}) {
    const Eigen::Quaterniond turn(
        Eigen::AngleAxisd(angle * 3.141592653589793, Eigen::Vector3d::UnitY()));
    hairs.push_back(std::make_unique<Object<S>>(std::make_shared<fcl::Capsule<S>>(S(0.01), S(2)),
                                                makePose<S>(turn, {0.5, 0.1, 0.1})));
    manager.registerFiber({hairs.back().get()});
  }
  manager.setup();
  for (const auto& hair : hairs) {
    TimedContact contact;
    ASSERT_TRUE(manager.findImpact(hair.get(), &head, nullptr, contact));
    EXPECT_EQ(contact.time, 0);
    EXPECT_LT(contact.normal[0], -0.8) << "it is moved in";
    std::vector<MeshContact> contacts;
    ASSERT_TRUE(manager.findMeshContacts(hair.get(), &head, 0, contacts));
    ASSERT_FALSE(contacts.empty());
    EXPECT_EQ(contact.triangle, contacts[0].triangle);
    EXPECT_EQ(contact.distance, contacts[0].distance);
  }
}

// A query that is not `collide` would fix the end of a step that goes on.
TYPED_TEST(ManagerMotionMeshes, MoveOnInOneStepAfterAQuestion) {
  using S = TypeParam;
  const auto capsule = capsuleAt<S>({0, 0, 0});
  Object<S> head(makeModel<S>(modelTypes<S>().front(), blob(0.3, 0, 8, 6)));
  LayeredAABBTreeCollisionManager<S> manager(movingOptions());
  manager.registerFiber({capsule.get()});
  manager.registerObject(&head);
  const auto moveTo = [&](double x) {
    head.setTranslation(fcl::Vector3<S>(static_cast<S>(x), 0, 0));
    manager.update();
  };
  moveTo(2);
  manager.beginStep();
  TimedContact contact;
  moveTo(1);
  EXPECT_FALSE(manager.findImpact(&head, capsule.get(), nullptr, contact));
  moveTo(-2);
  EXPECT_EQ(selfPairs(manager).size(), 1u);
  ASSERT_TRUE(manager.findImpact(&head, capsule.get(), nullptr, contact));
  EXPECT_NEAR(contact.time, (2 - 0.3) / 4, 0.02);
}

// Programs whose threads have little stack would crash.
TYPED_TEST(ManagerMotionMeshes, NeedLittleStack) {
  using S = TypeParam;
  Random random(961);
  Scene<S> scene;
  for (int f = 0; f < 50; ++f) {
    std::vector<Eigen::Vector3d> points{random.inCube(0.7)};
    for (int i = 0; i < 40; ++i) points.push_back(points.back() + random.inCube(0.05));
    scene.addFiber(points, 0.002);
  }
  auto* head = scene.add(makeModel<S>(modelTypes<S>().front(), blob(0.5, 0.1, 80, 60)),
                         makePose<S>(Eigen::Quaterniond::Identity(), {0, 0, 0}));
  for (const int threads : {1, 2}) {
    runOnSmallStack([&] {
      LayeredAABBTreeCollisionManager<S> manager(movingOptions(threads));
      for (const auto& fiber : scene.fibers()) manager.registerFiber(fiber);
      manager.registerObstacle(head, ObstacleOptions{/*solid=*/true});
      manager.beginStep();
      EXPECT_GT(selfPairs<S>(manager).size(), 500u);
      jolt(scene.objects(), random, 0.02, 0.02);
      manager.update();
      ImpactCollector<S> impacts(manager);
      manager.collide(&impacts, impacts.callback);
      EXPECT_GT(impacts.impacts().size(), 500u);
      manager.update(scene[0]);
      EXPECT_GT(pairsWith<S>(manager, *head).size(), 100u);
      std::vector<MeshContact> contacts;
      for (auto* object : scene.fibers()[0]) manager.findMeshContacts(object, head, 0, contacts);
      struct Least {
        static bool visit(Object<S>*, Object<S>*, void*, S& dist) {
          dist = std::min(dist, S(0.001));
          return false;
        }
      };
      manager.distance(nullptr, &Least::visit);
      manager.distance(head, nullptr, &Least::visit);
    });
  }
}

// Queries in two frames take turns with the trees of a mesh, and one would use what another gave
// up.
TYPED_TEST(ManagerMotionMeshes, ThreadsShareAMesh) {
  using S = TypeParam;
  Random random(3);
  Scene<S> hair, heads;
  for (int i = 0; i < 30; ++i) hair.addCapsule(somePose<S>(random, 0.8), 0.01, 0.2);
  for (const fcl::NODE_TYPE type : {fcl::BV_AABB, fcl::BV_OBBRSS}) {
    heads.add(makeModel<S>(type, blob(0.15, 0.2, 6, 4)), somePose<S>(random, 0.5));
  }
  LayeredAABBTreeCollisionManager<S> fibers(movingOptions()), obstacles(movingOptions());
  for (auto* object : hair.objects()) fibers.registerFiber({object});
  obstacles.registerObjects(heads.objects());
  const auto ask = [&](int which) {
    const auto& asked = which % 2 == 0 ? fibers : obstacles;
    auto& other = which % 2 == 0 ? obstacles : fibers;
    ImpactCollector<S> collector(asked, &other);
    asked.collide(&other, &collector, &ImpactCollector<S>::callback);
    std::vector<double> times;
    for (const auto& impact : collector.impacts()) times.push_back(impact.time);
    return times;
  };
  fibers.beginStep();
  obstacles.beginStep();
  jolt(hair.objects(), random, 0.3, 0);
  jolt(heads.objects(), random, 0.5, 3);
  fibers.update();
  obstacles.update();
  std::array<std::vector<double>, 4> found;
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < 4; ++i) {
    threads.emplace_back([&, i] {
      for (int k = 0; k < 10; ++k) found[i] = ask(static_cast<int>(i));
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_FALSE(found[0].empty());
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(found[i], ask(static_cast<int>(i)));
}

// A mesh would pass through the objects of a manager whose tree has no motion.
TYPED_TEST(ManagerMotionMeshes, PassOverManagersWithoutMotion) {
  using S = TypeParam;
  FiberManagerOptions resting;
  resting.report = Report::kCapsules;
  WrappedSphereTreeCollisionManager<S> spheres(resting);
  LayeredAABBTreeCollisionManager<S> boxes(resting), obstacles(movingOptions());
  resting.report = Report::kVolumes;
  LayeredAABBTreeCollisionManager<S> volumes(resting);
  const auto capsule = capsuleAt<S>({0, 0, 0});
  Object<S> head(makeModel<S>(modelTypes<S>().front(), blob(0.3, 0, 8, 6)));
  head.setTranslation(fcl::Vector3<S>(S(2), 0, 0));
  obstacles.registerObject(&head);
  obstacles.setup();
  for (LayeredAABBTreeCollisionManager<S>* manager : {&boxes, &volumes}) {
    manager->registerFiber({capsule.get()});
  }
  spheres.registerFiber({capsule.get()});
  obstacles.beginStep();
  head.setTranslation(fcl::Vector3<S>(S(-2), 0, 0));
  obstacles.update();
  EXPECT_EQ(pairsWith(obstacles, boxes).size(), 1u);
  EXPECT_EQ(pairsWith(obstacles, spheres).size(), 1u);
  EXPECT_EQ(pairsWith(obstacles, volumes).size(), 1u);
  EXPECT_EQ(pairsWith(obstacles, *capsule).size(), 1u);
  TimedContact contact;
  ASSERT_TRUE(obstacles.findImpact(&head, capsule.get(), &spheres, contact));
  EXPECT_NEAR(contact.time, (2 - 0.3) / 4, 0.02);
  EXPECT_TRUE(pairsWith(boxes, obstacles).empty()) << "it asks about the end";
}

}  // namespace
}  // namespace fcl_fibers::test
