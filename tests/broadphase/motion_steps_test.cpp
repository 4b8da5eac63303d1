// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstddef>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "broadphase/moving_program.h"
#include "support/scalars.h"

// When a step of a manager with FiberManagerOptions::motion begins, and what it remembers.

namespace fcl_fibers::test {
namespace {

template <typename S>
class ManagerMotionSteps : public testing::Test {};
TYPED_TEST_SUITE(ManagerMotionSteps, Scalars, ScalarName);

// A step would begin with the poses of objects that another index has by now, and that this one has
// no room for.
TYPED_TEST(ManagerMotionSteps, AYoungIndexForgetsTheObjectsBeforeIt) {
  using S = TypeParam;
  Program<S> program(movingOptions(), 21);
  const auto registerBalls = [&](int count) {
    for (int i = 0; i < count; ++i) program.registerBall();
  };
  const auto judge = [&](const char* what) {
    program.see();
    program.judge(selfPairs(program.manager), {}, nullptr, what);
  };
  registerBalls(200);
  program.manager.setup();
  program.read();
  registerBalls(10);
  judge("ten are young");
  program.update({program.order[205]}, 0.5);
  registerBalls(15);
  judge("too many were young");
  registerBalls(8);
  auto* const young = program.order[225];
  program.update({young}, 0.5);
  program.update({young}, 0.5);
  judge("others are young");
  program.update({young, program.order[0]}, 0.5);
  judge("they have moved");
}

// Motion would be ignored in silence.
TYPED_TEST(ManagerMotionSteps, OptionsThatHaveNoMotionAreRefused) {
  using S = TypeParam;
  FiberManagerOptions options = movingOptions();
  EXPECT_THROW(WrappedSphereTreeCollisionManager<S>{options}, std::invalid_argument);
  options.report = Report::kVolumes;
  EXPECT_THROW(LayeredAABBTreeCollisionManager<S>{options}, std::invalid_argument);
}

// An error, a distance query or a clone would lose or invent a step.
TYPED_TEST(ManagerMotionSteps, AStepBeginsWhereTheLastCollisionQueryLooked) {
  using S = TypeParam;
  LayeredAABBTreeCollisionManager<S> manager(movingOptions());
  OneCapsule<S> resting, falling;
  falling.place(0, 0, 1);
  manager.registerFiber({&resting.object});
  manager.registerFiber({&falling.object});
  EXPECT_TRUE(selfPairs(manager).empty());
  OneCapsule<S> other_resting, other_falling;
  other_falling.place(0, 0, -1);
  const auto clone = manager.clone({&other_resting.object, &other_falling.object});
  EXPECT_TRUE(selfPairs(*clone).empty()) << "a clone does not start where the original is";
  // Neither these updates nor the distance begin a step of their own.
  falling.place(0, 1, 0.5);
  manager.update();
  const auto stop = [](fcl::CollisionObject<S>*, fcl::CollisionObject<S>*, void*, S&) {
    return true;
  };
  manager.distance(nullptr, stop);
  falling.place(0, 0, std::numeric_limits<double>::quiet_NaN());
  EXPECT_THROW(manager.update(), std::invalid_argument);
  EXPECT_THROW(selfPairs(manager), std::invalid_argument);
  falling.place(0, 0, -1);
  manager.update(&falling.object);
  EXPECT_EQ(selfPairs(manager).size(), 1u);
  EXPECT_EQ(selfPairs(manager).size(), 1u) << "the same step";
  manager.update(std::vector<fcl::CollisionObject<S>*>());
  EXPECT_TRUE(selfPairs(manager).empty()) << "a new step, in which all rest";

  // Nor does a query that is refused.
  falling.place(0, 0, 1);
  manager.update();
  EXPECT_EQ(selfPairs(manager).size(), 1u);
  falling.place(0, 0, -1);
  manager.update();
  OneCapsule<S> broken;
  LayeredAABBTreeCollisionManager<S> other(movingOptions());
  other.registerFiber({&broken.object});
  fcl::DynamicAABBTreeCollisionManager<S> fcls;
  fcls.registerObject(&broken.object);
  broken.place(0, 0, std::numeric_limits<double>::quiet_NaN());
  EXPECT_THROW(pairsWith(manager, broken.object), std::invalid_argument);
  EXPECT_THROW(pairsWith(manager, other), std::invalid_argument);
  EXPECT_THROW(pairsWith(manager, fcls), std::invalid_argument);
  manager.update(std::vector<fcl::CollisionObject<S>*>());
  EXPECT_EQ(selfPairs(manager).size(), 1u) << "the step is the one that no query has looked at";

  // A build that fails in a query must not lose what the query before saw.
  std::vector<std::unique_ptr<OneCapsule<S>>> more;
  for (int i = 0; i < 60; ++i) {
    more.push_back(std::make_unique<OneCapsule<S>>());
    more.back()->place(i, 5, 0);
    manager.registerObject(&more.back()->object);
  }
  falling.place(0, 0, std::numeric_limits<double>::quiet_NaN());
  EXPECT_THROW(selfPairs(manager), std::invalid_argument);
  falling.place(0, 0, 1);
  manager.update();
  EXPECT_EQ(selfPairs(manager).size(), 1u);
  manager.unregisterObject(&falling.object);
  manager.registerFiber({&falling.object});
  EXPECT_TRUE(selfPairs(manager).empty()) << "it has come anew";
}

}  // namespace
}  // namespace fcl_fibers::test
