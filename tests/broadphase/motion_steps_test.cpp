// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstddef>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/halfspace.h>

#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "broadphase/moving_program.h"
#include "support/mesh_models.h"
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
    program.read();
    program.judge(selfPairs(program.manager), {}, nullptr, what);
  };
  registerBalls(200);
  program.manager.setup();
  program.read();
  registerBalls(10);
  judge("ten are young");
  program.beginStep();
  program.update({program.order[205]}, 0.5);
  registerBalls(15);
  judge("too many were young");
  program.beginStep();
  registerBalls(8);
  auto* const young = program.order[225];
  program.update({young}, 0.5);
  program.update({young}, 0.5);
  judge("others are young");
  program.beginStep();
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

/// A capsule that falls from z = 1 to z = -1 past one that rests at 0.
template <typename S>
struct Fall {
  using Objects = std::vector<fcl::CollisionObject<S>*>;

  explicit Fall(const FiberManagerOptions& options = movingOptions()) : manager(options) {
    falling.place(0, 0, 1);
    manager.registerFiber({&resting.object});
    manager.registerFiber({&falling.object});
  }
  std::size_t pairCount() const { return selfPairs(manager).size(); }

  OneCapsule<S> resting, falling;
  LayeredAABBTreeCollisionManager<S> manager;
};

// A query, an update or a distance would begin or end a step that the program has not asked for.
TYPED_TEST(ManagerMotionSteps, AStepBeginsAndEndsWhenTheProgramSays) {
  using S = TypeParam;
  Fall<S> fall;
  auto& manager = fall.manager;
  manager.beginStep();  // before the first reading
  EXPECT_EQ(fall.pairCount(), 0u);
  fall.falling.place(0, 1, 0.5);
  manager.update();
  manager.distance(nullptr, [](auto*, auto*, void*, S&) { return true; });
  EXPECT_EQ(fall.pairCount(), 0u);
  fall.falling.place(0, 0, -1);
  manager.update(&fall.falling.object);
  EXPECT_EQ(fall.pairCount(), 1u) << "both updates are one step";
  EXPECT_EQ(fall.pairCount(), 1u) << "the same step";
  manager.update(&fall.resting.object);
  manager.update(typename Fall<S>::Objects());
  manager.update();
  EXPECT_EQ(fall.pairCount(), 1u) << "an update ends no step";
  manager.beginStep();
  EXPECT_EQ(fall.pairCount(), 0u) << "a new step, in which all rest";
  manager.beginStep();
  fall.falling.place(0, 0, 1);
  manager.update(&fall.falling.object);
  EXPECT_EQ(fall.pairCount(), 1u);
  manager.endStep();
  EXPECT_EQ(fall.pairCount(), 0u);
  fall.falling.place(0, 0, -1);
  manager.update();
  EXPECT_EQ(fall.pairCount(), 0u) << "without a step all rest";
  manager.endStep();  // there is none
  EXPECT_EQ(fall.pairCount(), 0u);
  manager.beginStep();
  fall.falling.place(0, 0, 1);
  manager.update();
  manager.clear();
  manager.registerFiber({&fall.resting.object});
  manager.registerFiber({&fall.falling.object});
  fall.falling.place(0, 0, -1);
  EXPECT_EQ(fall.pairCount(), 0u);
  fall.falling.place(0, 0, 1);
  manager.update();
  EXPECT_EQ(fall.pairCount(), 0u) << "no step is left";
}

// The lists of what has moved would outlive what they name. Only the sanitized build is sure to see
// that.
TYPED_TEST(ManagerMotionSteps, EndWithClearBesideTheTreeToo) {
  using S = TypeParam;
  const auto model = makeModel<S>(modelTypes<S>().front(), blob(1, 0.2, 8, 5));
  const std::shared_ptr<fcl::CollisionGeometry<S>> shapes[] = {
      model, std::make_shared<fcl::Box<S>>(S(1), S(1), S(1)),
      std::make_shared<fcl::Halfspace<S>>(0, 0, 1, 0)};
  LayeredAABBTreeCollisionManager<S> manager(movingOptions());
  OneCapsule<S> capsule;
  for (int round = 0; round < 3; ++round) {
    std::vector<std::unique_ptr<fcl::CollisionObject<S>>> objects;
    for (const auto& shape : shapes) {
      objects.push_back(std::make_unique<fcl::CollisionObject<S>>(shape));
      objects.back()->setTranslation({0, 0, -9});
      objects.back()->computeAABB();
      manager.registerObject(objects.back().get());
    }
    capsule.place(0, 0, 9);
    manager.registerObject(&capsule.object);
    manager.beginStep();
    capsule.place(0, 0, -20);
    for (const auto& object : objects) object->setTranslation({1, 0, -9});
    manager.update();
    EXPECT_FALSE(selfPairs(manager).empty()) << "the capsule meets the half-space";
    manager.clear();
    EXPECT_TRUE(manager.empty());
  }
  EXPECT_EQ(model.use_count(), 2) << "the model, and its name in the list of shapes";
}

