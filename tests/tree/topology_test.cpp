// SPDX-License-Identifier: BSD-3-Clause
#include "tree/topology.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "parallel/executor.h"
#include "support/random.h"
#include "support/segments.h"
#include "support/tree_segments.h"

namespace fcl_fibers::tree {
namespace {

using geometry::Segment;
using geometry::Vec3d;
using test::Random;

Fibers fibersOf(const std::vector<int>& lengths) {
  Fibers fibers;
  for (const int length : lengths) {
    for (int i = 0; i < length; ++i)
      fibers.ids.push_back(static_cast<SegmentId>(fibers.ids.size()));
    fibers.endFiber();
  }
  return fibers;
}

template <int Arity>
bool areEqual(const Topology<Arity>& p, const Topology<Arity>& q) {
  if (p.leaves != q.leaves || p.nodes.size() != q.nodes.size()) return false;
  for (std::size_t i = 0; i < p.nodes.size(); ++i) {
    const auto &m = p.nodes[i], &n = q.nodes[i];
    if (m.child_count != n.child_count || m.leaf_begin != n.leaf_begin || m.leaf_end != n.leaf_end)
      return false;
    for (std::size_t lane = 0; lane < static_cast<std::size_t>(m.child_count); ++lane) {
      if (m.children[lane].isLeaf() != n.children[lane].isLeaf()) return false;
      if (m.children[lane].node() != n.children[lane].node()) return false;
    }
  }
  return true;
}

/// Longest way from the root to a segment, in links.
template <int Arity>
int depthOf(const Topology<Arity>& topology) {
  std::vector<int> depth(topology.nodes.size(), 0);
  int deepest = 0;
  for (std::size_t i = 0; i < topology.nodes.size(); ++i) {
    for (std::size_t lane = 0; lane < static_cast<std::size_t>(topology.nodes[i].child_count);
         ++lane) {
      const Link child = topology.nodes[i].children[lane];
      deepest = std::max(deepest, depth[i] + 1);
      if (!child.isLeaf()) depth[static_cast<std::size_t>(child.node())] = depth[i] + 1;
    }
  }
  return deepest;
}

int ceilLog2(std::size_t n) {
  int log = 0;
  while ((std::size_t{1} << log) < n) ++log;
  return log;
}

/// The words are those of Topology.
template <int Arity>
void expectInvariants(const Topology<Arity>& topology, const Fibers& fibers) {
  SegmentIds leaves = topology.leaves, ids = fibers.ids;
  std::sort(leaves.begin(), leaves.end());
  std::sort(ids.begin(), ids.end());
  ASSERT_EQ(leaves, ids) << "`leaves` are all segments";
  if (ids.empty()) {
    ASSERT_TRUE(topology.nodes.empty()) << "empty if there are no segments";
    return;
  }
  ASSERT_FALSE(topology.nodes.empty());
  ASSERT_EQ(topology.nodes[0].leaf_begin, 0) << "the root is node 0";
  ASSERT_EQ(topology.nodes[0].leaf_end, static_cast<std::int32_t>(ids.size()))
      << "the root is node 0";

  std::vector<int> parents(topology.nodes.size(), 0);
  std::vector<int> leaf_parents(topology.leaves.size(), 0);
  for (std::size_t i = 0; i < topology.nodes.size(); ++i) {
    const auto& node = topology.nodes[i];
    ASSERT_GE(node.child_count, i == 0 ? 1 : 2)
        << "every node except the root has at least two children";
    ASSERT_LE(node.child_count, Arity);
    std::int32_t next = node.leaf_begin;
    for (std::size_t lane = 0; lane < static_cast<std::size_t>(node.child_count); ++lane) {
      const Link child = node.children[lane];
      if (child.isLeaf()) {
        ASSERT_LT(next, node.leaf_end) << "the segments below a node are a contiguous range";
        ASSERT_EQ(topology.leaves[static_cast<std::size_t>(next)], child.segment())
            << "children share out the range in order";
        ++leaf_parents[static_cast<std::size_t>(next++)];
      } else {
        const auto index = static_cast<std::size_t>(child.node());
        ASSERT_GT(index, i) << "children come after their parent";
        ASSERT_LT(index, topology.nodes.size());
        ASSERT_EQ(topology.nodes[index].leaf_begin, next)
            << "children share out the range in order";
        next = topology.nodes[index].leaf_end;
        ++parents[index];
      }
    }
    ASSERT_EQ(next, node.leaf_end) << "the segments below a node are a contiguous range";
  }
  for (std::size_t i = 0; i < parents.size(); ++i)
    ASSERT_EQ(parents[i], i == 0 ? 0 : 1) << "node " << i;
  for (const int count : leaf_parents)
    ASSERT_EQ(count, 1) << "every segment is the child of one node";
}

TEST(Link, TellsNodesFromSegments) {
  // If this fails, node 0 and segment 0 are the same.
  for (const std::int32_t index : {0, 1, 77, 2147483647}) {
    EXPECT_FALSE(Link::node(index).isLeaf());
    EXPECT_EQ(Link::node(index).node(), index);
    EXPECT_TRUE(Link::leaf(index).isLeaf());
    EXPECT_EQ(Link::leaf(index).segment(), index);
  }
}

// Fibers would be split elsewhere if they are read in blocks.
TEST(MiddlesOf, AreThoseOfTheSegmentsOneByOne) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Random random(5);
  geometry::SegmentBlock block;
  for (const int count : {1, 3, 63, 64}) {
    for (int i = 0; i < count; ++i) {
      Segment s{geometry::fromEigen(random.inCube(1)), geometry::fromEigen(random.inCube(1)), 0.1};
      if (i % 7 == 0) s = {1e308 * s.a, 1e308 * s.b, 0};
      if (i % 11 == 1) s = Segment::box({-kInfinity, s.a.y, -1}, {s.b.x, kInfinity, 1});
      block.set(i, s);
    }
    std::vector<Middle> middles(static_cast<std::size_t>(count));
    middlesOf(block, count, middles.data());
    for (int i = 0; i < count; ++i) {
      EXPECT_EQ(middles[static_cast<std::size_t>(i)], middleOf(block[i])) << i << " of " << count;
    }
  }
}

TEST(SuperThread, KeepsTheInvariantsAtEverySize) {
  // If this fails, a refit or a traversal skips segments for some numbers of them.
  for (int n = 0; n <= 300; ++n) {
    const Fibers fibers = fibersOf({n});
    expectInvariants(superThread(fibers), fibers);
    if (testing::Test::HasFatalFailure()) FAIL() << n << " segments";
  }
  for (const auto& lengths : std::vector<std::vector<int>>{{},
                                                           {0},
                                                           {0, 0, 0},
                                                           {1},
                                                           {1, 1},
                                                           {0, 1, 0, 2},
                                                           {3, 0, 5, 1},
                                                           {1000, 1, 1000},
                                                           {1, 500, 2, 1, 30},
                                                           std::vector<int>(100, 40),
                                                           std::vector<int>(333, 1)}) {
    const Fibers fibers = fibersOf(lengths);
    expectInvariants(superThread(fibers), fibers);
  }
}

TEST(SuperThread, IsThreadedTipToTipAndRootToRoot) {
  // If this fails, the ends of consecutive fibers on the thread lie a fiber's length apart.
  EXPECT_EQ(superThread(fibersOf({3, 3, 3, 2})).leaves,
            (SegmentIds{0, 1, 2, 5, 4, 3, 6, 7, 8, 10, 9}));
  EXPECT_EQ(superThread(fibersOf({1, 2, 1})).leaves, (SegmentIds{0, 2, 1, 3}));
  EXPECT_EQ(superThread(fibersOf({3, 2, 0, 3, 1})).leaves,
            (SegmentIds{0, 1, 2, 4, 3, /*third fiber empty*/ 7, 6, 5, 8}));
}

TEST(SuperThread, KeepsTheNumbersOfSegments) {
  // If this fails, positions on the thread are taken for numbers in the scene.
  Fibers fibers;
  fibers.ids = {7, 3, 5};
  fibers.endFiber();
  fibers.ids.insert(fibers.ids.end(), {100, 2});
  fibers.endFiber();
  const Topology<2> topology = superThread(fibers);
  EXPECT_EQ(topology.leaves, (SegmentIds{7, 3, 5, 2, 100}));
  expectInvariants(topology, fibers);
}

TEST(SuperThread, IsBalanced) {
  // If this fails, some segment is deeper than a balanced binary tree has it, or nodes are wasted.
  for (std::size_t n = 2; n <= 2000; n += n < 70 ? 1 : 97) {
    const Topology<2> topology =
        superThread(fibersOf({static_cast<int>(n / 2), static_cast<int>(n - n / 2)}));
    ASSERT_EQ(depthOf(topology), ceilLog2(n)) << n;
    ASSERT_EQ(topology.nodes.size(), n - 1) << n;
  }
  EXPECT_EQ(depthOf(superThread(fibersOf({1}))), 1);
}

/// One segment a step of a walk; straight along x where there is no random generator.
std::vector<Segment> chain(const Vec3d& root, int length, Random* random) {
  std::vector<Segment> segments;
  Vec3d p = root;
  for (int i = 0; i < length; ++i) {
    Vec3d step{0.1, 0, 0};
    if (random != nullptr) {
      const Eigen::Vector3d d = random->direction();
      step = {0.1 * d.x(), 0.1 * d.y(), 0.1 * d.z()};
    }
    segments.push_back({p, p + step, 0.01});
    p = p + step;
  }
  return segments;
}

struct Strands {
  Fibers fibers;
  std::vector<Segment> segments;
};

Strands strands(const std::vector<int>& lengths, std::uint64_t seed) {
  Random random(seed);
  Strands result{fibersOf(lengths), {}};
  for (const int length : lengths) {
    const Eigen::Vector3d root = random.inCube(1);
    const auto fiber = chain({root.x(), root.y(), root.z()}, length, &random);
    result.segments.insert(result.segments.end(), fiber.begin(), fiber.end());
  }
  return result;
}

void expectBundle(const Strands& scene) {
  const Topology<8> topology = bundleOf(scene.fibers, scene.segments);
  expectInvariants(topology, scene.fibers);
  // Every split halves the longest range or the number of fibers.
  std::size_t longest = 0, count = 0;
  for (std::size_t f = 0; f + 1 < scene.fibers.begin.size(); ++f) {
    const auto length = static_cast<std::size_t>(scene.fibers.begin[f + 1] - scene.fibers.begin[f]);
    longest = std::max(longest, length);
    if (length > 0) ++count;
  }
  ASSERT_LE(depthOf(topology), ceilLog2(longest) + ceilLog2(count) + 1);
  ASSERT_TRUE(areEqual(topology, bundleOf(scene.fibers, scene.segments)))
      << "the same for the same input";
}

TEST(Bundle, KeepsTheInvariantsAtEverySize) {
  // If this fails, a refit or a traversal skips segments for some shapes of bundles.
  for (int n = 0; n <= 200; ++n) {
    expectBundle(strands({n}, 1));
    expectBundle(strands(std::vector<int>(static_cast<std::size_t>(n), 1), 2));
    expectBundle(strands(std::vector<int>(static_cast<std::size_t>(n), n % 7), 3));
    if (testing::Test::HasFatalFailure()) FAIL() << n;
  }
}

TEST(Bundle, TakesFibersOfUnequalLengths) {
  // If this fails, fibers of no segment or of one are lost where longer ones are split.
  Random random(4);
  expectBundle(strands({0}, 5));
  expectBundle(strands({0, 1, 0, 1000, 1, 1, 0}, 6));
  expectBundle(strands({1, 2, 4, 8, 16, 32, 64, 128, 256, 512}, 7));
  expectBundle(strands({1, 500, 2, 1, 30}, 11));
  for (int i = 0; i < 100; ++i) {
    std::vector<int> lengths;
    for (std::size_t f = 0; f < 1 + random.below(40); ++f) {
      lengths.push_back(
          static_cast<int>(random.below(2) == 0 ? random.below(3) : random.below(100)));
    }
    expectBundle(strands(lengths, random.below(1000)));
    if (testing::Test::HasFatalFailure()) FAIL() << i;
  }
}

TEST(Bundle, KeepsTheNumbersOfSegments) {
  // If this fails, positions in the list of fibers are taken for numbers in the scene.
  Strands scene = strands({5, 3, 9}, 8);
  for (SegmentId& id : scene.fibers.ids) id = 2 * (16 - id);
  std::vector<Segment> segments(40, Segment{{0, 0, 0}, {1e9, 0, 0}, 1});
  for (std::size_t i = 0; i < scene.fibers.ids.size(); ++i) {
    segments[static_cast<std::size_t>(scene.fibers.ids[i])] = scene.segments[i];
  }
  const Topology<8> renamed = bundleOf(scene.fibers, segments);
  expectInvariants(renamed, scene.fibers);
  for (SegmentId& id : scene.fibers.ids) id = 16 - id / 2;
  const Topology<8> plain = bundleOf(scene.fibers, scene.segments);
  for (std::size_t i = 0; i < plain.leaves.size(); ++i) {
    EXPECT_EQ(renamed.leaves[i], 2 * (16 - plain.leaves[i]))
        << "the shape depends on positions only";
  }
}

TEST(Bundle, SurvivesIdenticalSegments) {
  // If this fails, what no plane separates makes the tree deep or the build slow.
  const int count = 100000;
  const std::vector<Segment> segments(static_cast<std::size_t>(count),
                                      Segment{{1, 2, 3}, {1, 2, 4}, 0.5});
  for (const int length : {count, 1, 100}) {
    const Fibers fibers =
        fibersOf(std::vector<int>(static_cast<std::size_t>(count / length), length));
    expectBundle({fibers, segments});
    EXPECT_LE(depthOf(bundleOf(fibers, segments)), 17) << length;
  }
}

TEST(Bundle, IsShallowWhateverTheFibers) {
  // If this fails, the stack of a query is not bounded, nor its time.
  std::vector<int> uneven(1000, 1);
  uneven.push_back(100000);
  for (const auto& lengths : {std::vector<int>(100, 100), std::vector<int>(10000, 1), uneven}) {
    const Strands scene = strands(lengths, 12);
    EXPECT_LE(depthOf(bundleOf(scene.fibers, scene.segments)),
              static_cast<int>(std::log2(scene.segments.size())));
  }
}

TEST(Bundle, InsideOneFiberIsTheChain) {
  // If this fails, a fiber that crosses itself is taken apart by place, which motion would undo.
  const Strands scene = strands({777}, 9);
  EXPECT_EQ(bundleOf(scene.fibers, scene.segments).leaves, scene.fibers.ids);
}

/// Parallel fibers along x, on a square grid in y and z.
Strands parallelFibers(int side, int length, double distance) {
  Strands scene{fibersOf(std::vector<int>(static_cast<std::size_t>(side * side), length)), {}};
  for (int f = 0; f < side * side; ++f) {
    const auto fiber = chain({0, distance * (f % side), distance * (f / side)}, length, nullptr);
    scene.segments.insert(scene.segments.end(), fiber.begin(), fiber.end());
  }
  return scene;
}

TEST(Bundle, SplitsAlongWhereItIsLonger) {
  // If this fails, nodes are long and thin, and overlap far more than blocks do.
  const int length = 256;
  const Strands scene = parallelFibers(4, length, 0.01);
  const Topology<8> topology = bundleOf(scene.fibers, scene.segments);
  ASSERT_EQ(topology.nodes[0].child_count, 8);
  for (std::size_t lane = 0; lane < 8; ++lane) {
    const auto& node =
        topology.nodes[static_cast<std::size_t>(topology.nodes[0].children[lane].node())];
    EXPECT_EQ(node.leaf_end - node.leaf_begin, 16 * length / 8);
    for (std::int32_t i = node.leaf_begin; i < node.leaf_end; ++i) {
      const SegmentId along = topology.leaves[static_cast<std::size_t>(i)] % length;
      EXPECT_EQ(static_cast<std::size_t>(along) * 8 / length, lane);
    }
  }
}

TEST(Bundle, SplitsAcrossWhereItIsWider) {
  // If this fails, fibers far apart share nodes that there are many of.
  const int length = 20;
  const Strands scene = parallelFibers(2, length, 100);
  const Topology<8> topology = bundleOf(scene.fibers, scene.segments);
  for (const auto& node : topology.nodes) {
    if (!node.hasOnlyLeaves()) continue;
    for (std::int32_t i = node.leaf_begin; i < node.leaf_end; ++i) {
      EXPECT_EQ(topology.leaves[static_cast<std::size_t>(i)] / length,
                topology.leaves[static_cast<std::size_t>(node.leaf_begin)] / length);
    }
  }
}

TEST(Bundle, OfSingleSegmentsSplitsAtTheMedian) {
  // If this fails, the order of registration decides which single segments share a node.
  // 64 points on a line, registered in a scattered order.
  Fibers fibers = fibersOf(std::vector<int>(64, 1));
  std::vector<Segment> segments;
  for (int i = 0; i < 64; ++i) {
    const double z = 37 * i % 64;
    segments.push_back({{0, 0, z}, {0, 0, z}, 0.1});
  }
  const Topology<8> topology = bundleOf(fibers, segments);
  ASSERT_EQ(topology.nodes[0].child_count, 8);
  for (std::size_t lane = 0; lane < 8; ++lane) {
    const auto& node =
        topology.nodes[static_cast<std::size_t>(topology.nodes[0].children[lane].node())];
    ASSERT_EQ(node.leaf_end - node.leaf_begin, 8);
    for (std::int32_t i = node.leaf_begin; i < node.leaf_end; ++i) {
      const double z =
          segments[static_cast<std::size_t>(topology.leaves[static_cast<std::size_t>(i)])].a.z;
      EXPECT_EQ(static_cast<std::size_t>(z) / 8, lane);
    }
  }
}

TEST(Bundle, FillsItsNodes) {
  // If this fails, packs of eight are tested for lanes that are cleared, and memory is not what is
  // promised.
  for (const auto& [fibers, length] :
       {std::pair{100, 50}, {1000, 100}, {64, 64}, {333, 37}, {1000, 20}}) {
    const Strands scene = strands(std::vector<int>(static_cast<std::size_t>(fibers), length), 10);
    const Topology<8> topology = bundleOf(scene.fibers, scene.segments);
    const double links = static_cast<double>(topology.leaves.size() + topology.nodes.size() - 1);
    EXPECT_GT(links / static_cast<double>(topology.nodes.size()), 7) << fibers << " x " << length;
  }
}

TEST(Bundle, DoesNotDependOnTheOrderOfFibers) {
  // If this fails, a node holds fibers that were registered together, not fibers that are near.
  constexpr std::size_t kFibers = 900, kLength = 20;
  const Strands scene = parallelFibers(30, kLength, 0.1);
  std::vector<Segment> shuffled(scene.segments.size());
  for (std::size_t f = 0; f < kFibers; ++f) {
    const std::size_t to = f * 7 % kFibers;  // 7 and 900 have no factor in common
    std::copy_n(scene.segments.begin() + static_cast<std::ptrdiff_t>(kLength * f), kLength,
                shuffled.begin() + static_cast<std::ptrdiff_t>(kLength * to));
  }
  // The diagonals of all nodes' boxes.
  const auto cost = [&](const std::vector<Segment>& segments) {
    const Topology<8> topology = bundleOf(scene.fibers, segments);
    const auto at = [&](std::int32_t leaf) {
      const SegmentId id = topology.leaves[static_cast<std::size_t>(leaf)];
      return segments[static_cast<std::size_t>(id)];
    };
    double sum = 0;
    for (const auto& node : topology.nodes) {
      Vec3d low = at(node.leaf_begin).a, high = low;
      for (std::int32_t i = node.leaf_begin; i < node.leaf_end; ++i) {
        low = min(low, min(at(i).a, at(i).b));
        high = max(high, max(at(i).a, at(i).b));
      }
      sum += norm(high - low);
    }
    return sum;
  };
  EXPECT_NEAR(cost(shuffled), cost(scene.segments), 0.02 * cost(scene.segments));
}

/// Fibers of these lengths with groups and categories.
Fibers withRules(Fibers fibers) {
  for (std::size_t f = 0; f + 1 < fibers.begin.size(); ++f) {
    fibers.groups.push_back(static_cast<Group>(f / 5 % 4));
    for (std::int32_t i = fibers.begin[f]; i < fibers.begin[f + 1]; ++i) {
      fibers.meets.push_back(i % 9 == 0 ? kNoCategories
                                        : Categories{1u << f % 7, 1u << i / 100 % 11});
    }
  }
  return fibers;
}

TEST(Bundle, IsTheSameForAnyNumberOfThreads) {
  // If this fails, pairs or their order depend on how many threads a program has.
  std::vector<int> long_among_short(9000, 1);
  long_among_short.insert(long_among_short.begin() + 4000, 30000);
  std::vector<int> mixed;
  Random random(14);
  for (int f = 0; f < 12000; ++f) mixed.push_back(static_cast<int>(random.below(6)));
  const std::vector<std::vector<int>> scenes = {{},
                                                {1},
                                                {4097},
                                                {60000},
                                                std::vector<int>(40000, 1),  // split across alone
                                                std::vector<int>(6000, 12),
                                                std::vector<int>(10, 5000),
                                                long_among_short,
                                                mixed};
  for (std::size_t s = 0; s < scenes.size(); ++s) {
    Strands scene = strands(scenes[s], 15 + s);
    scene.fibers = withRules(std::move(scene.fibers));
    for (const bool are_alike : {false, true}) {
      // Keys that differ by their positions alone.
      if (are_alike) std::fill(scene.segments.begin(), scene.segments.end(), Segment{{}, {}, 1});
      const Topology<8> expected = bundleOf(scene.fibers, scene.segments);
      expectInvariants(expected, scene.fibers);
      for (const int threads : {2, 3, 8}) {
        SCOPED_TRACE(testing::Message() << "scene " << s << ", threads " << threads);
        const auto executor = parallel::makeExecutor(threads);
        std::vector<Middle> middles;
        for (const SegmentId id : scene.fibers.ids) {
          middles.push_back(middleOf(scene.segments[static_cast<std::size_t>(id)]));
        }
        const Topology<8> found = bundle(scene.fibers, middles, executor.get());
        EXPECT_TRUE(areEqual(found, expected));
        EXPECT_EQ(found.groups, expected.groups);
        EXPECT_EQ(found.meets, expected.meets);
      }
    }
    if (testing::Test::HasFailure()) return;
  }
}

TEST(Bundle, HasManyPartsOfAboutOneSize) {
  // If this fails, a few large parts keep most threads waiting during a build.
  const Strands scene = strands(std::vector<int>(1000, 300), 25);
  std::vector<Middle> middles;
  for (const Segment& segment : scene.segments) middles.push_back(middleOf(segment));
  const TopologyParts<8> whole = bundleInParts(scene.fibers, middles.data(), nullptr);
  EXPECT_GE(whole.parts.size(), 64u);
  EXPECT_LT(whole.top.size(), whole.parts.size());
  for (const auto& part : whole.parts) EXPECT_LE(part.subtree.leaves.size(), 4096u);
}

/// Slot by slot, from the leaves below.
template <int Arity>
void expectGroups(const Topology<Arity>& topology, const Fibers& fibers) {
  std::vector<Group> by_segment;
  for (std::size_t f = 0; f + 1 < fibers.begin.size(); ++f) {
    by_segment.resize(static_cast<std::size_t>(fibers.begin[f + 1]), fibers.groups[f]);
  }
  ASSERT_EQ(topology.groups.size(), topology.nodes.size() * Arity);
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
      EXPECT_EQ(topology.groups[Arity * i + lane], below.size() == 1 ? *below.begin() : kNoGroup);
    }
  }
}

