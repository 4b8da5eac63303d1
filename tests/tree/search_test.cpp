// SPDX-License-Identifier: BSD-3-Clause
#include "tree/search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include "support/random.h"
#include "support/scoped_target.h"
#include "support/segments.h"
#include "tree/found_pairs.h"
#include "tree/search_scenes.h"

namespace fcl_fibers::tree {
namespace {

using geometry::Box;
using geometry::Frame;
using geometry::FrameChange;
using geometry::Segment;
using geometry::Vec3d;
using test::Random;

template <class Tree>
class SearchTest : public testing::Test {};

TYPED_TEST_SUITE(SearchTest, SearchedTrees, TreeNames);

// Segments in one place, a fiber that was never laid out for instance, would overrun what the
// search keeps waiting.
TYPED_TEST(SearchTest, FindsAllPairsOfSegmentsInOnePlace) {
  for (const auto& [fibers, segments] : {std::pair(1, 600), {600, 1}, {20, 60}, {7, 131}}) {
    const TypeParam tree = treeOf<TypeParam>(identical(fibers, segments));
    EXPECT_TRUE(asSet(pairsFound<TypeParam>(tree), false) == allPairs(fibers * segments))
        << fibers << " x " << segments;
  }
}

/// The lowest node whose first two children have so many leaves each.
template <class Tree>
std::int32_t parentOf(const Tree& tree, std::int32_t leaves) {
  std::int32_t parent = 0;
  const auto child = [&](std::size_t lane) { return tree.node(parent).children[lane]; };
  while (leafCount(tree, child(0)) > leaves) parent = child(0).node();
  EXPECT_EQ(leafCount(tree, child(0)), leaves);
  EXPECT_EQ(leafCount(tree, child(1)), leaves);
  return parent;
}

// The same where a piece of work is larger than the search cuts them: three full levels of eight
// children below both ends, 64 pairs for each pair opened, so that the stack of what waits is full.
TYPED_TEST(SearchTest, DoesAPieceOfAnySize) {
  constexpr std::int32_t kLeaves = 512;
  const TypeParam tree = treeOf<TypeParam>(identical(64, 64));
  const std::int32_t parent = parentOf(tree, kLeaves), slot = TypeParam::kArity * parent;
  const TraversalTask below{tree.node(parent).children[0].node(), 0, 0};
  const TraversalTask between{TraversalTask::kCross, slot, slot + 1};

  const auto expectFound = [&](const TraversalTask& work, std::size_t count) {
    SmallBuffer all;
    EXPECT_EQ(visitOverlaps(tree, work, all), Visit::kContinue);
    all.full();
    const PairList found = asSet(all.found, false);
    EXPECT_FALSE(hasDuplicates(found));
    EXPECT_EQ(found.size(), count);
    for (const std::size_t wanted : {std::size_t{5000}, count - 1}) {
      SmallBuffer some(wanted);
      EXPECT_EQ(visitOverlaps(tree, work, some), Visit::kStop);
      EXPECT_TRUE(std::equal(some.found.begin(), some.found.end(), all.found.begin()));
    }
  };
  for (const std::int64_t target : simd::availableTargets()) {
    const simd::ScopedTarget scoped(target);
    SCOPED_TRACE(simd::targetName(target));
    expectFound(below, kLeaves * (kLeaves - 1) / 2);
    expectFound(between, kLeaves * kLeaves);
  }
}

/// Counts pairs and forgets them.
class CountingBuffer final : public PairBuffer {
 public:
  CountingBuffer() { next_ = pairs_, end_ = pairs_ + kCapacity; }
  Visit full() override {
    count += static_cast<std::size_t>(next_ - pairs_);
    next_ = pairs_;
    return Visit::kContinue;
  }
  std::size_t count = 0;

