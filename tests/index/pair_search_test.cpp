// SPDX-License-Identifier: BSD-3-Clause
#include "index/pair_search.h"

#include <gtest/gtest.h>

#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "geometry/touch.h"
#include "index/hull_filter.h"
#include "index/kept_segments.h"
#include "index/tree_search.h"
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
template <class Trees>
class CountedSearch final : public PairSearch {
 public:
  explicit CountedSearch(const Trees& trees) : search_(trees) {}
  std::int32_t leafCount() const override { return search_.leafCount(); }
  Visit split(const TraversalTask& task, std::int32_t grain, TaskSink& out) const override {
    return search_.split(task, grain, out);
  }
  Visit run(const TraversalTask& task, PairBuffer& out) const override {
    ++tasks;
    return search_.run(task, out);
  }
  void endJob() const override { ++jobs; }
  mutable std::atomic<std::size_t> tasks{0}, jobs{0};

 private:
  const TreeSearch<Trees> search_;
};

class CollectRuns final : public PairSink {
 public:
  explicit CollectRuns(std::size_t wanted = SIZE_MAX) : wanted_(wanted) {}

  Visit take(const PairRun& run) override {
    EXPECT_LT(found.size(), wanted_) << "asked again after the end";
    EXPECT_GT(run.count, 0u);
    EXPECT_EQ(run.worker, 0);
    for (std::size_t i = 0; i < run.count; ++i) {
      found.emplace_back(run.pairs[i].a, run.pairs[i].b);
      if (found.size() == wanted_) return Visit::kStop;
    }
    return Visit::kContinue;
  }
  PairList found;

 private:
  std::size_t wanted_;
};

/// Places pairs behind what it has.
class PlacePairs final : public PairSink {
 public:
  Delivery delivery() const override { return Delivery::kPlaced; }
  Visit take(const PairRun& run) override {
    makeRoom(run.count);
    place(0, run);
    return Visit::kContinue;
  }
  void makeRoom(std::size_t count) override {
    begin_ = found.size();
    found.resize(begin_ + count, {-1, -1});
  }
  void place(std::size_t begin, const PairRun& run) const override {
    for (std::size_t i = 0; i < run.count; ++i) {
      auto& at = found[begin_ + begin + i];
      EXPECT_EQ(at.first, -1) << "two pairs in one place";
      at = {run.pairs[i].a, run.pairs[i].b};
    }
  }
  mutable PairList found;

 private:
  std::size_t begin_ = 0;
};

/// Takes pairs on all threads.
class TakeAtOnce final : public PairSink {
 public:
  explicit TakeAtOnce(int workers, std::size_t wanted = SIZE_MAX)
      : found_(static_cast<std::size_t>(workers)), wanted_(wanted) {}

  Delivery delivery() const override { return Delivery::kAtOnce; }
  Visit take(const PairRun& run) override {
    const auto worker = static_cast<std::size_t>(run.worker);
    EXPECT_LT(worker, found_.size());
    EXPECT_EQ(found_[worker].users++, 0) << "two threads at once are this worker";
    for (std::size_t i = 0; i < run.count; ++i) {
      found_[worker].pairs.emplace_back(run.pairs[i].a, run.pairs[i].b);
    }
    taken_ += run.count;
    --found_[worker].users;
    return taken_ < wanted_ ? Visit::kContinue : Visit::kStop;
  }
  PairList all() const {
    PairList all;
    for (const auto& of_worker : found_) {
      all.insert(all.end(), of_worker.pairs.begin(), of_worker.pairs.end());
    }
    std::sort(all.begin(), all.end());
    return all;
  }

 private:
  struct OfWorker {
    PairList pairs;
    std::atomic<int> users{0};
  };
  std::vector<OfWorker> found_;
  const std::size_t wanted_;
  std::atomic<std::size_t> taken_{0};
};

using SegmentFilter = HullFilter<SegmentRange, SegmentHulls<SegmentRange>>;

