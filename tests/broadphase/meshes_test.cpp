// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/managed.h"
#include "support/mesh_models.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

/// Strands among meshes of which some share their geometry, and a few other shapes.
template <typename S>
struct HairAndHeads {
  Scene<S> scene;
  std::vector<std::shared_ptr<fcl::CollisionGeometry<S>>> models;
  std::vector<fcl::CollisionObject<S>*> meshes;

  explicit HairAndHeads(std::uint64_t seed, std::size_t fibers = 10)
      : scene(strandScene<S>(fibers, 10, seed)) {
    Random random(seed + 1);
    const auto types = modelTypes<S>();
    models.push_back(makeModel<S>(types.front(), blob(0.4, 0.2, 9, 6)));
    models.push_back(makeModel<S>(types.back(), blob(0.25, 0.3, 7, 5)));
    for (std::size_t i = 0; i < 6; ++i) {
      meshes.push_back(scene.add(models[i % 2], somePose<S>(random, 0.7)));
      if (i == 1) scene.addSphere(random.inCube(0.6), 0.2);
      if (i == 3) {
        auto* box = scene.addBox({0, 0, 0}, Eigen::Quaterniond::Identity(), {0.5, 0.3, 0.2});
        moveTo(*box, somePose<S>(random, 0.5));
      }
    }
    scene.addHalfspace({0, 0.6, 0.8}, -0.5);
  }
};

std::vector<FiberManagerOptions> capsuleOptions() {
  std::vector<FiberManagerOptions> all(4);
  for (FiberManagerOptions& options : all) options.report = Report::kCapsules;
  all[1].margin = 0.03;
  all[1].ignored_neighbors = 1;
  all[2].threads = 3;
  all[2].bounds = Bounds::kShapes;
  all[3].margin = 0.1;
  all[3].threads = 3;
  return all;
}

MANAGER_SUITE(Meshes, FiberManagers);

// A head would count as one box.
TYPED_TEST(Meshes, CountByTheirTriangles) {
  using S = typename TypeParam::Scalar;
  HairAndHeads<S> made(901);
  for (const FiberManagerOptions& options : capsuleOptions()) {
    SCOPED_TRACE(describe(options));
    Managed<TypeParam> manager(options);
    manager.registerFibers(made.scene);
    EXPECT_TRUE(manager.answersSelf(50));
    manager.expectAnswersWith(manager.objects());
    EXPECT_FALSE(manager->movedSinceUpdate());
    Random random(902);
    jolt(made.scene.objects(), random, 0.05, 0.5);
    manager->update();
    EXPECT_TRUE(manager.answersSelf(50));
  }
}

// A model of another class would be read as the wrong one.
TYPED_TEST(Meshes, HaveAnyBoundingVolume) {
  using S = typename TypeParam::Scalar;
  for (const fcl::NODE_TYPE type : modelTypes<S>()) {
    SCOPED_TRACE(static_cast<int>(type));
    Scene<S> scene = strandScene<S>(6, 10, 903);
    scene.add(makeModel<S>(type, blob(0.5, 0.2, 8, 6)),
              makePose<S>(Eigen::Quaterniond(0.8, 0.6, 0, 0), {0.1, 0, 0.2}));
    const Managed<TypeParam> manager(scene, capsuleOptions()[0]);
    EXPECT_TRUE(manager.answersSelf(20));
    EXPECT_TRUE(manager.answersWith(manager.objects().back(), 5));
  }
}

// A mesh would be found where it is, or not follow.
TYPED_TEST(Meshes, CountWhereTheyWereReadLast) {
  using S = typename TypeParam::Scalar;
  HairAndHeads<S> made(904);
  Managed<TypeParam> manager(made.scene, capsuleOptions()[1]);
  Random random(905);
  for (int step = 0; step < 6; ++step) {
    auto* mesh = made.meshes[static_cast<std::size_t>(step)];
    jolt(*mesh, random, 0.3, 1);
    EXPECT_TRUE(manager->movedSinceUpdate());
    manager->update(mesh);
    EXPECT_FALSE(manager->movedSinceUpdate());
    EXPECT_TRUE(manager.answersSelf(20)) << "step " << step;
    manager.expectAnswersWith(made.meshes);
  }
  const auto before = selfPairs<S>(*manager);
  jolt(made.meshes, random, 0.3, 1);
  EXPECT_EQ(selfPairs<S>(*manager), before);
  manager->update();
  EXPECT_TRUE(manager.answersSelf(20));
  EXPECT_NE(selfPairs<S>(*manager), before);
}

// A face that moves would be searched as it was.
TYPED_TEST(Meshes, MayChangeTheirForm) {
  using S = typename TypeParam::Scalar;
  HairAndHeads<S> made(906);
  Managed<TypeParam> manager(made.scene, capsuleOptions()[1]);
  const auto clone = manager.clone(made.scene.objects());
  EXPECT_TRUE(clone.answersSelf(20));
  const auto before = selfPairs<S>(*clone);
  for (int step = 1; step < 5; ++step) {
    movePoints<S>(*made.models[0], [&](const Eigen::Vector3d& p) {
      return Eigen::Vector3d(p.x() * (1 + 0.1 * step), p.y(), p.z() - 0.05 * step * p.x());
    });
    // A box of the form before would count as one that the program has widened.
    for (auto* mesh : made.meshes) mesh->computeAABB();
    EXPECT_TRUE(manager->movedSinceUpdate());
    if (step % 2 == 0) {
      manager->update();
    } else {
      manager->update({made.meshes[0], made.meshes[2], made.meshes[4]});
    }
    EXPECT_FALSE(manager->movedSinceUpdate());
    EXPECT_TRUE(manager.answersSelf(20)) << "step " << step;
    manager.expectAnswersWith(made.meshes);
    EXPECT_EQ(selfPairs<S>(*clone), before) << "a clone has the old form until its update";
  }
  clone->update();
  EXPECT_TRUE(clone.answersSelf(20));
}

