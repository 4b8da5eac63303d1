// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "numerics/specimen.h"
#include "support/assembly.h"
#include "support/small_stack.h"

namespace fcl_fibers::test {
namespace {

// A million segments, where a recursion over them would overflow the stack, a sort run on equal
// keys never end, and the square of their number overflow.

constexpr int kMany = 1'000'000;

struct MillionCase {
  FiberTreeOptions::Volumes volumes;
  Topology topology;
};

class Million : public testing::TestWithParam<MillionCase> {
 protected:
  /// At most as many pairs as a million, by first points, ascending; a pair that comes twice or out
  /// of order fails.
  static std::vector<NumberPair> pairsOf(const Assembly<float>& fibers, bool updated) {
    FiberTreeOptions options;
    options.volumes = GetParam().volumes;
    options.topology = GetParam().topology;
    options.report = Report::kCapsules;
    options.ignored_neighbors = 0;
    std::vector<NumberPair> pairs;
    runOnSmallStack([&] {
      FiberTree tree(options);
      tree.build(fibers.view());
      if (updated) tree.update(fibers.view());
      tree.visit(Pairs{}, [&](SegmentPair pair) {
        pairs.push_back({pair.a, pair.b});
        return pairs.size() == kMany;
      });
    });
    std::sort(pairs.begin(), pairs.end());
    EXPECT_EQ(std::adjacent_find(pairs.begin(), pairs.end()), pairs.end());
    for (const NumberPair& pair : pairs) {
      if (pair.a >= pair.b) ADD_FAILURE() << pair.a << ", " << pair.b;
    }
    return pairs;
  }
};

TEST_P(Million, IdenticalSegments) {
  Assembly<float> fibers;
  for (int i = 0; i < kMany; ++i) fibers.addCapsule({1, 2, 3}, {2, 4, 6}, 0);
  EXPECT_EQ(pairsOf(fibers, true).size(), std::size_t{kMany});
}

TEST_P(Million, NestedSegments) {
  Assembly<float> fibers;
  for (int i = 0; i < kMany; ++i) fibers.addCapsule({-1.0 - i, 0, 0}, {1.0 + i, 0, 0}, 0);
  EXPECT_EQ(pairsOf(fibers, false).size(), std::size_t{kMany});
}

/// Each capsule touches the next and no other.
std::vector<NumberPair> chain(int points_per_capsule) {
  std::vector<NumberPair> pairs;
  for (int i = 0; i + 1 < kMany; ++i) {
    pairs.push_back({points_per_capsule * i, points_per_capsule * (i + 1)});
  }
  return pairs;
}

TEST_P(Million, CollinearFibersOfOneSegment) {
  Assembly<float> fibers;
  for (int i = 0; i < kMany; ++i) fibers.addCapsule({0, 1.0 * i, 0}, {0, 1.0 + i, 0}, 0);
  EXPECT_EQ(pairsOf(fibers, false), chain(2));
}

/// One fiber, to and fro along x, then a step along y, to and fro, then a step along z.
Assembly<float> throughACube(int side) {
  Assembly<float> fibers;
  for (int i = 0; i <= side * side * side; ++i) {
    const int row = i / side, layer = row / side;
    const int x = row % 2 == 0 ? i % side : side - 1 - i % side;
    const int y = layer % 2 == 0 ? row % side : side - 1 - row % side;
    fibers.addPoint({double(x), double(y), double(layer)}, 0.25);
  }
  fibers.endFiber();
  return fibers;
}

TEST_P(Million, OneFiberThroughAllOfACube) {
  EXPECT_EQ(pairsOf(throughACube(100), true), chain(1));
}

using Volumes = FiberTreeOptions::Volumes;
std::string caseName(const testing::TestParamInfo<MillionCase>& info) {
  return std::string(info.param.volumes == Volumes::kLayeredBoxes ? "Boxes" : "Spheres") +
         (info.param.topology == Topology::kBundle ? "Bundle" : "SuperThread");
}
INSTANTIATE_TEST_SUITE_P(Quick, Million,
                         testing::Values(MillionCase{Volumes::kLayeredBoxes, Topology::kBundle}),
                         caseName);
// Programs whose threads have little stack would crash in some query, in one of the managers say.
TEST(SmallStack, IsEnoughForEveryBuildUpdateAndQuery) {
  const Assembly<float> many = throughACube(30), few = throughACube(10);
  const std::size_t pairs_of_few = few.capsules().size() * (few.capsules().size() - 1) / 2;
  for (const Form form : {Form::kArrays, Form::kObjects}) {
    const Specimen<float> large(many, form), small(few, form);
    for (FiberTreeOptions options : allKinds()) {
      options.threads = options.topology == Topology::kBundle ? 1 : 2;
      const auto history = form == Form::kArrays ? History::kUpdated : History::kLate;
      runOnSmallStack([&] {
        EXPECT_GT(large.pairs(options, History::kUpdated).size(), 20'000u);
        EXPECT_GT(large.pairs(options, history).size(), 20'000u);
        EXPECT_GT(large.pairsWith(small, options, options).size(), 1'000u);
        if (form == Form::kObjects) {
          EXPECT_EQ(small.pairs(options, history, Query::kDistance).size(), pairs_of_few);
          EXPECT_GT(large.pairsWith(small, options, options, Partner::kEachObject).size(), 1'000u);
          return;
        }
        FiberTree tree(options);
        tree.build(many.view());
        EXPECT_GT(tree.volumes(100).size(), 20'000u);
      });
    }
  }
}

// Left to the long run: the others differ in what they bound the same nodes with.
INSTANTIATE_TEST_SUITE_P(
    DISABLED_Long, Million,
    testing::Values(MillionCase{Volumes::kLayeredBoxes, Topology::kSuperThread},
                    MillionCase{Volumes::kWrappedSpheres, Topology::kBundle},
                    MillionCase{Volumes::kWrappedSpheres, Topology::kSuperThread}),
    caseName);

}  // namespace
}  // namespace fcl_fibers::test