template <class Trees>
PairList pairsFound(const Trees& trees, parallel::Executor* executor = nullptr,
                    const SegmentFilter* filter = nullptr) {
  CollectRuns sink;
  BlockPool pool;
  EXPECT_EQ(findPairs(TreeSearch(trees), filter, executor, pool, sink), Visit::kContinue);
  return sink.found;
}

/// Executors of more threads than the machine has, too.
class SomeExecutors {
 public:
  auto begin() const { return executors_.begin(); }
  auto end() const { return executors_.end(); }

 private:
  const tbb::global_control most_{tbb::global_control::max_allowed_parallelism, 64};
  const std::array<std::unique_ptr<parallel::Executor>, 4> executors_{
      parallel::makeExecutor(1), parallel::makeExecutor(2), parallel::makeExecutor(3),
      parallel::makeExecutor(64)};
};

template <class Tree>
class PairSearchTest : public testing::Test {};
TYPED_TEST_SUITE(PairSearchTest, SearchedTrees, TreeNames);

// The tests below would not see what several jobs may do wrong.
TYPED_TEST(PairSearchTest, ManyTasksAreManyJobs) {
  const auto executor = parallel::makeExecutor(2);
  const TypeParam tree = treeOf<TypeParam>(many());
  const CountedSearch<TypeParam> search(tree);
  CollectRuns sink;
  BlockPool pool;
  findPairs(search, nullptr, executor.get(), pool, sink);
  EXPECT_GT(search.tasks, 500u);
  EXPECT_GT(search.jobs, 100u);
}

// A task would be searched twice or never, depending on how often it was split before.
TYPED_TEST(PairSearchTest, TasksAreTheSameHoweverOftenTheyAreSplit) {
  struct Tasks final : TaskSink {
    Visit take(const TraversalTask& task) override {
      all.push_back({task.node, task.a_slot, task.b_slot});
      return Visit::kContinue;
    }
    std::vector<std::array<std::int32_t, 3>> all;
  };
  const auto expectSame = [&](const auto& trees) {
    Tasks once, coarse, twice;
    splitIntoTasks(trees, kAllPairs, kLeastGrain, once);
    splitIntoTasks(trees, kAllPairs, 8 * kLeastGrain, coarse);
    for (const auto& [node, a, b] : coarse.all) {
      splitIntoTasks(trees, {node, a, b}, kLeastGrain, twice);
    }
    EXPECT_GT(coarse.all.size(), 3u);
    EXPECT_LT(coarse.all.size(), once.all.size());
    EXPECT_TRUE(once.all == twice.all);
  };
  const TypeParam tree = treeOf<TypeParam>(many());
  const TwoTrees<TypeParam> trees(many(), curled());
  expectSame(tree);
  expectSame(trees.two);
}

// Answers would come in another order from one run to the next, or pairs be lost between threads.
TYPED_TEST(PairSearchTest, OrderDoesNotDependOnThreads) {
  const SomeExecutors executors;
  std::vector<FiberScene> scenes{curled(), mixed(), many(), identical(4, 150)};
  for (const FiberScene& scene : grouped(unequal())) scenes.push_back(scene);
  for (const FiberScene& scene : scenes) {
    SCOPED_TRACE(scene.name);
    const TypeParam tree = treeOf<TypeParam>(scene);
    const TwoTrees<TypeParam> trees(scene, unequal());
    const PairList self = pairsFound(tree);
    const PairList two = pairsFound(trees.two);
    for (const auto& executor : executors) {
      EXPECT_TRUE(pairsFound(tree, executor.get()) == self);
      EXPECT_TRUE(pairsFound(trees.two, executor.get()) == two);
    }
  }
  EXPECT_TRUE(asSet(pairsFound(treeOf<TypeParam>(identical(4, 150))), false) == allPairs(600));
}