 private:
  static constexpr std::size_t kCapacity = 1024;
  Pair pairs_[kCapacity + kRoom];
};

// One more level, which would overrun by far what the search has room for.
TYPED_TEST(SearchTest, KeepsItsRoom) {
  constexpr std::int32_t kLeaves = 4096;
  const TypeParam tree = treeOf<TypeParam>(identical(256, 128));
  const std::int32_t slot = TypeParam::kArity * parentOf(tree, kLeaves);
  CountingBuffer between;
  visitOverlaps(tree, TraversalTask{TraversalTask::kCross, slot, slot + 1}, between);
  between.full();
  EXPECT_EQ(between.count, std::size_t{kLeaves} * kLeaves);
}

/// The segments below the child in a slot of the root.
template <class Tree>
std::vector<SegmentId> segmentsBelow(const Tree& tree, std::size_t lane) {
  const Link child = tree.node(0).children[lane];
  if (child.isLeaf()) return {child.segment()};
  const auto& node = tree.node(child.node());
  return {tree.leaves().begin() + node.leaf_begin, tree.leaves().begin() + node.leaf_end};
}

template <class Trees>
std::size_t countBetweenFirstTwo(const Trees& trees) {
  CountingBuffer out;
  EXPECT_EQ(visitOverlaps(trees, TraversalTask{TraversalTask::kCross, 0, 1}, out),
            Visit::kContinue);
  out.full();
  return out.count;
}

// Where a search has no room, it has to keep to the same groups, categories and frames.
TYPED_TEST(SearchTest, HasNoRoomWithGroupsCategoriesAndFrames) {
  FiberScene scene = identical(128, 32);
  std::uint32_t each = 1;
  for (int fiber = 0; fiber < 128; ++fiber, each = each == 8 ? 1 : 2 * each) {
    scene.fibers.groups.push_back(fiber % 3 == 0 ? kNoGroup : fiber % 3);
    const Categories categories = fiber < 96 ? Categories{2, each} : Categories{each, 4};
    scene.fibers.meets.insert(scene.fibers.meets.end(), 32, categories);
  }
  const TypeParam tree = treeOf<TypeParam>(scene);
  const auto first = segmentsBelow(tree, 0), second = segmentsBelow(tree, 1);
  std::size_t of_other_groups = 0, meeting = 0;
  for (const SegmentId a : first) {
    const Group group = scene.fibers.groups[static_cast<std::size_t>(a / 32)];
    const auto [own, met] = scene.fibers.meets[static_cast<std::size_t>(a)];
    meeting += (met & 5u) != 0 && (own & 3u) != 0;
    for (const SegmentId b : second) {
      of_other_groups +=
          group == kNoGroup || group != scene.fibers.groups[static_cast<std::size_t>(b / 32)];
    }
  }
  EXPECT_EQ(countBetweenFirstTwo(tree), of_other_groups);

  const Frame frame{{0, 0, 0}, 1};
  for (const double growth : {0.0, 0.25}) {
    const FrameChange change(frame, frame, growth);
    EXPECT_EQ(countBetweenFirstTwo(TreePair<TypeParam>{tree, tree, change, change}),
              first.size() * second.size());
  }

  const MeshTree triangles = treeOf<MeshTree>(identical(25, 40));
  std::vector<geometry::CapsuleEnd> ends;
  for (const Segment& segment : scene.segments) {
    ends.push_back(firstEndOf(segment));
    ends.push_back(secondEndOf(segment));
  }
  for (const double angle : {0.0, 0.3}) {
    geometry::AffineMap map;
    map.column[0] = {std::cos(angle), std::sin(angle), 0};
    map.column[1] = {-std::sin(angle), std::cos(angle), 0};
    const auto pair = meshPair(tree, triangles, map, 0.5, SegmentRange(ends.data(), 2, 0), {5, 3});
    EXPECT_EQ(countBetweenFirstTwo(pair), meeting * segmentsBelow(triangles, 1).size());
  }
}

// As above, of hair and a scarf that are each in a manager.
TYPED_TEST(SearchTest, FindsAllPairsOfTwoTreesInOnePlace) {
  const TwoTrees<TypeParam> same(identical(5, 120), identical(500, 1));
  const PairList found = asSet(pairsFound<TypeParam>(same.two), true);
  EXPECT_FALSE(hasDuplicates(found));
  EXPECT_EQ(found.size(), 600u * 500u);
}

// Answers would come in another order on another machine.
TYPED_TEST(SearchTest, OrderDoesNotDependOnTheInstructionSet) {
  for (const FiberScene& scene : {curled(), mixed(), many(), identical(4, 150)}) {
    SCOPED_TRACE(scene.name);
    const TypeParam tree = treeOf<TypeParam>(scene);
    const TwoTrees<TypeParam> trees(scene, unequal());
    const PairList self = pairsFound<TypeParam>(tree);
    const PairList two = pairsFound<TypeParam>(trees.two);
    for (const std::int64_t target : simd::availableTargets()) {
      const simd::ScopedTarget scoped(target);
      SCOPED_TRACE(simd::targetName(target));
      EXPECT_TRUE(pairsFound<TypeParam>(tree) == self);
      EXPECT_TRUE(pairsFound<TypeParam>(trees.two) == two);
    }
  }
}

// --- Groups ---

std::vector<Group> groupsBySegment(const FiberScene& scene) {
  std::vector<Group> groups(scene.segments.size());
  for (std::size_t f = 0; f < scene.fibers.groups.size(); ++f) {
    std::fill(groups.begin() + scene.fibers.begin[f], groups.begin() + scene.fibers.begin[f + 1],
              scene.fibers.groups[f]);
  }
  return groups;
}

/// Lowers no limit, and so is brought every pair.
class CollectNearest final : public NearestVisitor {
 public:
  Visit visit(SegmentId a, SegmentId b, double&) override {
    found.emplace_back(a, b);
    return Visit::kContinue;
  }
  PairList found;
};

// Pairs of one group would be reported, or others be lost with them.
TYPED_TEST(SearchTest, LeavesOutPairsOfOneGroupAndNoOthers) {
  for (const FiberScene& plain : {curled(), unequal(), singles(), mixed(), identical(6, 100)}) {
    const PairList all = asSet(pairsFound<TypeParam>(treeOf<TypeParam>(plain)), false);
    for (const FiberScene& scene : grouped(plain)) {
      SCOPED_TRACE(scene.name + ", first group " + std::to_string(scene.fibers.groups[0]));
      const std::vector<Group> groups = groupsBySegment(scene);
      const auto group = [&](SegmentId id) { return groups[static_cast<std::size_t>(id)]; };
      const auto areOne = [&](SegmentId a, SegmentId b) {
        return group(a) != kNoGroup && group(a) == group(b);
      };
      const auto ofTwo = [&](PairList pairs) {
        pairs.erase(
            std::remove_if(pairs.begin(), pairs.end(),
                           [&](const auto& pair) { return areOne(pair.first, pair.second); }),
            pairs.end());
        return pairs;
      };
      const PairList expected = ofTwo(all);
      const TypeParam tree = treeOf<TypeParam>(scene);
      for (const std::int64_t target : simd::availableTargets()) {
        const simd::ScopedTarget scoped(target);
        SCOPED_TRACE(simd::targetName(target));
        const PairList found = pairsFound<TypeParam>(tree);
        EXPECT_TRUE(asSet(found, false) == expected)
            << found.size() << " instead of " << expected.size();
      }

      // Of distances, all pairs; of a scene of few segments, as they are many.
      if (scene.segments.size() > 1000) continue;
      CollectNearest nearest;
      visitNearest(tree, 1e6, nearest);
      EXPECT_TRUE(asSet(nearest.found, false) ==
                  ofTwo(allPairs(static_cast<SegmentId>(scene.segments.size()))));
    }
  }
}

// An object's own group would be reported with it, or others be lost.
TYPED_TEST(SearchTest, LeavesOutTheGroupOfAVolume) {
  const FiberScene plain = curled();
  const TypeParam all = treeOf<TypeParam>(plain);
  for (const FiberScene& scene : grouped(plain)) {
    const std::vector<Group> groups = groupsBySegment(scene);
    const TypeParam tree = treeOf<TypeParam>(scene);
    for (std::size_t i = 0; i < scene.segments.size(); i += 29) {
      const auto volume = TypeParam::Volume::around(scene.segments[i], 0.02);
      for (const Group group : {kNoGroup, Group{-1}, Group{2}, Group{7}, groups[i]}) {
        const auto keepOthers = [&](const PairList& pairs) {
          PairList kept;
          for (const auto& pair : pairs) {
            const Group other = groups[static_cast<std::size_t>(pair.first)];
            if (group == kNoGroup || other != group) kept.push_back(pair);
          }
          return kept;
        };
        EXPECT_EQ(pairsWith(tree, volume, 0, group),
                  keepOthers(pairsWith(all, volume, 0, kNoGroup)));
        CollectNearest far, near;
        visitNearest(all, volume, 0, kNoGroup, 1e6, far);
        visitNearest(tree, volume, 0, group, 1e6, near);
        EXPECT_EQ(near.found, keepOthers(far.found));
      }
    }
  }
}

// A foreign object would meet other fibers on another machine, or more than it asks for.
TYPED_TEST(SearchTest, OrderOfWhatAVolumeOverlapsDoesNotDependOnTheInstructionSet) {
  const FiberScene scene = curled();
  const TypeParam tree = treeOf<TypeParam>(scene);
  std::size_t found = 0;
  for (std::size_t i = 0; i < scene.segments.size(); i += 7) {
    const auto volume = TypeParam::Volume::around(scene.segments[i], 0.02);
    const PairList all = pairsWith(tree, volume, 77, kNoGroup);
    found += all.size();
    for (const std::int64_t target : simd::availableTargets()) {
      const simd::ScopedTarget scoped(target);
      ASSERT_EQ(pairsWith(tree, volume, 77, kNoGroup), all) << simd::targetName(target);
    }
    // The buffer is asked eight pairs at a time at most, and so are those that are left at the end.
    const std::size_t wanted = 1 + i % all.size();
    SmallBuffer some(wanted);
    if (visitOverlaps(tree, volume, 77, kNoGroup, some) == Visit::kContinue) some.full();
    ASSERT_EQ(some.found.size(), wanted);
    EXPECT_TRUE(std::equal(some.found.begin(), some.found.end(), all.begin()));
  }
  EXPECT_GT(found, 1000u);
}

// Volumes in contact would overlap on one machine only. One pack, so that its test decides alone.
TYPED_TEST(SearchTest, TestsOfAPackAreTheSameOnAllInstructionSets) {
  Random random(36);
  std::size_t overlapping = 0, tested = 0;
  for (int round = 0; round < 3000; ++round) {
    FiberScene scene;
    Fibers& fibers = scene.fibers;
    // A node need not be full.
    const int count = 1 + round % TypeParam::kArity;
    for (int i = 0; i < count; ++i) {
      const Vec3d p = inCube(random, 1), q = inCube(random, 1);
      scene.segments.push_back({p, q, 0.1});
      fibers.ids.push_back(static_cast<SegmentId>(i));
      fibers.endFiber();
    }
    const TypeParam tree = treeOf<TypeParam>(scene);
    // In exact contact with the first, as far as floats can be.
    typename TypeParam::Volume volume =
        TypeParam::Volume::around({inCube(random, 1), inCube(random, 1), 0.1}, 0);
    const auto first = tree.pack(0).get(0);
    if constexpr (std::is_same_v<typename TypeParam::Volume, Box>) {
      if (round % 2 == 0) volume.low[round % 3] = first.high[round % 3];
    } else if (round % 2 == 0) {
      const float x = volume.center[0] - first.center[0], y = volume.center[1] - first.center[1],
                  z = volume.center[2] - first.center[2];
      const float gap = std::sqrt(x * x + y * y + z * z) - first.radius;
      if (gap > 0) volume.radius = gap * (1 + 1e-6f * static_cast<float>(random.between(-1, 1)));
    }
    PairList expected;
    bool known = false;
    for (const std::int64_t target : simd::availableTargets()) {
      const simd::ScopedTarget scoped(target);
      const PairList found = pairsWith(tree, volume, 0, kNoGroup);
      if (!known) expected = found;
      known = true;
      ASSERT_EQ(found, expected) << simd::targetName(target);
    }
    overlapping += expected.size();
    tested += static_cast<std::size_t>(count);
  }
  EXPECT_GT(overlapping, tested / 10);
  EXPECT_LT(overlapping, tested * 9 / 10);
}

}  // namespace
}  // namespace fcl_fibers::tree
