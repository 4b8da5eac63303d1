// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstddef>
#include <utility>

#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "support/scene.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

template <typename S>
class Cages : public testing::Test {
 protected:
  static constexpr std::size_t kFibers = 8, kSegments = 16;

  Cages() : scene_(strandScene<S>(kFibers, kSegments, 41)), manager_(options()) {
    for (const auto& fiber : scene_.fibers()) manager_.registerFiber(fiber);
  }

  void move(std::size_t i, const Eigen::Vector3d& by) {
    auto& object = *scene_[i];
    object.setTranslation(object.getTranslation() + by.cast<S>());
    object.computeAABB();
  }

  Scene<S> scene_;
  WrappedSphereTreeCollisionManager<S> manager_;

 private:
  static FiberManagerOptions options() {
    FiberManagerOptions options;
    options.topology = Topology::kSuperThread;  // binary and balanced: the way to the root is known
    return options;
  }
};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Cages, Scalars, );

// A user who measures how much cascade verification saves would read counts of something else.
TYPED_TEST(Cages, WhoAsksIsToldHowManyWereRecomputed) {
  const std::size_t segments = this->kFibers * this->kSegments;
  EXPECT_EQ(this->manager_.cageCount(), segments - 1) << "inner nodes of a binary tree";
  EXPECT_EQ(this->manager_.cagesRecomputed(), segments - 1) << "there was none before";

  this->manager_.update();
  EXPECT_EQ(this->manager_.cagesRecomputed(), 0u) << "nothing has moved";

  // By a power of 2, so that the same bits move.
  for (std::size_t i = 0; i < segments; ++i) this->move(i, {64, 0, 0});
  this->manager_.update();
  EXPECT_EQ(this->manager_.cagesRecomputed(), 0u) << "all cages move along with their bases";

  this->move(5, {0, 1000, 0});
  this->manager_.update(this->scene_[5]);
  // Of the way to the root, the lowest cage keeps its two leaves as its basis.
  EXPECT_EQ(this->manager_.cagesRecomputed(), 6u) << "the way from one of 128 leaves to the root";
}

// A manager that is empty, or was moved from, has no tree to ask; one object has a cage of its own.
TYPED_TEST(Cages, AManagerWithoutATreeHasNone) {
  WrappedSphereTreeCollisionManager<TypeParam> manager;
  EXPECT_EQ(manager.cageCount(), 0u);
  EXPECT_EQ(manager.cagesRecomputed(), 0u);
  manager.registerObject(this->scene_[0]);
  EXPECT_EQ(manager.cageCount(), 1u);
  EXPECT_EQ(manager.cagesRecomputed(), 1u);
  const auto taken = std::move(manager);
  EXPECT_EQ(taken.cageCount(), 1u);
  EXPECT_EQ(manager.cageCount(), 0u);  // NOLINT: what is left is an empty manager
}

// Counts would depend on the threads that share an update.
TYPED_TEST(Cages, CountsDoNotDependOnTheNumberOfThreads) {
  Scene<TypeParam> scene = strandScene<TypeParam>(64, 128, 43);  // threads share 4,096 segments
  FiberManagerOptions options;
  options.threads = 4;
  WrappedSphereTreeCollisionManager<TypeParam> shared(options), alone;
  for (auto* manager : {&shared, &alone}) {
    for (const auto& fiber : scene.fibers()) manager->registerFiber(fiber);
    manager->setup();
  }
  Random random(42);
  jolt(scene.objects(), random, 0.1, 0.5);
  for (auto* manager : {&shared, &alone}) manager->update();
  EXPECT_EQ(shared.cageCount(), alone.cageCount());
  EXPECT_GT(alone.cagesRecomputed(), 0u);
  EXPECT_EQ(shared.cagesRecomputed(), alone.cagesRecomputed());
}

}  // namespace
}  // namespace fcl_fibers::test