// A vector of all pairs would have some twice, or some in other places than a visitor sees them.
TYPED_TEST(PairSearchTest, ThreadsPlacePairsInTheirOrder) {
  const SomeExecutors executors;
  for (const FiberScene& scene : {many(), identical(4, 150), unequal()}) {
    SCOPED_TRACE(scene.name);
    const TypeParam tree = treeOf<TypeParam>(scene);
    const TwoTrees<TypeParam> trees(scene, curled());
    PairList expected = pairsFound(tree);
    const PairList two = pairsFound(trees.two);
    expected.insert(expected.end(), two.begin(), two.end());
    for (const auto& executor : executors) {
      PlacePairs sink;
      BlockPool pool;
      EXPECT_EQ(findPairs(TreeSearch(tree), nullptr, executor.get(), pool, sink), Visit::kContinue);
      EXPECT_EQ(findPairs(TreeSearch(trees.two), nullptr, executor.get(), pool, sink),
                Visit::kContinue);
      EXPECT_TRUE(sink.found == expected);
    }
  }
}

// A program that adds up on all threads would miss pairs, add some twice, or write to one sum from
// two threads.
TYPED_TEST(PairSearchTest, AllThreadsTakeEachPairOnce) {
  const SomeExecutors executors;
  for (const FiberScene& scene : {many(), identical(4, 150)}) {
    SCOPED_TRACE(scene.name);
    const TypeParam tree = treeOf<TypeParam>(scene);
    PairList expected = pairsFound(tree);
    std::sort(expected.begin(), expected.end());
    for (const auto& executor : executors) {
      const int workers = executor != nullptr ? executor->threads() : 1;
      TakeAtOnce sink(workers), some(workers, 100);
      BlockPool pool;
      EXPECT_EQ(findPairs(TreeSearch(tree), nullptr, executor.get(), pool, sink), Visit::kContinue);
      EXPECT_TRUE(sink.all() == expected);
      EXPECT_EQ(findPairs(TreeSearch(tree), nullptr, executor.get(), pool, some), Visit::kStop);
      EXPECT_GE(some.all().size(), 100u);
    }
  }
}

// Pairs that wait for a slow visitor would fill the memory; or those beyond the limit be lost.
TYPED_TEST(PairSearchTest, ThreadsWaitForASinkThatIsSlow) {
  const TypeParam tree = treeOf<TypeParam>(identical(70, 40));
  const PairList all = pairsFound(tree);
  class Slow final : public PairSink {
   public:
    Visit take(const PairRun& run) override {
      if (runs++ < 10) std::this_thread::sleep_for(std::chrono::milliseconds(10));
      for (std::size_t i = 0; i < run.count; ++i) {
        found.emplace_back(run.pairs[i].a, run.pairs[i].b);
      }
      return Visit::kContinue;
    }
    PairList found;
    int runs = 0;
  };
  struct CountCalls final : parallel::Executor {
    explicit CountCalls(parallel::Executor& executor) : executor_(executor) {}
    int threads() const override { return executor_.threads(); }
    void parallelForWithForeground(parallel::FunctionRef<> foreground, int count,
                                   parallel::FunctionRef<int> task) override {
      ++calls;
      executor_.parallelForWithForeground(foreground, count, task);
    }
    std::size_t calls = 0;

   private:
    parallel::Executor& executor_;
  };
  const tbb::global_control allowed(tbb::global_control::max_allowed_parallelism, 3);
  for (const int threads : {2, 3}) {
    const auto executor = parallel::makeExecutor(threads);
    CountCalls counted(*executor);
    Slow sink;
    BlockPool pool;
    pool.keepAtMost(SIZE_MAX);
    findPairs(TreeSearch(tree), nullptr, &counted, pool, sink);
    EXPECT_TRUE(sink.found == all);
    EXPECT_LE(counted.calls, 1 + all.size() / (std::size_t{1} << 20));
    // What waits, and for each thread a task and a block.
    std::size_t most = std::size_t{1} << 21;
    for (int i = 0; i < threads; ++i) most += (std::size_t{1} << 18) + 4096;
    most += most >> 3;
    ASSERT_LT(most, all.size());
    EXPECT_LT(pool.memoryUsage(), most * sizeof(Pair));
  }
}

