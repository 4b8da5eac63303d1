// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "arrays/array_fibers.h"
#include "support/allocation_faults.h"
#include "support/managers_under_test.h"
#include "support/pair_queries.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

/// What is said of memory is what `operator new` gave since then, to a twentieth.
void expectBytes(std::size_t said, std::size_t live_before) {
  const auto live = static_cast<double>(liveBytes() - live_before);
  EXPECT_NEAR(static_cast<double>(said), live, 0.05 * live);
}

TEST(TreeMemory, IsWhatTheHeapGave) {
  // If this fails, a program that counts on memoryUsage() runs out of memory.
  constexpr int kFibers = 150, kPoints = 60;
  Random random(188);
  Assembly<double> fibers;
  for (int f = 0; f < kFibers; ++f) {
    Eigen::Vector3d point = random.inCube(2);
    for (int i = 0; i < kPoints; ++i) {
      fibers.addPoint({point.x(), point.y(), point.z()}, 0.02);
      point += 0.1 * random.direction();
    }
    fibers.endFiber();
  }
  const std::vector<std::uint8_t> closed(kFibers, 1);
  std::vector<std::int32_t> groups;
  for (int f = 0; f < kFibers; ++f) groups.push_back(f % 5);
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    for (FiberTreeOptions options : allKinds(report)) {
      for (const int threads : {1, 2}) {
        SCOPED_TRACE(threads);
        options.threads = threads;
        FiberArrays<double> arrays = fibers.view();
        if (threads == 2) {
          options.ignored_arc_length = 0.1;
          arrays.closed = closed.data();
          arrays.groups = groups.data();
        }
        std::size_t pairs = 0;
        const auto count = [&](SegmentPair) { ++pairs; };
        FiberTree(options).visitPairs(count);  // what threads need once is not the tree's
        const std::size_t live_before = liveBytes();
        FiberTree tree(options);
        tree.build(arrays);
        expectBytes(tree.memoryUsage(), live_before);
        tree.visitPairs(count);
        EXPECT_GT(pairs, 100u);
        expectBytes(tree.memoryUsage(), live_before);
        tree.update(arrays);
        tree.visitPairs(count);
        expectBytes(tree.memoryUsage(), live_before);
      }
    }
  }
}

TEST(TreeMemory, OfABuildIsLittleMoreThanTheTrees) {
  // If this fails, a scene whose tree has room on a machine cannot be built there.
  constexpr int kFibers = 1000, kPoints = 101;
  Random random(192);
  Assembly<float> fibers;
  for (int f = 0; f < kFibers; ++f) {
    const Eigen::Vector3d root = random.inCube(2);
    for (int i = 0; i < kPoints; ++i) {
      fibers.addPoint({root.x(), root.y(), root.z() + 0.1 * i}, 0.02);
    }
    fibers.endFiber();
  }
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    FiberTreeOptions options;
    options.report = report;
    FiberTree tree(options);
    const PeakMemory peak;
    tree.build(fibers.view());
    EXPECT_LE(peak.bytes(), tree.memoryUsage() + 16 * tree.segmentCount());
  }
}

MANAGER_SUITE(ManagerMemory, FiberManagers);

TYPED_TEST(ManagerMemory, OfADenseQueryIsBoundedAndGivenBack) {
  // If this fails, one frame in which much hair lies in one place takes hundreds of megabytes, and
  // keeps them.
  using S = typename TypeParam::Scalar;
  Scene<S> scene = soupScene<S>(20000, 0.01, 191);  // so that windows are large when it comes
  for (int i = 0; i < 6000; ++i) scene.addCapsule({2, 0, 0}, {2, 0, 1}, 0.1);
  for (const Report report : {Report::kVolumes, Report::kCapsules}) {
    FiberManagerOptions options;
    options.report = report;
    options.threads = 2;
    const auto manager = TypeParam::make(options);
    manager->registerObjects(scene.objects());
    manager->setup();
    struct Count {
      std::size_t calls = 0, most = 0;
    } count;
    const std::size_t live_before = liveBytes(), said_before = manager->memoryUsage();
    manager->collide(&count, [](fcl::CollisionObject<S>*, fcl::CollisionObject<S>*, void* data) {
      auto& seen = *static_cast<Count*>(data);
      if (++seen.calls % 4096 == 0) seen.most = std::max(seen.most, liveBytes());
      return false;
    });
    EXPECT_GT(count.calls, 17'000'000u);  // 144 megabytes
    EXPECT_LE(count.most - live_before, std::size_t{64} << 20);
    const std::size_t kept = liveBytes() - live_before;
    EXPECT_LE(kept, std::size_t{5} << 20);
    EXPECT_NEAR(double(manager->memoryUsage() - said_before), double(kept),
                0.05 * double(kept) + 4096);
  }
}

TYPED_TEST(ManagerMemory, IsWhatTheHeapGave) {
  // If this fails, a program that counts on memoryUsage() runs out of memory.
  using S = typename TypeParam::Scalar;
  const Scene<S> scene = strandScene<S>(60, 80, 189);
  const Scene<S> late = strandScene<S>(1, 40, 190);
  std::vector<FiberManagerOptions> all(3);
  all[1].report = Report::kCapsules;
  all[1].ignored_arc_length = 0.1;
  all[2].report = Report::kCapsules;
  all[2].threads = 2;
  for (const FiberManagerOptions& options : all) {
    SCOPED_TRACE(describe(options));
    selfPairs<S>(*TypeParam::make(options));  // what threads need once is not the manager's
    const std::size_t live_before = liveBytes();
    const auto manager = TypeParam::make(options);
    registerFibers<S>(*manager, scene, {1, 2, 1});
    expectBytes(manager->memoryUsage(), live_before);
    EXPECT_GT(selfPairs<S>(*manager).size(), 100u);
    expectBytes(manager->memoryUsage(), live_before);
    manager->update({scene[0], scene[77], scene[500]});
    EXPECT_GT(selfPairs<S>(*manager).size(), 100u);
    expectBytes(manager->memoryUsage(), live_before);
    manager->registerObjects(late.objects());  // few: kept beside the tree
    manager->unregisterObject(scene[3]);
    EXPECT_GT(selfPairs<S>(*manager).size(), 100u);
    expectBytes(manager->memoryUsage(), live_before);
  }
}

}  // namespace
}  // namespace fcl_fibers::test