TEST(Topologies, KnowTheGroupsOfNodes) {
  // If this fails, a node of several groups, or of some and none, is taken for one of a group; or a
  // search looks into a node of which all is of one.
  for (const auto& lengths : std::vector<std::vector<int>>{{1},
                                                           {2},
                                                           {0, 0},
                                                           {1, 1, 1, 1, 1, 1, 1, 1, 1},
                                                           {5},
                                                           {1000},
                                                           {8, 8, 8},
                                                           {3, 0, 7},
                                                           {1, 500, 2, 1, 30},
                                                           std::vector<int>(100, 40),
                                                           std::vector<int>(333, 1)}) {
    const Strands plain = strands(lengths, 13);
    EXPECT_TRUE(superThread(plain.fibers).groups.empty());
    EXPECT_TRUE(bundleOf(plain.fibers, plain.segments).groups.empty());
    for (const int groups : {1, 2, 1000}) {
      Fibers fibers = plain.fibers;
      for (std::size_t f = 0; f < lengths.size(); ++f) {
        // Neighbouring fibers alike, some of none.
        fibers.groups.push_back(groups == 1 ? 5 : static_cast<Group>(f / 3) % groups);
      }
      expectGroups(superThread(fibers), fibers);
      expectGroups(bundleOf(fibers, plain.segments), fibers);
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::tree
