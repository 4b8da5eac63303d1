// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_tree.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "support/assembly.h"
#include "support/random.h"

namespace fcl_fibers {
namespace {

constexpr std::size_t kFibers = 1000, kSegments = 100;

/// Wandering fibers side by side.
template <typename S>
test::Assembly<S> lock() {
  test::Random random(51);
  test::Assembly<S> fibers;
  for (std::size_t f = 0; f < kFibers; ++f) {
    double x = random.between(-1, 1), y = random.between(-1, 1);
    for (std::size_t i = 0; i <= kSegments; ++i) {
      fibers.addPoint({x, y, 0.3 * static_cast<double>(i)}, 0.0035);
      x += random.between(-0.05, 0.05);
      y += random.between(-0.05, 0.05);
    }
    fibers.endFiber();
  }
  return fibers;
}

const FiberTreeOptions kLeast = FiberOptions{Topology::kBundle, Report::kVolumes};

/// After a frame, as a program has it.
template <typename S>
double bytesPerSegment(const FiberTreeOptions& options, const FiberArrays<S>& arrays) {
  FiberTree tree(options);
  tree.build(arrays);
  tree.update(arrays);
  std::vector<SegmentPair> pairs;
  tree.find(Pairs{}, pairs);
  EXPECT_GT(pairs.size(), 0u);
  return static_cast<double>(tree.memoryUsage()) / (kFibers * kSegments);
}

// The least tree would grow by what a scene does not use. docs/trade.md has the table: a node of
// 256 bytes for 6.8 segments, and the number of each.
TEST(Costs, OfTheLeastTree) { EXPECT_LE(bytesPerSegment(kLeast, lock<double>().view()), 44); }

TEST(Costs, NothingIsKeptThatIsNotAskedFor) {
  const test::Assembly<double> fibers = lock<double>();
  FiberArrays<double> arrays = fibers.view();
  arrays.radii_are = FiberArrays<double>::Radii::kOne;
  const double least = bytesPerSegment(kLeast, arrays);
  // Volumes are float whatever the points are.
  EXPECT_EQ(bytesPerSegment(kLeast, lock<float>().view()), least);

  using Radii = FiberArrays<double>::Radii;
  for (const Radii radii : {Radii::kPerFiber, Radii::kPerFirstPoint}) {
    arrays.radii_are = radii;
    EXPECT_EQ(bytesPerSegment(kLeast, arrays), least);
  }
  // A tree that threads search keeps what they write pairs to, a quarter of its own size at most.
  FiberTreeOptions threaded = kLeast;
  threaded.threads = 2;
  const double scratch = bytesPerSegment(threaded, arrays) - least;
  EXPECT_GT(scratch, 0);
  EXPECT_LE(scratch, least / 4);
  const std::vector<std::uint8_t> closed(kFibers, 1);
  arrays.closed = closed.data();
  EXPECT_EQ(bytesPerSegment(kLeast, arrays), least) << "no neighbours are ignored";
  const std::vector<std::int32_t> no_groups(kFibers, 0);
  arrays.groups = no_groups.data();
  EXPECT_EQ(bytesPerSegment(kLeast, arrays), least) << "no fiber has a group";

  FiberTreeOptions options = kLeast;
  options.margin = 0.01;
  EXPECT_EQ(bytesPerSegment(options, arrays), least);
  arrays.closed = nullptr;
  options.ignored_neighbors = 3;
  EXPECT_EQ(bytesPerSegment(options, arrays), least);
}

// A row of docs/trade.md would say too little.
TEST(Costs, OfWhatIsAskedFor) {
  const test::Assembly<double> fibers = lock<double>();
  FiberArrays<double> arrays = fibers.view();
  arrays.radii_are = FiberArrays<double>::Radii::kOne;
  const double least = bytesPerSegment(kLeast, arrays);
  FiberTreeOptions capsules = kLeast;
  capsules.report = Report::kCapsules;
  EXPECT_NEAR(bytesPerSegment(capsules, arrays) - least, 32 * 1.01, 1);
  FiberTreeOptions by_length = kLeast;
  by_length.ignored_arc_length = 0.5;
  EXPECT_NEAR(bytesPerSegment(by_length, arrays) - least, 8 * 1.01, 0.1);
  FiberTreeOptions spheres = kLeast;
  spheres.volumes = FiberTreeOptions::Volumes::kWrappedSpheres;
  EXPECT_LE(bytesPerSegment(spheres, arrays) - least, 32);
  std::vector<std::int32_t> groups;
  for (std::size_t f = 0; f < kFibers; ++f) groups.push_back(static_cast<std::int32_t>(f % 7) + 1);
  arrays.groups = groups.data();
  const double grouped = bytesPerSegment(kLeast, arrays);
  EXPECT_GT(grouped, least);
  EXPECT_LE(grouped - least, 6);
}

}  // namespace
}  // namespace fcl_fibers