// Whoever wants the first contact would get another one with threads, or more than asked for.
TYPED_TEST(PairSearchTest, StopsAfterTheFirstPairs) {
  const SomeExecutors executors;
  const TypeParam tree = treeOf<TypeParam>(many());
  const TwoTrees<TypeParam> trees(many(), curled());
  const auto expectPrefixes = [&](const auto& what) {
    const PairList all = pairsFound(what);
    ASSERT_GT(all.size(), 3000u);
    for (const std::size_t wanted :
         {std::size_t{1}, std::size_t{2}, std::size_t{17}, all.size() - 1, all.size()}) {
      for (const auto& executor : executors) {
        CollectRuns sink(wanted);
        BlockPool pool;
        EXPECT_EQ(findPairs(TreeSearch(what), nullptr, executor.get(), pool, sink), Visit::kStop);
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
    int threads() const override { return 2; }
    void parallelForWithForeground(parallel::FunctionRef<> foreground, int count,
                                   parallel::FunctionRef<int> task) override {
      foreground();
      for (int i = 0; i < count; ++i) task(i);
    }
  } executor;
  const TypeParam tree = treeOf<TypeParam>(many());
  for (parallel::Executor* const threads :
       {static_cast<parallel::Executor*>(nullptr), static_cast<parallel::Executor*>(&executor)}) {
    const CountedSearch<TypeParam> search(tree);
    struct StopAtOnce final : PairSink {
      explicit StopAtOnce(const std::atomic<std::size_t>& all_tasks) : tasks(all_tasks) {}
      Visit take(const PairRun&) override {
        at_end = tasks;
        return Visit::kStop;
      }
      const std::atomic<std::size_t>& tasks;
      std::size_t at_end = 0;
    } sink(search.tasks);
    BlockPool pool;
    EXPECT_EQ(findPairs(search, nullptr, threads, pool, sink), Visit::kStop);
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
    Visit take(const PairRun& run) override {
      EXPECT_LE(taken_, at_) << "asked again after it threw";
      taken_ += run.count;
      if (taken_ > at_) throw at_;
      return Visit::kContinue;
    }

   private:
    std::size_t at_, taken_ = 0;
  };
  const TypeParam tree = treeOf<TypeParam>(many());
  const CountedSearch<TypeParam> search(tree);
  const PairList all = pairsFound(tree);
  BlockPool pool;
  for (const int threads : {1, 2, 8}) {
    const auto executor = parallel::makeExecutor(threads);
    for (const std::size_t at : {std::size_t{0}, all.size() / 2, all.size() - 1}) {
      Thrower thrower(at);
      EXPECT_THROW(findPairs(search, nullptr, executor.get(), pool, thrower), std::size_t);
      CollectRuns whole;
      findPairs(search, nullptr, executor.get(), pool, whole);
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
      EXPECT_TRUE(pairsFound(treeOf<TypeParam>(scene), threads).empty());
      for (const FiberScene& other : {FiberScene{"none", {}, {}}, curled()}) {
        const TwoTrees<TypeParam> trees(scene, other), swapped(other, scene);
        const bool any = !scene.segments.empty() && !other.segments.empty();
        EXPECT_EQ(pairsFound(trees.two, threads).empty(), !any);
        EXPECT_EQ(pairsFound(swapped.two, threads).empty(), !any);
      }
    }
  }
}

// --- Memory ---

// What one query left behind would show in the next.
TYPED_TEST(PairSearchTest, BlocksMayBeUsedAgain) {
  const auto executor = parallel::makeExecutor(2);
  const TypeParam large = treeOf<TypeParam>(many()), small = treeOf<TypeParam>(unequal());
  BlockPool pool;
  for (const TypeParam* tree : {&large, &small, &large}) {
    const CountedSearch<TypeParam> search(*tree);
    CollectRuns stopped(17), whole;
    findPairs(search, nullptr, executor.get(), pool, stopped);
    findPairs(search, nullptr, executor.get(), pool, whole);
    EXPECT_TRUE(whole.found == pairsFound(*tree));
  }
}

// Each query would allocate anew; or one dense query cost its memory for good.
TYPED_TEST(PairSearchTest, AQueryLeavesNoMoreToTheNextThanItMay) {
  const auto executor = parallel::makeExecutor(2);
  BlockPool pool;
  EXPECT_EQ(pool.memoryUsage(), 0u);
  PlacePairs few;
  CollectRuns many_pairs;
  const TypeParam sparse = treeOf<TypeParam>(many()), dense = treeOf<TypeParam>(identical(50, 40));
  findPairs(TreeSearch(sparse), nullptr, nullptr, pool, few);
  EXPECT_EQ(pool.memoryUsage(), 0u) << "one thread needs none";
  findPairs(TreeSearch(sparse), nullptr, executor.get(), pool, few);
  EXPECT_GT(pool.memoryUsage(), 0u);
  findPairs(TreeSearch(dense), nullptr, executor.get(), pool, many_pairs);
  EXPECT_GT(many_pairs.found.size() * sizeof(Pair), std::size_t{1} << 23);
  EXPECT_LE(pool.memoryUsage(), std::size_t{1} << 22);
  for (const std::size_t most : {std::size_t{100000}, std::size_t{100}}) {
    pool.keepAtMost(most);
    CollectRuns again;
    findPairs(TreeSearch(dense), nullptr, executor.get(), pool, again);
    EXPECT_EQ(again.found.size(), many_pairs.found.size());
    EXPECT_LE(pool.memoryUsage(), most);
  }
  pool.clear();
  EXPECT_EQ(pool.memoryUsage(), 0u);
}

// Two queries at a time would write over each other's pairs, or memory pile up with them.
TEST(BlockPool, LendsEachItsOwnAndKeepsTheMore) {
  BlockPool pool;
  const auto some = [](int count) {
    BlockPool::Blocks blocks;
    for (int i = 0; i < count; ++i) blocks.push_back(std::make_unique<FoundBlock>());
    return blocks;
  };
  pool.giveBack(some(3));
  BlockPool::Blocks first = pool.take();
  EXPECT_EQ(first.size(), 3u);
  EXPECT_EQ(pool.memoryUsage(), 0u) << "of what is lent out";
  EXPECT_TRUE(pool.take().empty());
  pool.giveBack(some(2));
  pool.giveBack(std::move(first));
  pool.giveBack(some(1));
  EXPECT_EQ(pool.take().size(), 3u);
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
  const SomeExecutors executors;
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
    PairList expected = pairsFound(what);
    const std::size_t before = expected.size();
    expected.erase(
        std::remove_if(expected.begin(), expected.end(),
                       [&](const auto& pair) { return !touches(pair.first, pair.second); }),
        expected.end());
    EXPECT_GT(expected.size(), 300u);
    EXPECT_LT(expected.size(), before);
    for (const auto& executor : executors) {
      EXPECT_TRUE(pairsFound(what, executor.get(), &filter) == expected);
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
  for (const auto& [i, j] : pairsFound(tree)) pairs.push_back({i + 1000, j + 3000});
  const KeptSegments from_1000 = kept(a, 1000), from_3000 = kept(a, 3000);
  const SegmentFilter shifted(from_1000.range(), {from_3000.range()}, margin, 4);
  std::vector<geometry::Impact> impacts;
  const std::size_t kept = shifted.keep(pairs.data(), pairs.size(), impacts);
  const PairList expected = pairsFound(tree, nullptr, &within);
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