// A step that cannot be would be ignored in silence, or change what a query looks at.
TYPED_TEST(ManagerMotionSteps, AreRefusedWithoutMotionAndWithinAQuery) {
  using S = TypeParam;
  FiberManagerOptions options = movingOptions();
  options.motion = false;
  Fall<S> still(options);
  EXPECT_THROW(still.manager.beginStep(), std::invalid_argument);
  EXPECT_THROW(still.manager.endStep(), std::invalid_argument);

  Fall<S> fall;
  fall.falling.place(0, 0, 0);
  fall.manager.update();
  int calls = 0;
  const auto within = [&] {
    EXPECT_THROW(fall.manager.beginStep(), std::invalid_argument);
    EXPECT_THROW(fall.manager.endStep(), std::invalid_argument);
    ++calls;
  };
  using Within = decltype(within);
  auto* data = const_cast<void*>(static_cast<const void*>(&within));
  fall.manager.collide(data, [](auto*, auto*, void* cdata) {
    (*static_cast<const Within*>(cdata))();
    return false;
  });
  EXPECT_EQ(calls, 1);

  // An object that cannot be read is named, and no step begins.
  OneCapsule<S> broken;
  fall.manager.registerFiber({&broken.object});
  broken.place(0, 0, std::numeric_limits<double>::quiet_NaN());
  EXPECT_THROW(fall.manager.beginStep(), std::invalid_argument);
  broken.place(0, 5, 0);
  fall.falling.place(0, 0, 1);
  fall.manager.update();
  fall.falling.place(0, 0, -1);
  fall.manager.update();
  EXPECT_EQ(fall.pairCount(), 0u);
}

// An error, a clone, or an object that comes or goes would lose or invent a motion.
TYPED_TEST(ManagerMotionSteps, LastOverErrorsAndWhatComesAndGoes) {
  using S = TypeParam;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Fall<S> fall;
  auto& manager = fall.manager;
  manager.beginStep();
  fall.falling.place(0, 0, nan);
  EXPECT_THROW(manager.update(), std::invalid_argument);
  EXPECT_THROW(fall.pairCount(), std::invalid_argument);
  EXPECT_THROW(manager.beginStep(), std::invalid_argument);
  fall.falling.place(0, 0, -1);
  manager.update();
  EXPECT_EQ(fall.pairCount(), 1u) << "the step lasts until an update succeeds";
  for (const double z : {1, -1}) {
    OneCapsule<S> other_resting, other_falling;
    other_falling.place(0, 0, z);
    const auto clone = manager.clone({&other_resting.object, &other_falling.object});
    EXPECT_TRUE(selfPairs(*clone).empty()) << "a clone has no step, from either end of this one";
  }

  // What comes later starts where it is first read, whatever is built.
  std::vector<std::unique_ptr<OneCapsule<S>>> more;
  for (int i = 0; i < 60; ++i) {
    more.push_back(std::make_unique<OneCapsule<S>>());
    more.back()->place(i, 5, 0);
    manager.registerObject(&more.back()->object);
  }
  EXPECT_EQ(fall.pairCount(), 1u) << "what comes rests, and what was there moves";
  more[0]->place(0, -5, 0);
  manager.update(&more[0]->object);
  EXPECT_EQ(fall.pairCount(), 3u) << "it passes both";
  more[0]->place(0, 5, 0);
  manager.update(&more[0]->object);
  EXPECT_EQ(fall.pairCount(), 1u) << "it is back where it started";

  // A build that fails in a query must not lose the start.
  for (int i = 0; i < 60; ++i) {
    more.push_back(std::make_unique<OneCapsule<S>>());
    more.back()->place(i, 6, 0);
    manager.registerObject(&more.back()->object);
  }
  fall.falling.place(0, 0, nan);
  EXPECT_THROW(fall.pairCount(), std::invalid_argument);
  fall.falling.place(0, 0, -1);
  manager.update();
  EXPECT_EQ(fall.pairCount(), 1u);
  manager.unregisterObject(&fall.falling.object);
  EXPECT_EQ(fall.pairCount(), 0u) << "it has left";
  manager.registerFiber({&fall.falling.object});
  EXPECT_EQ(fall.pairCount(), 0u) << "it has come anew";
  fall.falling.place(0, 0, 1);
  manager.update();
  EXPECT_EQ(fall.pairCount(), 1u);
}

// A step of one manager would begin, end or hide that of another.
TYPED_TEST(ManagerMotionSteps, EachManagerHasItsOwn) {
  using S = TypeParam;
  OneCapsule<S> a, b;
  a.place(0, 0, 1);
  b.place(0, 0, 0);
  LayeredAABBTreeCollisionManager<S> first(movingOptions()), second(movingOptions());
  FiberManagerOptions options = movingOptions();
  options.motion = false;
  LayeredAABBTreeCollisionManager<S> still(options);
  first.registerFiber({&a.object});
  second.registerFiber({&b.object});
  still.registerFiber({&b.object});
  first.beginStep();
  second.setup();
  still.setup();
  a.place(0, 0, -1);
  first.update();
  EXPECT_EQ(pairsWith(first, second).size(), 1u);
  EXPECT_EQ(pairsWith(second, first).size(), 1u);
  EXPECT_EQ(pairsWith(first, still).size(), 1u);
  EXPECT_EQ(pairsWith(still, first).size(), 0u) << "it answers for the end";
  // Both fall, side by side.
  second.beginStep();
  first.endStep();
  a.place(0, 0, 1);
  first.update();
  first.beginStep();
  a.place(0, 0, -1);
  b.place(0, 0, -2);
  first.update();
  second.update();
  EXPECT_EQ(pairsWith(first, second).size(), 0u);
  first.endStep();
  EXPECT_EQ(pairsWith(first, second).size(), 1u) << "the other passes one that rests";
  second.endStep();
  EXPECT_EQ(pairsWith(first, second).size(), 0u);
}

}  // namespace
}  // namespace fcl_fibers::test
