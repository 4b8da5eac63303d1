// SPDX-License-Identifier: BSD-3-Clause
#include "tree/topology.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace fcl_fibers::tree {
namespace {

using geometry::Segment;
using ::testing::ElementsAre;

Fibers makeFibers(const std::vector<int>& lengths) {
  Fibers fibers;
  for (const int length : lengths) {
    for (int i = 0; i < length; ++i)
      fibers.ids.push_back(static_cast<SegmentId>(fibers.ids.size()));
    fibers.endFiber();
  }
  return fibers;
}

/// Straight fibers along z, on a square grid a tenth apart, segments of length 0.3.
std::vector<Segment> straightFibers(const Fibers& fibers) {
  std::vector<Segment> segments(fibers.ids.size());
  for (std::size_t f = 0; f + 1 < fibers.begin.size(); ++f) {
    const double x = 0.1 * static_cast<double>(f % 30), y = 0.1 * static_cast<double>(f / 30);
    for (std::int32_t i = fibers.begin[f]; i < fibers.begin[f + 1]; ++i) {
      const double z = 0.3 * (i - fibers.begin[f]);
      segments[static_cast<std::size_t>(i)] = {{x, y, z}, {x, y, z + 0.3}, 0.01};
    }
  }
  return segments;
}

template <int A>
int depthBelow(const Topology<A>& topology, std::int32_t index) {
  const auto& node = topology.nodes[static_cast<std::size_t>(index)];
  int depth = 1;
  for (int lane = 0; lane < node.child_count; ++lane) {
    const Link child = node.children[static_cast<std::size_t>(lane)];
    if (!child.isLeaf()) depth = std::max(depth, 1 + depthBelow(topology, child.node()));
  }
  return depth;
}

/// The invariants that Topology documents.
template <int A>
void expectInvariants(const Topology<A>& topology, const Fibers& fibers) {
  std::vector<SegmentId> leaves = topology.leaves;
  std::sort(leaves.begin(), leaves.end());
  std::vector<SegmentId> all = fibers.ids;
  std::sort(all.begin(), all.end());
  EXPECT_EQ(leaves, all) << "every segment is a leaf, once";
  if (fibers.ids.empty()) {
    EXPECT_TRUE(topology.nodes.empty());
    return;
  }
  ASSERT_FALSE(topology.nodes.empty());
  EXPECT_EQ(topology.nodes[0].leaf_begin, 0);
  EXPECT_EQ(topology.nodes[0].leaf_end, static_cast<std::int32_t>(fibers.ids.size()));

  std::vector<int> parents(topology.nodes.size(), 0);
  for (std::size_t i = 0; i < topology.nodes.size(); ++i) {
    const auto& node = topology.nodes[i];
    ASSERT_GE(node.child_count, i == 0 ? 1 : 2);
    ASSERT_LE(node.child_count, A);
    std::int32_t leaf = node.leaf_begin;
    for (int lane = 0; lane < node.child_count; ++lane) {
      const Link child = node.children[static_cast<std::size_t>(lane)];
      if (child.isLeaf()) {
        EXPECT_EQ(topology.leaves[static_cast<std::size_t>(leaf)], child.segment());
        ++leaf;
      } else {
        ASSERT_GT(child.node(), static_cast<std::int32_t>(i)) << "children come after their parent";
        const auto& below = topology.nodes[static_cast<std::size_t>(child.node())];
        EXPECT_EQ(below.leaf_begin, leaf) << "children share the leaves out in order";
        leaf = below.leaf_end;
        ++parents[static_cast<std::size_t>(child.node())];
      }
    }
    EXPECT_EQ(leaf, node.leaf_end);
  }
  EXPECT_EQ(parents[0], 0);
  EXPECT_TRUE(std::all_of(parents.begin() + 1, parents.end(), [](int n) { return n == 1; }))
      << "every node but the root is the child of one";
}

const std::vector<std::vector<int>> kLengths = {{},
                                                {1},
                                                {2},
                                                {0, 0},
                                                {1, 1, 1, 1, 1, 1, 1, 1, 1},
                                                {5},
                                                {1000},
                                                {8, 8, 8},
                                                {3, 0, 7},
                                                {1, 500, 2, 1, 30},
                                                std::vector<int>(100, 40),
                                                std::vector<int>(333, 1)};

// Refits and traversals would visit a segment twice, never, or before its volume is fitted.
TEST(SuperThread, KeepsTheInvariants) {
  for (const auto& lengths : kLengths) {
    const Fibers fibers = makeFibers(lengths);
    expectInvariants(superThread(fibers), fibers);
  }
}

TEST(Bundle, KeepsTheInvariants) {
  for (const auto& lengths : kLengths) {
    const Fibers fibers = makeFibers(lengths);
    expectInvariants(bundle(fibers, straightFibers(fibers)), fibers);
  }
}

/// Slot by slot, from the leaves below.
template <int A>
void expectGroups(const Topology<A>& topology, const Fibers& fibers) {
  std::vector<Group> by_segment;
  for (std::size_t f = 0; f + 1 < fibers.begin.size(); ++f) {
    by_segment.resize(static_cast<std::size_t>(fibers.begin[f + 1]), fibers.groups[f]);
  }
  ASSERT_EQ(topology.groups.size(), topology.nodes.size() * A);
  for (std::size_t i = 0; i < topology.nodes.size(); ++i) {
    const auto& node = topology.nodes[i];
    std::int32_t leaf = node.leaf_begin;
    for (std::size_t lane = 0; lane < static_cast<std::size_t>(node.child_count); ++lane) {
      const Link child = node.children[lane];
      const std::int32_t end =
          child.isLeaf() ? leaf + 1
                         : topology.nodes[static_cast<std::size_t>(child.node())].leaf_end;
      std::set<Group> below;
      for (; leaf < end; ++leaf) {
        const SegmentId id = topology.leaves[static_cast<std::size_t>(leaf)];
        below.insert(by_segment[static_cast<std::size_t>(id)]);
      }
      EXPECT_EQ(topology.groups[A * i + lane], below.size() == 1 ? *below.begin() : kNoGroup);
    }
  }
}

// A node of several groups, or of some and none, would be taken for one of a group; or a search
// would have to look into a node of which all is of one.
TEST(Topologies, KnowTheGroupsOfNodes) {
  for (const auto& lengths : kLengths) {
    for (const int groups : {1, 2, 1000}) {
      Fibers fibers = makeFibers(lengths);
      for (std::size_t f = 0; f < lengths.size(); ++f) {
        // Neighbouring fibers alike, some of none.
        const auto group = static_cast<Group>(f / 3) % groups;
        fibers.groups.push_back(groups == 1 ? 5 : group);
      }
      if (lengths.empty()) continue;
      expectGroups(superThread(fibers), fibers);
      expectGroups(bundle(fibers, straightFibers(fibers)), fibers);
    }
    const Fibers plain = makeFibers(lengths);
    EXPECT_TRUE(superThread(plain).groups.empty());
    EXPECT_TRUE(bundle(plain, straightFibers(plain)).groups.empty());
  }
}

// It would not be the paper's order: tip to tip and root to root alternately.
TEST(SuperThread, TurnsEveryOtherFiber) {
  EXPECT_THAT(superThread(makeFibers({3, 2, 0, 3, 1})).leaves,
              ElementsAre(0, 1, 2, 4, 3, /*third fiber empty*/ 7, 6, 5, 8));
}

// Ids need not be consecutive: unregistered objects leave gaps.
TEST(SuperThread, TakesAnyIds) {
  Fibers fibers;
  fibers.ids = {4, 9, 2, 30};
  fibers.begin = {0, 2, 4};
  EXPECT_THAT(superThread(fibers).leaves, ElementsAre(4, 9, 30, 2));
}

// Detection along one chain would be worse than the paper's bound.
TEST(SuperThread, IsBalanced) {
  for (const int n : {2, 3, 4, 5, 31, 32, 33, 1000}) {
    const auto topology = superThread(makeFibers({n}));
    EXPECT_EQ(depthBelow(topology, 0), static_cast<int>(std::ceil(std::log2(n)))) << n;
    EXPECT_EQ(topology.nodes.size(), static_cast<std::size_t>(n - 1));
  }
}

// The stack would not be bounded, nor the time of a query.
TEST(Bundle, IsShallowWhateverTheFibers) {
  std::vector<int> uneven(1000, 1);
  uneven.push_back(100000);
  for (const auto& lengths : {std::vector<int>(100, 100), std::vector<int>(10000, 1), uneven}) {
    const Fibers fibers = makeFibers(lengths);
    const auto topology = bundle(fibers, straightFibers(fibers));
    EXPECT_LE(depthBelow(topology, 0), static_cast<int>(std::log2(fibers.ids.size())));
  }
}

// Scenes where nothing tells segments apart would take for ever or overflow the stack.
TEST(Bundle, SplitsCoincidentSegments) {
  const Fibers one = makeFibers({100000});
  const Fibers many = makeFibers(std::vector<int>(100000, 1));
  const std::vector<Segment> segments(100000, Segment{{1, 2, 3}, {1, 2, 3}, 0});
  for (const Fibers& fibers : {one, many}) {
    const auto topology = bundle(fibers, segments);
    expectInvariants(topology, fibers);
    EXPECT_LE(depthBelow(topology, 0), 17);
  }
}

// Half-empty packs would cost memory and tests.
TEST(Bundle, FillsItsNodes) {
  for (const auto& lengths : {std::vector<int>(100, 100), std::vector<int>(1000, 50)}) {
    const Fibers fibers = makeFibers(lengths);
    const auto topology = bundle(fibers, straightFibers(fibers));
    const double segments_per_node =
        static_cast<double>(fibers.ids.size()) / static_cast<double>(topology.nodes.size());
    EXPECT_GT(segments_per_node, 6) << "of seven, were all full";
  }
}

// It would be a chain-aligned tree no more: a node of one fiber has to be a range along it.
TEST(Bundle, OfOneFiberIsChainAligned) {
  const Fibers fibers = makeFibers({777});
  std::vector<SegmentId> in_order(777);
  std::iota(in_order.begin(), in_order.end(), 0);
  EXPECT_EQ(bundle(fibers, straightFibers(fibers)).leaves, in_order);
}

// The whole point: a node that holds near segments of many fibers, however they were registered.
TEST(Bundle, DoesNotDependOnTheOrderOfFibers) {
  const Fibers fibers = makeFibers(std::vector<int>(900, 20));
  const std::vector<Segment> segments = straightFibers(fibers);
  std::vector<Segment> shuffled(segments.size());
  for (std::size_t f = 0; f < 900; ++f) {
    const std::size_t to = f * 7 % 900;  // 7 and 900 have no factor in common
    std::copy_n(segments.begin() + static_cast<std::ptrdiff_t>(20 * f), 20,
                shuffled.begin() + static_cast<std::ptrdiff_t>(20 * to));
  }
  const auto cost = [&](const std::vector<Segment>& scene) {
    const auto topology = bundle(fibers, scene);
    double sum = 0;
    for (const auto& node : topology.nodes) {
      geometry::Vec3d low = scene[static_cast<std::size_t>(
                                      topology.leaves[static_cast<std::size_t>(node.leaf_begin)])]
                                .a,
                      high = low;
      for (std::int32_t i = node.leaf_begin; i < node.leaf_end; ++i) {
        const Segment& s =
            scene[static_cast<std::size_t>(topology.leaves[static_cast<std::size_t>(i)])];
        low = min(low, min(s.a, s.b));
        high = max(high, max(s.a, s.b));
      }
      sum += norm(high - low);
    }
    return sum;
  };
  EXPECT_NEAR(cost(shuffled), cost(segments), 0.02 * cost(segments));
}

}  // namespace
}  // namespace fcl_fibers::tree