// Meshes of another manager would count by their boxes, or be missed.
TYPED_TEST(Meshes, OfAnotherManagerCountToo) {
  using S = typename TypeParam::Scalar;
  HairAndHeads<S> made(909, 5), other(910, 4);
  // FCL's trees do not hold unbounded objects well.
  auto others = other.scene.objects();
  others.pop_back();
  for (const FiberManagerOptions& options : {capsuleOptions()[0], capsuleOptions()[3]}) {
    SCOPED_TRACE(describe(options));
    const Managed<TypeParam> manager(made.scene, options);
    FiberManagerOptions its_options;
    for (const Report report : {Report::kVolumes, Report::kCapsules}) {
      its_options.report = report;
      its_options.margin = 0.05;
      for (auto& [name, its_manager] : makeEachManager<S>(its_options)) {
        SCOPED_TRACE(name + (report == Report::kVolumes ? ", kVolumes" : ", kCapsules"));
        its_manager->registerObjects(others);
        its_manager->setup();
        EXPECT_TRUE(manager.answersWith({*its_manager, others}, 30));
      }
    }
    const Managed<TypeParam> by_volumes(other.scene);
    EXPECT_TRUE(by_volumes.answersWith(manager, 30));
  }
}

// The first query with a mesh that nobody has registered reads it, on whichever thread it runs.
TYPED_TEST(Meshes, MayBeAskedAboutFromSeveralThreads) {
  using S = typename TypeParam::Scalar;
  HairAndHeads<S> made(915, 4), foreign(916, 1);
  const Managed<TypeParam> manager(made.scene, capsuleOptions()[1]);
  const auto ask = [&] {
    Calls<S> calls;
    for (auto* mesh : foreign.meshes) {
      for (const auto& call : pairsWith<S>(*manager, *mesh)) calls.push_back(call);
    }
    return calls;
  };
  std::vector<Calls<S>> found(4);
  std::vector<std::thread> threads;
  for (auto& calls : found) threads.emplace_back([&] { calls = ask(); });
  for (std::thread& thread : threads) thread.join();
  const auto expected = ask();
  EXPECT_GT(expected.size(), 20u);
  for (const auto& calls : found) EXPECT_EQ(calls, expected);
}

// The order would depend on threads or addresses.
TYPED_TEST(Meshes, PairsComeInOneOrder) {
  using S = typename TypeParam::Scalar;
  HairAndHeads<S> made(911, 30);
  const auto again = made.scene.reallocated(912);
  FiberManagerOptions options = capsuleOptions()[1];
  const Managed<TypeParam> manager(made.scene, options);
  const auto expected = manager.numbered(selfPairs<S>(*manager));
  for (const int threads : {2, 3}) {
    options.threads = threads;
    const Managed<TypeParam> other(again, options);
    EXPECT_EQ(other.numbered(selfPairs<S>(*other)), expected);
  }
}

// The nearest triangle would be missed, or every segment handed to the callback.
TYPED_TEST(Meshes, AreFoundByDistance) {
  using S = typename TypeParam::Scalar;
  Scene<S> strands = strandScene<S>(20, 10, 913), heads;
  const auto model = makeModel<S>(fcl::BV_OBBRSS, blob(0.5, 0.2, 9, 7));
  Random random(914);
  for (int i = 0; i < 5; ++i) {
    heads.add(model, makePose<S>(random.rotation(), {-2.5 - 0.5 * i, 1.5 * i, 0.2 * i}));
  }
  heads.addBox({5, 0, 0}, random.rotation(), {0.5, 0.3, 0.2});
  for (const Report report : {Report::kCapsules, Report::kVolumes}) {
    FiberManagerOptions its_options;
    its_options.report = report;
    const Managed<TypeParam> hair(strands, capsuleOptions()[0]), others(heads, its_options);
    EXPECT_GT(hair.expectNearest(others), 0);
    hair.expectEveryPair(others);
    const auto truth = hair.oracle(heads.objects());
    DistanceSearch<S> search(truth);
    search.run(*hair, *others);
    EXPECT_LT(search.calls.size(), strands.size() / 2);
  }
  Managed<TypeParam> both(strands, capsuleOptions()[0]);
  both.registerObjects(heads.objects());
  both.expectEveryPair();
  for (std::size_t i = 0; i < both.size(); i += 9) both.expectNearest(both[i]);
  for (auto* head : heads.objects()) both.expectNearest(head);
  const Managed<TypeParam> meshes(heads, capsuleOptions()[0]);
  EXPECT_GT(meshes.expectNearest(), 0);
  meshes.expectEveryPair();
  const Managed<TypeParam> hair(strands, capsuleOptions()[0]);
  EXPECT_GT(meshes.expectNearest(hair), 0);
}

}  // namespace
}  // namespace fcl_fibers::test
