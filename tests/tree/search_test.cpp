// SPDX-License-Identifier: BSD-3-Clause
#include "tree/search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "geometry/overlap.h"
#include "parallel/executor.h"
#include "support/random.h"
#include "support/segments.h"
#include "tree/pair_search.h"
#include "tree/plain_traversal.h"

namespace fcl_fibers::tree {
namespace {

using geometry::Box;
using geometry::Frame;
using geometry::FrameChange;
using geometry::Segment;
using geometry::simdTargetsHere;
using geometry::Sphere;
using geometry::Vec3d;
using test::Random;
using PairList = std::vector<std::pair<SegmentId, SegmentId>>;

// --- Scenes ---

struct FiberScene {
  std::string name;
  std::vector<Segment> segments;
  Fibers fibers;
};

Vec3d inCube(Random& random, double half_side) {
  return geometry::fromEigen(random.inCube(half_side));
}

/// A fiber that wanders about and turns back where it leaves the unit ball.
void addFiber(FiberScene& scene, Random& random, int segments, double step, double radius) {
  Vec3d p = inCube(random, 0.7), direction = inCube(random, 1);
  for (int i = 0; i < segments; ++i) {
    direction = direction + inCube(random, 0.6) - 0.3 * p;
    direction = (1 / geometry::norm(direction)) * direction;
    const Vec3d q = p + step * direction;
    scene.fibers.ids.push_back(static_cast<SegmentId>(scene.segments.size()));
    scene.segments.push_back({p, q, radius});
    p = q;
  }
  scene.fibers.endFiber();
}

FiberScene curled() {
  FiberScene scene{"curled", {}, {}};
  Random random(31);
  for (int f = 0; f < 20; ++f) addFiber(scene, random, 60, 0.06, 0.03);
  return scene;
}
FiberScene unequal() {
  FiberScene scene{"unequal", {}, {}};
  Random random(32);
  for (int f = 0; f < 24; ++f) addFiber(scene, random, 1 + f * f % 97, 0.06, 0.03);
  return scene;
}
FiberScene singles() {
  FiberScene scene{"singles", {}, {}};
  Random random(33);
  for (int f = 0; f < 900; ++f) addFiber(scene, random, 1, 0.1, 0.04);
  return scene;
}
FiberScene mixed() {
  FiberScene scene{"mixed", {}, {}};
  Random random(34);
  for (int f = 0; f < 300; ++f) {
    addFiber(scene, random, f % 50 == 7 ? 200 : 1, 0.06, f % 3 == 0 ? 0.1 : 0.01);
  }
  return scene;
}
/// So many that work comes in more pieces than are done at once.
FiberScene many() {
  FiberScene scene{"many", {}, {}};
  Random random(35);
  for (int f = 0; f < 64; ++f) addFiber(scene, random, 250, 0.03, 0.01);
  return scene;
}
/// All of them in one place: every volume overlaps every other one.
FiberScene identical(int fibers, int segments) {
  FiberScene scene{"identical", {}, {}};
  for (int f = 0; f < fibers; ++f) {
    for (int i = 0; i < segments; ++i) {
      scene.fibers.ids.push_back(static_cast<SegmentId>(scene.segments.size()));
      scene.segments.push_back({{0.1, 0.2, 0.3}, {0.4, 0.5, 0.6}, 0.1});
    }
    scene.fibers.endFiber();
  }
  return scene;
}

// --- Trees ---

template <class Tree>
Tree treeOf(const FiberScene& scene, double padding = 0.001) {
  Tree tree = [&] {
    if constexpr (Tree::kArity == 2) {
      return Tree(superThread(scene.fibers));
    } else {
      return Tree(bundle(scene.fibers, scene.segments));
    }
  }();
  tree.refit(scene.segments, padding);
  return tree;
}

FiberScene inFrame(const FiberScene& world, const Frame& frame) {
  FiberScene local = world;
  for (Segment& s : local.segments) {
    s = {frame.fromWorld(s.a), frame.fromWorld(s.b), frame.scale * s.radius};
  }
  return local;
}

/// Two trees in frames of their own.
template <class Tree>
struct TwoTrees {
  TwoTrees(const FiberScene& world_a, const FiberScene& world_b)
      : a(treeOf<Tree>(inFrame(world_a, here))), b(treeOf<Tree>(inFrame(world_b, there))) {}

