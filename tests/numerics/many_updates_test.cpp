// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/live_pairs.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "numerics/specimen.h"
#include "support/managers_under_test.h"
#include "support/pair_queries.h"
#include "support/random.h"
#include "support/scene.h"

namespace fcl_fibers::test {
namespace {

// What a program changes in every step for days: volumes that only grow, rounding that adds up, or
// memory that is never given back.

constexpr int kFibers = 4, kSegments = 5;
/// Steps of a lap. It is a prime number, so that the checks are at other places of each lap.
constexpr int kLap = 997;

/// Where a fiber is, relative to its first place: on a circle of its own, through the others.
std::array<double, 3> placeAt(int fiber, int step) {
  const double angle = 2 * 3.141592653589793 * (step % kLap) / kLap + fiber;
  return {(1 + fiber) * std::cos(angle), std::sin(angle), 0.1 * fiber * std::sin(2 * angle)};
}

Assembly<double> fibersAtStart() {
  Random random(1);
  Assembly<double> fibers;
  for (int f = 0; f < kFibers; ++f) {
    std::array<double, 3> p = {0, 0, 0};
    for (int i = 0; i <= kSegments; ++i) {
      fibers.addPoint(p, 0.2);
      for (double& x : p) x += random.between(-0.8, 0.8);
    }
    fibers.endFiber();
  }
  return fibers;
}

std::vector<NumberPair> sorted(std::vector<NumberPair> pairs) {
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

std::vector<NumberPair> pairsOf(const FiberTree& tree) {
  std::vector<NumberPair> pairs;
  tree.visit(Pairs{}, [&](SegmentPair pair) { pairs.push_back({pair.a, pair.b}); });
  return sorted(std::move(pairs));
}

TEST(ManyUpdates, OfATreeLeaveItAsANewOne) {
  constexpr int kUpdates = 1'000'000, kCheck = kUpdates / 10;
  const Assembly<double> start = fibersAtStart();
  for (const FiberTreeOptions& options : allKinds(0.01)) {
    // One of either volumes, topologies and reports.
    const bool of_boxes = options.volumes == FiberTreeOptions::Volumes::kLayeredBoxes;
    if (of_boxes != (options.topology == Topology::kBundle) ||
        of_boxes != (options.report == Report::kCapsules)) {
      continue;
    }
    SCOPED_TRACE(describe(Form::kArrays, options));
    Assembly<double> fibers = start;
    FiberTree tree(options);
    tree.build(fibers.view());
    std::size_t bytes = 0, seen = 0;
    for (int step = 1; step <= kUpdates; ++step) {
      for (int f = 0; f < kFibers; ++f) {
        const std::array<double, 3> place = placeAt(f, step);
        for (std::size_t i = fibers.point_begin[static_cast<std::size_t>(f)];
             i < fibers.point_begin[static_cast<std::size_t>(f) + 1]; ++i) {
          for (std::size_t axis = 0; axis < 3; ++axis) {
            fibers.points[3 * i + axis] = start.points[3 * i + axis] + place[axis];
          }
        }
      }
      tree.update(fibers.view());
      if (step % 100 == 0) seen += tree.visit(Pairs{}, [](SegmentPair) { return true; }) ? 1 : 0;
      if (step == kLap) bytes = tree.memoryUsage();
      if (step % kCheck != 0) continue;
      FiberTree fresh(options);
      fresh.build(fibers.view());
      EXPECT_EQ(pairsOf(tree), pairsOf(fresh)) << "step " << step;
    }
    EXPECT_GT(seen, std::size_t{kUpdates / 200}) << "nothing touches";
    EXPECT_EQ(tree.memoryUsage(), bytes);
  }
}

TEST(ManyUpdates, OfAManagerLeaveItAsANewOne) {
  constexpr int kUpdates = 100'000, kCheck = kUpdates / 10;
  const Assembly<double> start = fibersAtStart();
  const FiberManagerOptions options;
  const auto make = [&](bool of_boxes) -> std::unique_ptr<FiberCollisionManager<double>> {
    if (of_boxes) return makeLayeredAabbTree<double>(options);
    return makeWrappedSphereTree<double>(options);
  };
  for (const bool of_boxes : {true, false}) {
    Scene<double> scene;
    for (std::size_t f = 0; f < start.fiberCount(); ++f) {
      std::vector<Eigen::Vector3d> points;
      for (std::size_t i = start.point_begin[f]; i < start.point_begin[f + 1]; ++i) {
        points.emplace_back(start.points[3 * i], start.points[3 * i + 1], start.points[3 * i + 2]);
      }
      scene.addFiber(points, 0.2);
    }
    std::vector<fcl::Transform3<double>> poses;
    for (const auto* object : scene.objects()) poses.push_back(object->getTransform());
    const auto manager = make(of_boxes);
    for (const auto& fiber : scene.fibers()) manager->registerFiber(fiber);
    std::size_t bytes = 0;
    for (int step = 1; step <= kUpdates; ++step) {
      for (std::size_t k = 0; k < scene.size(); ++k) {
        const std::array<double, 3> place = placeAt(static_cast<int>(k) / kSegments, step);
        fcl::Transform3<double> pose = poses[k];
        pose.translation() += Eigen::Vector3d(place[0], place[1], place[2]);
        moveTo(*scene[k], pose);
      }
      manager->update();
      if (step == kLap) bytes = manager->memoryUsage();
      if (step % kCheck != 0) continue;
      const auto fresh = make(of_boxes);
      for (const auto& fiber : scene.fibers()) fresh->registerFiber(fiber);
      const auto pairs = asSet<double>(selfPairs(*manager));
      EXPECT_FALSE(pairs.empty());
      EXPECT_EQ(pairs, asSet<double>(selfPairs(*fresh))) << "step " << step;
    }
    EXPECT_EQ(manager->memoryUsage(), bytes);
  }
}

}  // namespace
}  // namespace fcl_fibers::test
