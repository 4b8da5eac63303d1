// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_tree.h>

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace fcl_fibers {
namespace {

constexpr std::size_t kFibers = 1000, kSegments = 100;

/// Wandering fibers side by side.
template <typename S>
struct Lock {
  Lock() {
    std::mt19937 random(51);
    const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0 - 0.5; };
    for (std::size_t f = 0; f < kFibers; ++f) {
      double p[3] = {2 * uniform(), 2 * uniform(), 0};
      for (std::size_t i = 0; i <= kSegments; ++i) {
        for (const double x : p) points.push_back(static_cast<S>(x));
        p[0] += 0.1 * uniform();
        p[1] += 0.1 * uniform();
        p[2] += 0.3;
      }
      point_begin.push_back(points.size() / 3);
    }
    arrays = {points.data(), points.size() / 3, point_begin.data(), kFibers, radii.data()};
  }

  std::vector<S> points;
  std::vector<std::size_t> point_begin = {0};
  std::vector<S> radii = std::vector<S>(kFibers * (kSegments + 1), static_cast<S>(0.0035));
  FiberArrays<S> arrays;
};

/// After a frame, as a program has it.
template <typename S>
double bytesPerSegment(const FiberTreeOptions& options, const FiberArrays<S>& arrays) {
  FiberTree tree(options);
  tree.build(arrays);
  tree.update(arrays);
  std::size_t pairs = 0;
  tree.visitPairs([&](SegmentPair) { ++pairs; });
  EXPECT_GT(pairs, 0u);
  return static_cast<double>(tree.memoryUsage()) / (kFibers * kSegments);
}

// The least tree would grow by what a scene does not use. docs/costs.md has the table: a pack of
// 192 bytes and a node of 44 for 6.8 segments, and 8 bytes a segment.
TEST(Costs, OfTheLeastTree) {
  const Lock<double> lock;
  EXPECT_LE(bytesPerSegment({}, lock.arrays), 44);
}

TEST(Costs, NothingIsKeptThatIsNotAskedFor) {
  Lock<double> lock;
  const double least = bytesPerSegment({}, lock.arrays);
  // Volumes are float whatever the points are.
  EXPECT_EQ(bytesPerSegment({}, Lock<float>().arrays), least);

  using Radii = FiberArrays<double>::Radii;
  for (const Radii radii : {Radii::kPerFiber, Radii::kPerSegment}) {
    lock.arrays.radii_are = radii;
    EXPECT_EQ(bytesPerSegment({}, lock.arrays), least);
  }
  const std::vector<std::uint8_t> closed(kFibers, 1);
  lock.arrays.closed = closed.data();
  EXPECT_EQ(bytesPerSegment({}, lock.arrays), least) << "no neighbours are ignored";
  const std::vector<std::int32_t> no_groups(kFibers, 0);
  lock.arrays.groups = no_groups.data();
  EXPECT_EQ(bytesPerSegment({}, lock.arrays), least) << "no fiber has a group";

  FiberTreeOptions options;
  options.margin = 0.01;
  options.threads = 2;
  EXPECT_EQ(bytesPerSegment(options, lock.arrays), least);
  lock.arrays.closed = nullptr;
  options.ignored_neighbors = 3;
  EXPECT_EQ(bytesPerSegment(options, lock.arrays), least);
}

// A row of docs/costs.md would say too little.
TEST(Costs, OfWhatIsAskedFor) {
  Lock<double> lock;
  const double least = bytesPerSegment({}, lock.arrays);
  FiberTreeOptions capsules;
  capsules.report = Report::kCapsules;
  EXPECT_NEAR(bytesPerSegment(capsules, lock.arrays) - least, 56 * 1.01, 1);
  FiberTreeOptions by_length;
  by_length.ignored_arc_length = 0.5;
  EXPECT_NEAR(bytesPerSegment(by_length, lock.arrays) - least, 8 * 1.01, 0.1);
  FiberTreeOptions spheres;
  spheres.volumes = FiberTreeOptions::Volumes::kWrappedSpheres;
  EXPECT_LE(bytesPerSegment(spheres, lock.arrays) - least, 32);
  std::vector<std::int32_t> groups;
  for (std::size_t f = 0; f < kFibers; ++f) groups.push_back(static_cast<std::int32_t>(f % 7) + 1);
  lock.arrays.groups = groups.data();
  const double grouped = bytesPerSegment({}, lock.arrays);
  EXPECT_GT(grouped, least);
  EXPECT_LE(grouped - least, 6);
}

}  // namespace
}  // namespace fcl_fibers