  Frame here{{0.1, -0.3, 0.7}, 4}, there{{-30, 20, 0.1}, 0.0625};
  Tree a, b;
  FrameChange b_to_a{there, here}, a_to_b{here, there};
  typename Search<Tree>::Two two{a, b, b_to_a, a_to_b};
};

// --- Answers ---

class CollectRuns final : public PairSink {
 public:
  explicit CollectRuns(std::size_t wanted = SIZE_MAX) : wanted_(wanted) {}

  Visit take(const Pair* pairs, std::size_t count) override {
    EXPECT_LT(found.size(), wanted_) << "asked again after the end";
    EXPECT_GT(count, 0u);
    for (std::size_t i = 0; i < count; ++i) {
      found.emplace_back(pairs[i].a, pairs[i].b);
      if (found.size() == wanted_) return Visit::kStop;
    }
    return Visit::kContinue;
  }
  PairList found;

 private:
  std::size_t wanted_;
};

template <class Tree, class Trees>
PairList pairsFound(const Trees& trees, parallel::Executor* executor = nullptr) {
  CollectRuns sink;
  SearchScratch scratch;
  EXPECT_EQ(findPairs<Tree>(trees, nullptr, executor, scratch, sink), Visit::kContinue);
  return sink.found;
}

struct CollectPlainly : plain::OverlapVisitor {
  static constexpr SegmentId kVolume = 77;  ///< stands for the volume that leaves meet
  PairList found;
  Visit leafPair(SegmentId a, SegmentId b) override {
    found.emplace_back(a, b);
    return Visit::kContinue;
  }
  Visit leaf(SegmentId a) override { return leafPair(a, kVolume); }
};

/// Without an order, and of one tree's pairs without a first and a second.
PairList asSet(PairList pairs, bool ordered) {
  for (auto& pair : pairs) {
    if (!ordered && pair.first > pair.second) std::swap(pair.first, pair.second);
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}
bool hasDuplicates(const PairList& set) {
  return std::adjacent_find(set.begin(), set.end()) != set.end();
}
PairList difference(const PairList& a, const PairList& b) {
  PairList result;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(result));
  return result;
}

PairList allPairs(SegmentId segments) {
  PairList all;
  for (SegmentId a = 0; a < segments; ++a) {
    for (SegmentId b = a + 1; b < segments; ++b) all.emplace_back(a, b);
  }
  return all;
}

/// Whether volumes touch within the rounding of a change of frame: floats of some thirty units.
template <class Volume>
bool barelyTouch(const Segment& p, const Segment& q) {
  const auto overlap = [&](double padding) {
    typename Volume::template Pack<2> pack;
    pack.set(0, Volume::around(p, padding));
    return (overlaps(pack, Volume::around(q, 0)) & 1u) != 0;
  };
  // The trees pad by 0.001 of their own units, of 1/4 and 16.
  constexpr double kPadding = 0.00025 + 0.016, kRounding = 1e-4;
  return overlap(kPadding + kRounding) && !overlap(kPadding - kRounding);
}

template <class Tree>
class SearchTest : public testing::Test {};

struct TreeNames {
  template <class Tree>
  static std::string GetName(int) {
    return std::string(std::is_same_v<typename Tree::Volume, Box> ? "LayeredBoxes"
                                                                  : "WrappedSpheres") +
           std::to_string(Tree::kArity);
  }
};
using Trees = testing::Types<LayeredBoxTree<2>, LayeredBoxTree<8>, WrappedSphereTree<2>,
                             WrappedSphereTree<8>>;
TYPED_TEST_SUITE(SearchTest, Trees, TreeNames);

// Pairs would be missed, invented or repeated.
TYPED_TEST(SearchTest, FindsThePairsOfThePlainTraversal) {
  for (const FiberScene& scene :
       {curled(), unequal(), singles(), mixed(), many(), identical(4, 250)}) {
    SCOPED_TRACE(scene.name);
    const TypeParam tree = treeOf<TypeParam>(scene);
    CollectPlainly plain;
    visitPairs(tree, plain);
    const PairList found = asSet(pairsFound<TypeParam>(tree), false);
    EXPECT_FALSE(hasDuplicates(found));
    EXPECT_GT(found.size(), scene.segments.size() / 2) << "a scene where nothing meets";
    EXPECT_TRUE(found == asSet(plain.found, false))
        << found.size() << " instead of " << plain.found.size();
  }
}

// Segments in one place, a fiber that was never laid out for instance, would overrun what the
// search keeps waiting.
TYPED_TEST(SearchTest, FindsAllPairsOfSegmentsInOnePlace) {
  for (const auto& [fibers, segments] : {std::pair(1, 600), {600, 1}, {20, 60}, {7, 131}}) {
    const TypeParam tree = treeOf<TypeParam>(identical(fibers, segments));
    EXPECT_TRUE(asSet(pairsFound<TypeParam>(tree), false) == allPairs(fibers * segments))
        << fibers << " x " << segments;
  }
}

/// Takes everything, eight pairs at a time.
class SmallBuffer final : public PairBuffer {
 public:
  explicit SmallBuffer(std::size_t wanted = SIZE_MAX) : wanted_(wanted) { restart(); }
  Visit full() override {
    for (const Pair* pair = pairs_; pair != next_ && found.size() < wanted_; ++pair) {
      found.emplace_back(pair->a, pair->b);
    }
    restart();
    return found.size() < wanted_ ? Visit::kContinue : Visit::kStop;
  }
  PairList found;

