// SPDX-License-Identifier: BSD-3-Clause
#include "index/pair_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "geometry/touch.h"
#include "index/hull_filter.h"
#include "index/kept_segments.h"
#include "parallel/executor.h"
#include "support/random.h"
#include "support/segments.h"
#include "tree/search_scenes.h"

namespace fcl_fibers::index {
namespace {

using namespace tree;  // NOLINT: its search is what is searched with
using geometry::Frame;
using geometry::FrameChange;
using geometry::Segment;
using geometry::Vec3d;
using test::Random;

/// A search of trees that counts the tasks it has run.
template <class Tree, class Trees>
class TreeSearch final : public PairSearch {
 public:
  explicit TreeSearch(const Trees& trees) : trees_(trees) {}
  Visit split(TaskSink& out) const override { return splitIntoTasks(trees_, out); }
  Visit run(const TraversalTask& task, PairBuffer& out) const override {
    ++tasks;
    return visitOverlaps(trees_, task, out);
  }
  mutable std::atomic<std::size_t> tasks{0};

 private:
  const Trees& trees_;
};

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

using SegmentFilter = HullFilter<SegmentRange, SegmentHulls<SegmentRange>>;

template <class Tree, class Trees>
PairList pairsFound(const Trees& trees, parallel::Executor* executor = nullptr,
                    const SegmentFilter* filter = nullptr) {
  CollectRuns sink;
  ScratchPool scratch;
  EXPECT_EQ(findPairs(TreeSearch<Tree, Trees>(trees), filter, executor, scratch, sink),
            Visit::kContinue);
  return sink.found;
}

std::vector<std::unique_ptr<parallel::Executor>> someExecutors() {
  std::vector<std::unique_ptr<parallel::Executor>> executors;
  for (const int threads : {1, 2, 3, 8}) executors.push_back(parallel::makeExecutor(threads));
  return executors;
}

template <class Tree>
class PairSearchTest : public testing::Test {};
TYPED_TEST_SUITE(PairSearchTest, SearchedTrees, TreeNames);

class CountTasks final : public TaskSink {
 public:
  Visit take(const TraversalTask&) override {
    ++count;
    return Visit::kContinue;
  }
  std::size_t count = 0;
};

// The tests below would not see what happens at the window's end.
TYPED_TEST(PairSearchTest, ManyTasksAreMoreThanOneWindow) {
  CountTasks tasks;
  splitIntoTasks(treeOf<TypeParam>(many()), tasks);
  EXPECT_GT(tasks.count, 4u + 8 + 16 + 32 + 64 + 128 + 256);
}

// Answers would come in another order from one run to the next, or pairs be lost between threads.
TYPED_TEST(PairSearchTest, OrderDoesNotDependOnThreads) {
  const auto executors = someExecutors();
  std::vector<FiberScene> scenes{curled(), mixed(), many(), identical(4, 150)};
  for (const FiberScene& scene : grouped(unequal())) scenes.push_back(scene);
  for (const FiberScene& scene : scenes) {
    SCOPED_TRACE(scene.name);
    const TypeParam tree = treeOf<TypeParam>(scene);
    const TwoTrees<TypeParam> trees(scene, unequal());
    const PairList self = pairsFound<TypeParam>(tree);
    const PairList two = pairsFound<TypeParam>(trees.two);
    for (const auto& executor : executors) {
      EXPECT_TRUE(pairsFound<TypeParam>(tree, executor.get()) == self);
      EXPECT_TRUE(pairsFound<TypeParam>(trees.two, executor.get()) == two);
    }
  }
  EXPECT_TRUE(asSet(pairsFound<TypeParam>(treeOf<TypeParam>(identical(4, 150))), false) ==
              allPairs(600));
}

// Whoever wants the first contact would get another one with threads, or more than asked for.
TYPED_TEST(PairSearchTest, StopsAfterTheFirstPairs) {
  const auto executors = someExecutors();
  const TypeParam tree = treeOf<TypeParam>(many());
  const TwoTrees<TypeParam> trees(many(), curled());
  const auto expectPrefixes = [&](const auto& what) {
    using What = std::decay_t<decltype(what)>;
    const PairList all = pairsFound<TypeParam>(what);
    ASSERT_GT(all.size(), 3000u);
    for (const std::size_t wanted :
         {std::size_t{1}, std::size_t{2}, std::size_t{17}, all.size() - 1, all.size()}) {
      for (const auto& executor : executors) {
        CollectRuns sink(wanted);
        ScratchPool scratch;
        EXPECT_EQ(
            findPairs(TreeSearch<TypeParam, What>(what), nullptr, executor.get(), scratch, sink),
            Visit::kStop);
        ASSERT_EQ(sink.found.size(), wanted);
        EXPECT_TRUE(std::equal(sink.found.begin(), sink.found.end(), all.begin())) << wanted;
      }
    }
  };
  expectPrefixes(tree);
  expectPrefixes(trees.two);
}

// Threads would go on searching what nobody asks for any more.
TYPED_TEST(PairSearchTest, NothingIsSearchedAfterTheEnd) {
  struct ForegroundFirst : parallel::Executor {
    void parallelForWithForeground(parallel::FunctionRef<> foreground, int count,
                                   parallel::FunctionRef<int> task) override {
      foreground();
      for (int i = 0; i < count; ++i) task(i);
    }
  } executor;
  const TypeParam tree = treeOf<TypeParam>(many());
  for (parallel::Executor* const threads :
       {static_cast<parallel::Executor*>(nullptr), static_cast<parallel::Executor*>(&executor)}) {
    const TreeSearch<TypeParam, TypeParam> search(tree);
    struct StopAtOnce final : PairSink {
      explicit StopAtOnce(const std::atomic<std::size_t>& all_tasks) : tasks(all_tasks) {}
      Visit take(const Pair*, std::size_t) override {
        at_end = tasks;
        return Visit::kStop;
      }
      const std::atomic<std::size_t>& tasks;
      std::size_t at_end = 0;
    } sink(search.tasks);
    ScratchPool scratch;
    EXPECT_EQ(findPairs(search, nullptr, threads, scratch, sink), Visit::kStop);
    EXPECT_GT(sink.at_end, 0u);
    EXPECT_LT(sink.at_end, 100u) << "of some thousand";
    EXPECT_EQ(search.tasks, sink.at_end);
  }
}

// The user's error would be lost, or pairs be handed on after it.
TYPED_TEST(PairSearchTest, WhatASinkThrowsIsThrown) {
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
  const TreeSearch<TypeParam, TypeParam> search(tree);
  const PairList all = pairsFound<TypeParam>(tree);
  ScratchPool scratch;
  for (const int threads : {1, 2, 3, 8}) {
    const auto executor = parallel::makeExecutor(threads);
    for (const std::size_t at : {std::size_t{0}, all.size() / 2, all.size() - 1}) {
      Thrower thrower(at);
      EXPECT_THROW(findPairs(search, nullptr, executor.get(), scratch, thrower), std::size_t);
      CollectRuns whole;
      findPairs(search, nullptr, executor.get(), scratch, whole);
      EXPECT_TRUE(whole.found == all) << "after that";
    }
  }
}

// A manager with no objects or one would crash.
TYPED_TEST(PairSearchTest, FindsNothingWhereThereIsNothing) {
  // So thick that some of the curled segments touch it.
  FiberScene one{"one", {{{0, 0, 0}, {0.1, 0, 0}, 0.3}}, {}};
  one.fibers.ids = {0};
  one.fibers.endFiber();
  const auto executor = parallel::makeExecutor(2);
  for (parallel::Executor* const threads :
       {static_cast<parallel::Executor*>(nullptr), executor.get()}) {
    for (const FiberScene& scene : {FiberScene{"none", {}, {}}, one}) {
      EXPECT_TRUE(pairsFound<TypeParam>(treeOf<TypeParam>(scene), threads).empty());
      for (const FiberScene& other : {FiberScene{"none", {}, {}}, curled()}) {
        const TwoTrees<TypeParam> trees(scene, other), swapped(other, scene);
        const bool any = !scene.segments.empty() && !other.segments.empty();
        EXPECT_EQ(pairsFound<TypeParam>(trees.two, threads).empty(), !any);
        EXPECT_EQ(pairsFound<TypeParam>(swapped.two, threads).empty(), !any);
      }
    }
  }
}

// --- Scratch ---

// What one query left behind would show in the next.
TYPED_TEST(PairSearchTest, ScratchMayBeUsedAgain) {
  const auto executor = parallel::makeExecutor(2);
  const TypeParam large = treeOf<TypeParam>(many()), small = treeOf<TypeParam>(unequal());
  ScratchPool scratch;
  for (const TypeParam* tree : {&large, &small, &large}) {
    const TreeSearch<TypeParam, TypeParam> search(*tree);
    CollectRuns stopped(17), whole;
    findPairs(search, nullptr, executor.get(), scratch, stopped);
    findPairs(search, nullptr, executor.get(), scratch, whole);
    EXPECT_TRUE(whole.found == pairsFound<TypeParam>(*tree));
  }
}

// Each query would allocate anew; or one dense query cost its memory for good.
TYPED_TEST(PairSearchTest, AQueryLeavesNoMoreToTheNextThanItMay) {
  const auto executor = parallel::makeExecutor(2);
  ScratchPool scratch;
  EXPECT_EQ(scratch.memoryUsage(), 0u);
  CollectRuns few, many_pairs;
  const TypeParam sparse = treeOf<TypeParam>(curled()),
                  dense = treeOf<TypeParam>(identical(50, 40));
  findPairs(TreeSearch<TypeParam, TypeParam>(sparse), nullptr, nullptr, scratch, few);
  EXPECT_EQ(scratch.memoryUsage(), 0u) << "one thread needs none";
  findPairs(TreeSearch<TypeParam, TypeParam>(sparse), nullptr, executor.get(), scratch, few);
  EXPECT_GT(scratch.memoryUsage(), few.found.size() / 2 * sizeof(Pair) / 2);
  findPairs(TreeSearch<TypeParam, TypeParam>(dense), nullptr, executor.get(), scratch, many_pairs);
  EXPECT_GT(many_pairs.found.size() * sizeof(Pair), std::size_t{1} << 23);
  EXPECT_LE(scratch.memoryUsage(), std::size_t{1} << 22);
  for (const std::size_t most : {std::size_t{100000}, std::size_t{100}}) {
    scratch.keepAtMost(most);
    CollectRuns again;
    findPairs(TreeSearch<TypeParam, TypeParam>(dense), nullptr, executor.get(), scratch, again);
    EXPECT_EQ(again.found.size(), many_pairs.found.size());
    EXPECT_LE(scratch.memoryUsage(), most);
  }
  scratch.clear();
  EXPECT_EQ(scratch.memoryUsage(), 0u);
}

// Two queries at a time would write over each other's pairs, or memory pile up with them.
TEST(ScratchPool, LendsEachItsOwnAndKeepsOne) {
  ScratchPool pool;
  const SearchScratch* kept;
  {
    const ScratchPool::Lease first(pool);
    const ScratchPool::Lease second(pool);
    EXPECT_NE(&*first, &*second);
    (*first).windows[0].tasks.reserve(10000);
    (*second).windows[0].tasks.reserve(10000);
    EXPECT_EQ(pool.memoryUsage(), 0u) << "of what is lent out";
    kept = &*first;  // is given back last
  }
  EXPECT_GE(pool.memoryUsage(), 10000 * sizeof(TraversalTask));
  EXPECT_LT(pool.memoryUsage(), 15000 * sizeof(TraversalTask));
  const ScratchPool::Lease again(pool);
  EXPECT_EQ(&*again, kept);
}

// --- The filter ---

KeptSegments kept(const FiberScene& scene, SegmentId first = 0) {
  KeptSegments segments(/*share_ends=*/false);
  const auto end = first + static_cast<SegmentId>(scene.segments.size());
  segments.reset(first, end, {});
  for (SegmentId id = first; id < end; ++id) {
    segments.set(id, scene.segments[static_cast<std::size_t>(id - first)]);
  }
  return segments;
}

// Capsules would be reported that are apart, or others lost, or come in another order.
TYPED_TEST(PairSearchTest, TheFilterKeepsThePairsThatTouchInTheirOrder) {
  const auto executors = someExecutors();
  FiberScene scene = curled();
  scene.segments[77] = Segment::box({-0.3, -0.3, -0.3}, {0.2, 0.1, 0.4});
  const TwoTrees<TypeParam> trees(scene, unequal());
  const FiberScene a = inFrame(scene, trees.here), b = inFrame(unequal(), trees.there);
  const double margin = 0.002;  // in a's frame

  const TypeParam tree = treeOf<TypeParam>(a, margin / 2);
  const KeptSegments of_a = kept(a), of_b = kept(b);
  const SegmentFilter within(of_a.range(), {of_a.range()}, margin, 4);
  const SegmentFilter between(of_a.range(), {of_b.range(), &trees.b_to_a}, margin, 4);
  const auto at = [](const FiberScene& in, SegmentId id) {
    return in.segments[static_cast<std::size_t>(id)];
  };
  const auto expectKept = [&](const auto& what, const SegmentFilter& filter, auto&& touches) {
    PairList expected = pairsFound<TypeParam>(what);
    const std::size_t before = expected.size();
    expected.erase(
        std::remove_if(expected.begin(), expected.end(),
                       [&](const auto& pair) { return !touches(pair.first, pair.second); }),
        expected.end());
    EXPECT_GT(expected.size(), 300u);
    EXPECT_LT(expected.size(), before);
    for (const auto& executor : executors) {
      EXPECT_TRUE(pairsFound<TypeParam>(what, executor.get(), &filter) == expected);
    }
  };
  const auto touchingInA = [&](SegmentId i, SegmentId j) {
    const Segment p = at(a, i), q = at(a, j);
    return touch(p, q, margin, endPointError(p) + endPointError(q));
  };
  expectKept(tree, within, touchingInA);
  expectKept(trees.two, between, [&](SegmentId i, SegmentId j) {
    const Segment p = at(a, i), q = trees.b_to_a(at(b, j));
    return touch(p, q, margin, endPointError(p) + trees.b_to_a.error(q));
  });

  // With one bound for the errors of all end points. Only a bound that is too wide would show.
  SegmentRange bounded = of_a.range();
  bounded.setMostError(1e-14);
  expectKept(tree, SegmentFilter(bounded, {bounded}, margin, 4), touchingInA);

  // Of ids that do not start at 0.
  std::vector<Pair> pairs;
  for (const auto& [i, j] : pairsFound<TypeParam>(tree)) pairs.push_back({i + 1000, j + 3000});
  const KeptSegments from_1000 = kept(a, 1000), from_3000 = kept(a, 3000);
  const SegmentFilter shifted(from_1000.range(), {from_3000.range()}, margin, 4);
  std::vector<geometry::Impact> impacts;
  const std::size_t kept = shifted.keep(pairs.data(), pairs.size(), impacts);
  const PairList expected = pairsFound<TypeParam>(tree, nullptr, &within);
  ASSERT_EQ(kept, expected.size());
  for (std::size_t i = 0; i < kept; ++i) {
    EXPECT_EQ(pairs[i].a, expected[i].first + 1000);
    EXPECT_EQ(pairs[i].b, expected[i].second + 3000);
  }
}

// A query with one object that wants the first contact only would wait for all of them, or a dense
// one overrun the stack.
TYPED_TEST(PairSearchTest, OneVolumeIsSearchedWithABufferOnTheStack) {
  for (const FiberScene& scene : {curled(), identical(60, 60)}) {
    const TypeParam tree = treeOf<TypeParam>(scene);
    const auto volume = TypeParam::Volume::around(scene.segments[11], 0.02);
    const auto search = [&](CollectRuns& sink) {
      SerialBuffer buffer(nullptr, sink);
      return visitOverlaps(tree, volume, 77, kNoGroup, buffer) == Visit::kStop ? Visit::kStop
                                                                               : buffer.full();
    };
    CollectRuns all;
    EXPECT_EQ(search(all), Visit::kContinue);
    ASSERT_GT(all.found.size(), 10u);
    for (const auto& pair : all.found) EXPECT_EQ(pair.second, 77);
    for (const std::size_t wanted : {std::size_t{1}, std::size_t{9}, all.found.size()}) {
      CollectRuns some(wanted);
      EXPECT_EQ(search(some), Visit::kStop);
      ASSERT_EQ(some.found.size(), wanted);
      EXPECT_TRUE(std::equal(some.found.begin(), some.found.end(), all.found.begin()));
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::index