 private:
  void restart() {
    next_ = pairs_;
    end_ = pairs_ + 1;
  }
  std::size_t wanted_;
  Pair pairs_[1 + kRoom];
};

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
  const Work below{tree.node(parent).children[0].node(), 0, 0};
  const Work between{Work::kBetween, slot, slot + 1};

  const auto expectFound = [&](const Work& work, std::size_t count) {
    SmallBuffer all;
    EXPECT_EQ(Search<TypeParam>::overlaps(tree, work, all), Visit::kContinue);
    all.full();
    const PairList found = asSet(all.found, false);
    EXPECT_FALSE(hasDuplicates(found));
    EXPECT_EQ(found.size(), count);
    for (const std::size_t wanted : {std::size_t{5000}, count - 1}) {
      SmallBuffer some(wanted);
      EXPECT_EQ(Search<TypeParam>::overlaps(tree, work, some), Visit::kStop);
      EXPECT_TRUE(std::equal(some.found.begin(), some.found.end(), all.found.begin()));
    }
  };
  for (const std::int64_t target : simdTargetsHere()) {
    const geometry::ScopedSimdTarget scoped(target);
    SCOPED_TRACE(geometry::simdTargetName(target));
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
  Search<TypeParam>::overlaps(tree, Work{Work::kBetween, slot, slot + 1}, between);
  between.full();
  EXPECT_EQ(between.count, std::size_t{kLeaves} * kLeaves);
}

// Hair and a scarf, each in a manager: as above.
TYPED_TEST(SearchTest, FindsThePairsOfTwoTreesInDifferentFrames) {
  const std::vector<std::pair<FiberScene, FiberScene>> scenes = {
      {curled(), unequal()}, {mixed(), singles()}, {many(), mixed()}};
  for (const auto& [world_a, world_b] : scenes) {
    SCOPED_TRACE(world_a.name + ", " + world_b.name);
    const TwoTrees<TypeParam> trees(world_a, world_b);
    CollectPlainly plain;
    visitPairs(trees.a, trees.b, trees.b_to_a, trees.a_to_b, plain);
    const PairList found = asSet(pairsFound<TypeParam>(trees.two), true);
    EXPECT_FALSE(hasDuplicates(found));
    EXPECT_GT(found.size(), 1000u);
    // Which volume is brought into whose frame may differ, and so the last bit.
    for (const auto& [a, b] : difference(found, asSet(plain.found, true))) {
      EXPECT_TRUE(
          barelyTouch<typename TypeParam::Volume>(world_a.segments[static_cast<std::size_t>(a)],
                                                  world_b.segments[static_cast<std::size_t>(b)]))
          << a << ", " << b;
    }
  }
  const TwoTrees<TypeParam> same(identical(5, 120), identical(500, 1));
  const PairList found = asSet(pairsFound<TypeParam>(same.two), true);
  EXPECT_FALSE(hasDuplicates(found));
  EXPECT_EQ(found.size(), 600u * 500u);
}

// Answers would come in another order on another machine, or from one run to the next.
TYPED_TEST(SearchTest, OrderDependsNeitherOnInstructionSetNorOnThreads) {
  std::vector<std::unique_ptr<parallel::Executor>> executors;
  for (const int threads : {1, 2, 3, 8}) executors.push_back(parallel::makeExecutor(threads));
  for (const FiberScene& scene : {curled(), mixed(), many(), identical(4, 150)}) {
    SCOPED_TRACE(scene.name);
    const TypeParam tree = treeOf<TypeParam>(scene);
    const TwoTrees<TypeParam> trees(scene, unequal());
    const PairList self = pairsFound<TypeParam>(tree);
    const PairList two = pairsFound<TypeParam>(trees.two);
    for (const std::int64_t target : simdTargetsHere()) {
      const geometry::ScopedSimdTarget scoped(target);
      SCOPED_TRACE(geometry::simdTargetName(target));
      for (const auto& executor : executors) {
        EXPECT_TRUE(pairsFound<TypeParam>(tree, executor.get()) == self);
        EXPECT_TRUE(pairsFound<TypeParam>(trees.two, executor.get()) == two);
      }
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

/// The same scene with groups of every kind: none, large, of one fiber, all in one.
std::vector<FiberScene> grouped(const FiberScene& scene) {
  const std::size_t fibers = scene.fibers.begin.size() - 1;
  std::vector<FiberScene> all(4, scene);
  Random random(61);
  for (std::size_t f = 0; f < fibers; ++f) {
    all[0].fibers.groups.push_back(static_cast<Group>(random.below(5)) - 2);
    all[1].fibers.groups.push_back(static_cast<Group>(f + 1));
    all[2].fibers.groups.push_back(f == fibers / 3 ? kNoGroup : 7);
    all[3].fibers.groups.push_back(-1);
  }
  return all;
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
  const auto executor = parallel::makeExecutor(2);
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
      for (const std::int64_t target : simdTargetsHere()) {
        const geometry::ScopedSimdTarget scoped(target);
        SCOPED_TRACE(geometry::simdTargetName(target));
        const PairList found = pairsFound<TypeParam>(tree);
        EXPECT_TRUE(asSet(found, false) == expected)
            << found.size() << " instead of " << expected.size();
        EXPECT_TRUE(pairsFound<TypeParam>(tree, executor.get()) == found);
      }

      // Of distances, all pairs; of a scene of few segments, as they are many.
      if (scene.segments.size() > 1000) continue;
      CollectNearest nearest;
      Search<TypeParam>::nearest(tree, 1e6, nearest);
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
        CollectRuns unfiltered, found;
        findPairs(all, volume, 0, kNoGroup, nullptr, unfiltered);
        findPairs(tree, volume, 0, group, nullptr, found);
        EXPECT_EQ(found.found, keepOthers(unfiltered.found));
        CollectNearest far, near;
        Search<TypeParam>::nearest(all, volume, 0, kNoGroup, 1e6, far);
        Search<TypeParam>::nearest(tree, volume, 0, group, 1e6, near);
        EXPECT_EQ(near.found, keepOthers(far.found));
      }
    }
  }
}

class CountPieces final : public WorkSink {
 public:
  Visit take(const Work&) override {
    ++count;
    return Visit::kContinue;
  }
  std::size_t count = 0;
};

// The tests above would not see what happens at the window's end.
TYPED_TEST(SearchTest, ManyPiecesAreMoreThanOneWindow) {
  CountPieces pieces;
  Search<TypeParam>::cut(treeOf<TypeParam>(many()), pieces);
  EXPECT_GT(pieces.count, 4u + 8 + 16 + 32 + 64 + 128 + 256);
}

// Whoever wants the first contact would get another one with threads, or more than asked for.
TYPED_TEST(SearchTest, StopsAfterTheFirstPairs) {
  std::vector<std::unique_ptr<parallel::Executor>> executors;
  for (const int threads : {1, 2, 3, 8}) executors.push_back(parallel::makeExecutor(threads));
  const TypeParam tree = treeOf<TypeParam>(many());
  const TwoTrees<TypeParam> trees(many(), curled());
  const auto expectPrefixes = [&](const auto& what) {
    const PairList all = pairsFound<TypeParam>(what);
    ASSERT_GT(all.size(), 3000u);
    for (const std::size_t wanted :
         {std::size_t{1}, std::size_t{2}, std::size_t{17}, all.size() - 1, all.size()}) {
      for (const auto& executor : executors) {
        CollectRuns sink(wanted);
        SearchScratch scratch;
        EXPECT_EQ(findPairs<TypeParam>(what, nullptr, executor.get(), scratch, sink), Visit::kStop);
        ASSERT_EQ(sink.found.size(), wanted);
        EXPECT_TRUE(std::equal(sink.found.begin(), sink.found.end(), all.begin())) << wanted;
      }
    }
  };
  expectPrefixes(tree);
  expectPrefixes(trees.two);
}

// Threads would go on searching what nobody asks for any more.
TYPED_TEST(SearchTest, NothingIsSearchedAfterTheEnd) {
  struct ForegroundFirst : parallel::Executor {
    void parallelForWithForeground(parallel::FunctionRef<> foreground, int count,
                                   parallel::FunctionRef<int> task) override {
      foreground();
      for (int i = 0; i < count; ++i) task(i);
    }
  } executor;
  CollectRuns sink(1);
  SearchScratch scratch;
  EXPECT_EQ(findPairs<TypeParam>(treeOf<TypeParam>(many()), nullptr, &executor, scratch, sink),
            Visit::kStop);
  std::array<std::ptrdiff_t, 2> searched;
  std::transform(scratch.windows.begin(), scratch.windows.end(), searched.begin(),
                 [](const SearchScratch::Window& window) {
                   return std::count_if(window.pieces.begin(), window.pieces.end(),
                                        [](const auto& piece) { return piece.pairs() != nullptr; });
                 });
  EXPECT_GT(std::max(searched[0], searched[1]), 0);
  EXPECT_EQ(std::min(searched[0], searched[1]), 0) << "the window after the one with the pair";
}

// The user's error would be lost, or pairs be handed on after it.
TYPED_TEST(SearchTest, WhatASinkThrowsIsThrown) {
  class Thrower final : public PairSink {
   public:
    explicit Thrower(std::size_t at) : at_(at) {}
    Visit take(const Pair*, std::size_t count) override {
      EXPECT_LE(taken_, at_) << "asked again after it threw";
      taken_ += count;
      if (taken_ > at_) throw at_;
      return Visit::kContinue;
    }

   private:
    std::size_t at_, taken_ = 0;
  };
  const TypeParam tree = treeOf<TypeParam>(many());
  const PairList all = pairsFound<TypeParam>(tree);
  SearchScratch scratch;
  for (const int threads : {2, 3, 8}) {
    const auto executor = parallel::makeExecutor(threads);
    for (const std::size_t at : {std::size_t{0}, all.size() / 2, all.size() - 1}) {
      Thrower thrower(at);
      EXPECT_THROW(findPairs<TypeParam>(tree, nullptr, executor.get(), scratch, thrower),
                   std::size_t);
      CollectRuns whole;
      findPairs<TypeParam>(tree, nullptr, executor.get(), scratch, whole);
      EXPECT_TRUE(whole.found == all) << "after that";
    }
  }
}

// What one query left behind would show in the next.
TYPED_TEST(SearchTest, ScratchMayBeUsedAgain) {
  const auto executor = parallel::makeExecutor(2);
  const TypeParam large = treeOf<TypeParam>(many()), small = treeOf<TypeParam>(unequal());
  SearchScratch scratch;
  for (const TypeParam* tree : {&large, &small, &large}) {
    CollectRuns stopped(17), whole;
    findPairs<TypeParam>(*tree, nullptr, executor.get(), scratch, stopped);
    findPairs<TypeParam>(*tree, nullptr, executor.get(), scratch, whole);
    EXPECT_TRUE(whole.found == pairsFound<TypeParam>(*tree));
  }
}

// A foreign object would miss fibers, or meet others on another machine.
TYPED_TEST(SearchTest, FindsWhatAVolumeOverlaps) {
  const FiberScene scene = curled();
  const TypeParam tree = treeOf<TypeParam>(scene);
  std::size_t found = 0;
  for (std::size_t i = 0; i < scene.segments.size(); i += 7) {
    const auto volume = TypeParam::Volume::around(scene.segments[i], 0.02);
    CollectPlainly plain;
    visitLeaves(tree, volume, plain);
    found += plain.found.size();
    for (const std::int64_t target : simdTargetsHere()) {
      const geometry::ScopedSimdTarget scoped(target);
      CollectRuns sink;
      EXPECT_EQ(findPairs(tree, volume, CollectPlainly::kVolume, kNoGroup, nullptr, sink),
                Visit::kContinue);
      ASSERT_EQ(sink.found, plain.found) << geometry::simdTargetName(target);
    }
    const std::size_t wanted = 1 + i % plain.found.size();
    CollectRuns some(wanted);
    EXPECT_EQ(findPairs(tree, volume, CollectPlainly::kVolume, kNoGroup, nullptr, some),
              Visit::kStop);
    ASSERT_EQ(some.found.size(), wanted);
    EXPECT_TRUE(std::equal(some.found.begin(), some.found.end(), plain.found.begin()));
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
    for (const std::int64_t target : simdTargetsHere()) {
      const geometry::ScopedSimdTarget scoped(target);
      CollectRuns sink;
      findPairs(tree, volume, 0, kNoGroup, nullptr, sink);
      if (!known) expected = sink.found;
      known = true;
      ASSERT_EQ(sink.found, expected) << geometry::simdTargetName(target);
    }
    overlapping += expected.size();
    tested += static_cast<std::size_t>(count);
  }
  EXPECT_GT(overlapping, tested / 10);
  EXPECT_LT(overlapping, tested * 9 / 10);
}

// A manager with no objects or one would crash.
TYPED_TEST(SearchTest, FindsNothingWhereThereIsNothing) {
  // So thick that some of the curled segments touch it.
  FiberScene one{"one", {{{0, 0, 0}, {0.1, 0, 0}, 0.3}}, {}};
  one.fibers.ids = {0};
  one.fibers.endFiber();
  const auto executor = parallel::makeExecutor(2);
  for (parallel::Executor* const threads :
       {static_cast<parallel::Executor*>(nullptr), executor.get()}) {
    for (const FiberScene& scene : {FiberScene{"none", {}, {}}, one}) {
      const TypeParam tree = treeOf<TypeParam>(scene);
      EXPECT_TRUE(pairsFound<TypeParam>(tree, threads).empty());
      for (const FiberScene& other : {FiberScene{"none", {}, {}}, curled()}) {
        const TwoTrees<TypeParam> trees(scene, other), swapped(other, scene);
        const bool any = !scene.segments.empty() && !other.segments.empty();
        EXPECT_EQ(pairsFound<TypeParam>(trees.two, threads).empty(), !any);
        EXPECT_EQ(pairsFound<TypeParam>(swapped.two, threads).empty(), !any);
      }
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::tree
