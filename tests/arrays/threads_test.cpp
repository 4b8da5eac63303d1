// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_tree.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <fcl_fibers/live_pairs.h>

#include "arrays/live_calls.h"
#include "arrays/queries.h"
#include "support/process_threads.h"
#include "support/small_stack.h"

namespace fcl_fibers::test {
namespace {

class ArrayTreeThreads : public ::testing::TestWithParam<FiberTreeOptions> {};

TEST_P(ArrayTreeThreads, MayAskAtOnce) {
  // If this fails, queries on several threads disturb each other, although they are const.
  const auto first = Motion<double>::random(61, 60, 0.1),
             second = Motion<double>::random(62, 40, 0.1);
  for (const int threads : {1, 2}) {  // of each query; several share what they keep for the next
    FiberTreeOptions options = GetParam();
    options.threads = threads;
    options.ignored_neighbors = 1;
    const FiberTree tree = steppedTree(first, options), other = steppedTree(second, options);
    const Asked asked{tree, other, first.end.view()};
    const std::vector<TreeQuery> queries = allQueries(options);
    std::vector<Record> expected(queries.size());
    for (std::size_t i = 0; i < queries.size(); ++i) {
      queries[i].ask(asked, expected[i]);
      ASSERT_GT(expected[i].size(), 10u) << queries[i].name;
    }

    constexpr std::size_t kAskers = 4;
    std::atomic<std::size_t> ready{0};
    std::vector<int> differ(kAskers, 0);
    std::vector<std::thread> askers;
    for (std::size_t asker = 0; asker < kAskers; ++asker) {
      askers.emplace_back([&, asker] {
        for (++ready; ready < kAskers;) std::this_thread::yield();
        for (std::size_t i = 0; i < queries.size(); ++i) {
          const std::size_t which = (asker + i) % queries.size();
          Record record;
          queries[which].ask(asked, record);
          differ[asker] += record.is(expected[which]) ? 0 : 1;
        }
      });
    }
    for (std::thread& asker : askers) asker.join();
    EXPECT_EQ(differ, std::vector<int>(kAskers, 0));
  }
}

TEST(ArrayTreeThreadsTest, MayAskWhileVisitorsAsk) {
  // If this fails, two threads of a program whose visitors query the tree again wait for each other
  // for ever.
  const auto motion = Motion<double>::random(74, 100, 0.1);
  for (const int threads : {2, 8}) {
    FiberTreeOptions options = capsules();
    options.threads = threads;
    const FiberTree tree = steppedTree(motion, options);
    const std::size_t all = pairsOf(tree).size();
    ASSERT_GT(all, 100u);
    std::atomic<int> wrong{0};
    const auto ask = [&] {
      for (int round = 0; round < 25; ++round) {
        std::size_t calls = 0;
        tree.visit(Pairs{}, [&](SegmentPair) {
          if (++calls % 100 == 0 && pairsOf(tree).size() != all) ++wrong;
        });
        if (calls != all) ++wrong;
      }
    };
    std::thread second(ask), third(ask);
    ask();
    second.join();
    third.join();
    EXPECT_EQ(wrong, 0);
  }
}

TEST_P(ArrayTreeThreads, DoNotShowInTheOrder) {
  // If this fails, logs of a program depend on how many threads it has.
  const auto first = Motion<double>::random(63, 200, 0.05),
             second = Motion<double>::random(64, 100, 0.05);
  const tbb::global_control most(tbb::global_control::max_allowed_parallelism, 64);
  FiberTreeOptions options = GetParam();
  options.ignored_neighbors = 1;
  const std::vector<TreeQuery> queries = allQueries(options);
  std::vector<Record> expected(queries.size());
  for (const int threads : {1, 2, 64}) {
    options.threads = threads;
    const FiberTree tree = steppedTree(first, options), other = steppedTree(second, options);
    for (std::size_t i = 0; i < queries.size(); ++i) {
      Record record;
      queries[i].ask({tree, other, first.end.view()}, record);
      if (threads == 1) {
        expected[i] = record;
        ASSERT_GT(record.size(), 30u) << queries[i].name;
      }
      EXPECT_TRUE(record.is(expected[i])) << queries[i].name << ", threads: " << threads;
    }
  }
}

/// Takes fibers so far apart that few of them touch.
void thinOut(Assembly<double>& fibers) {
  for (double& number : fibers.points) number *= 20;
}

/// The volumes of all levels, and what a program is told of a tree's segments.
std::vector<double> numbersOf(const FiberTree& tree) {
  std::vector<double> numbers;
  for (int depth = 0; depth < 8; ++depth) {
    for (const TreeVolume& volume : tree.volumes(depth)) {
      numbers.insert(numbers.end(), volume.center, volume.center + 3);
      numbers.insert(numbers.end(), volume.half, volume.half + 3);
      numbers.insert(numbers.end(), volume.segments, volume.segments + volume.segment_count);
    }
  }
  for (const std::int32_t segment : tree.segments()) numbers.push_back(segment);
  return numbers;
}

TEST_P(ArrayTreeThreads, DoNotShowInTheTree) {
  // If this fails, a build or an update by several threads loses segments, or gives another tree
  // than one thread would.
  auto motion = Motion<double>::random(68, 1000, 0.05);
  motion.closeAndGroup();
  for (auto* fibers : {&motion.start, &motion.end}) thinOut(*fibers);
  std::vector<std::uint32_t> categories;
  std::vector<std::int32_t> roots;
  for (std::size_t f = 0; f < motion.start.fiberCount(); ++f) {
    categories.push_back(f % 5 == 0 ? 2 : 7);
    roots.push_back(static_cast<std::int32_t>(f % 3));
  }
  const auto viewOf = [&](const Assembly<double>& fibers) {
    FiberArrays<double> view = motion.viewOf(fibers);
    view.categories = categories.data();
    view.root_segments = roots.data();
    return view;
  };
  FiberTreeOptions options = GetParam();
  options.ignored_arc_length = 1;
  std::vector<std::vector<double>> expected;
  for (const int threads : {1, 2, 8}) {
    options.threads = threads;
    FiberTree tree(options);
    std::vector<std::vector<double>> found;
    tree.build(viewOf(motion.start));
    found.push_back(numbersOf(tree));
    tree.update(viewOf(motion.end));
    found.push_back(numbersOf(tree));
    tree.build(viewOf(motion.end));
    found.push_back(numbersOf(tree));
    found.emplace_back();
    tree.visit(Pairs{}, [&](SegmentPair pair) {
      found.back().insert(found.back().end(), {1.0 * pair.a, 1.0 * pair.b});
    });
    if (threads == 1) {
      expected = found;
      for (const auto& numbers : expected) ASSERT_GT(numbers.size(), 200u);
    }
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_TRUE(found[i] == expected[i]) << "numbers " << i << ", threads " << threads;
    }
  }
}

TEST(ArrayTreeThreadsTest, RefuseTheFirstOfTheWrongNumbers) {
  // If this fails, what a program is told of its wrong input depends on the number of threads, or
  // the input is taken.
  auto fibers = curledFibers<double>(69, 2000);
  thinOut(fibers);
  const std::size_t points = fibers.pointCount();
  ASSERT_GT(points, 30000u);
  const double wrong_numbers[] = {std::numeric_limits<double>::quiet_NaN(),
                                  std::numeric_limits<double>::infinity()};
  for (const int threads : {1, 3}) {
    FiberTreeOptions options = capsules();
    options.threads = threads;
    FiberTree tree(options);
    tree.build(fibers.view());
    const auto before = pairsOf(tree);
    const auto expectRefusal = [&](const std::string& what) {
      const auto refuses = testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(what));
      EXPECT_THAT([&] { tree.build(fibers.view()); }, refuses);
      EXPECT_THAT([&] { tree.update(fibers.view()); }, refuses);
      EXPECT_EQ(pairsOf(tree), before) << "nothing has changed";
    };
    const auto changed = [](double& number, double wrong, auto&& test) {
      const double right = number;
      number = wrong;
      test();
      number = right;
    };
    for (const double wrong : wrong_numbers) {
      for (const std::size_t first : {std::size_t{0}, points / 2, points - 2}) {
        SCOPED_TRACE(testing::Message() << threads << " threads, " << wrong << " at " << first);
        changed(fibers.points[3 * (points - 1) + 2], wrong, [&] {
          changed(fibers.points[3 * first + 1], -wrong,
                  [&] { expectRefusal("point " + std::to_string(first) + " is NaN or infinite"); });
        });
      }
    }
    for (const double wrong : {wrong_numbers[0], wrong_numbers[1], -1e-300}) {
      std::size_t first = points / 2, last = points - 2;
      while (!fibers.startsCapsule(first)) ++first;
      while (!fibers.startsCapsule(last)) --last;
      changed(fibers.radii[last], -1, [&] {
        changed(fibers.radii[first], wrong, [&] {
          expectRefusal("radius " + std::to_string(first) + " is negative, NaN or infinite");
        });
      });
      // The last point of a fiber starts no capsule.
      const std::size_t unread = fibers.point_begin[1] - 1;
      changed(fibers.radii[unread], wrong, [&] { tree.build(fibers.view()); });
    }
  }
}

/// Calls check(name, parallel, serial) for each question and partner that a step of capsules has:
/// what all threads found at once, and what visit() finds.
template <class Check>
void forQuestions(const FiberTree& tree, const FiberTree& other, const Motion<double>& own_motion,
                  const Motion<double>& other_motion, const Check& check) {
  const auto ask = [&](const char* name, const auto& question, const auto& partner) {
    Record serial;
    tree.visit(question, partner, serial);
    std::vector<Record> records(static_cast<std::size_t>(tree.workerCount()));
    std::vector<std::atomic<int>> calls(records.size());
    std::atomic<int> wrong{0};
    EXPECT_FALSE(tree.visitInParallel(question, partner, [&](const auto& found, int worker) {
      const auto number = static_cast<std::size_t>(worker);
      if (number >= records.size() || ++calls[number] != 1) return void(++wrong);
      records[number](found);
      --calls[number];
    }));
    EXPECT_EQ(wrong, 0) << name << ": two threads at once are one worker";
    Record parallel;
    for (const Record& record : records) parallel.add(record);
    check(name, parallel.sorted(), serial.sorted());
  };
  const FiberArrays<double> own_points = own_motion.end.view(), points = other_motion.end.view();
  const TriangleMesh mesh(ball<double>(0.3, 16, 24).view(), TriangleMesh::Kind::kSolid);
  const MeshStep step{mesh, mesh};
  const BoxShape box{{-0.2, 0, 0}, {0.2, 0.1, 0.1}};
  const TriangleMesh room(ball<double>(2, 16, 24).view(), TriangleMesh::Kind::kSolid);
  ask("Pairs", Pairs{Order::kFibers}, tree);
  ask("Pairs of two", Pairs{}, other);
  ask("Pairs of a mesh", Pairs{}, mesh);
  ask("Pairs of a box", Pairs{}, box);
  ask("TouchingSegments", TouchingSegments{}, mesh);
  ask("Nearest", Nearest{0.1}, tree);
  ask("Nearest of two", Nearest{0.1}, other);
  ask("Nearest of a mesh", Nearest{0.1}, mesh);
  ask("Impacts", Impacts{}, tree);
  ask("Impacts of two", Impacts{}, other);
  ask("Impacts of a mesh", Impacts{}, step);
  ask("MovingPairs", MovingPairs{}, tree);
  ask("Contacts", Contacts<double>{own_points}, tree);
  ask("Contacts of two", Contacts<double>{own_points, &points}, other);
  ask("Contacts of a mesh", Contacts<double>{own_points}, mesh);
  ask("Contacts of a box", Contacts<double>{own_points}, box);
  ask("Contacts of a solid around all", Contacts<double>{own_points}, room);
  ask("Impacts of a solid around all", Impacts{}, MeshStep{room, room});
}

TEST(VisitInParallel, FindsWhatVisitFinds) {
  // If this fails, a solver that adds up on all threads misses contacts or adds some twice.
  const tbb::global_control most(tbb::global_control::max_allowed_parallelism, 64);
  const auto first = Motion<double>::random(71, 200, 0.05),
             second = Motion<double>::random(72, 100, 0.05);
  for (const int threads : {1, 2, 64}) {
    FiberTreeOptions options = capsules();
    options.threads = threads;
    options.ignored_neighbors = 1;
    const FiberTree tree = steppedTree(first, options), other = steppedTree(second, options);
    EXPECT_EQ(tree.workerCount(), threads);
    forQuestions(tree, other, first, second,
                 [](const char* name, const Record& parallel, const Record& serial) {
                   EXPECT_GT(serial.size(), 20u) << name;
                   EXPECT_TRUE(parallel.is(serial)) << name;
                 });
  }
}

TEST(VisitInParallel, EndsSoon) {
  // If this fails, a visitor that has found what it looks for, or has failed, is called for minutes
  // more. In a dense scene one task has a hundred thousand pairs.
  const tbb::global_control most(tbb::global_control::max_allowed_parallelism, 8);
  Assembly<double> dense;
  for (int f = 0; f < 1000; ++f) {
    dense.addPoint({0, 0, 0}, 0.1);
    dense.addPoint({1, 0, 0}, 0.1);
    dense.endFiber();
  }
  for (const int threads : {1, 2, 8}) {
    FiberTreeOptions options = capsules();
    options.threads = threads;
    FiberTree tree(options);
    tree.build(dense.view());
    constexpr std::size_t kWanted = 200, kMore = 8 * 64;
    const auto expectEnds = [&](const auto& question) {
      std::atomic<std::size_t> calls{0};
      EXPECT_TRUE(
          tree.visitInParallel(question, [&](const auto&, int) { return ++calls >= kWanted; }));
      EXPECT_LT(calls, kWanted + kMore);
      calls = 0;
      const auto fail = [&](const auto&, int) {
        if (++calls >= kWanted) throw std::runtime_error("enough");
      };
      EXPECT_THROW(tree.visitInParallel(question, fail), std::runtime_error);
      EXPECT_LT(calls, kWanted + kMore);
    };
    expectEnds(Pairs{});
    expectEnds(Nearest{1});
    expectEnds(Contacts<double>{dense.view()});
  }
}

TEST(VisitInParallel, FindsAllThatALargeShapeTouches) {
  // If this fails, a floor under many fibers pushes some of them twice or not at all.
  const tbb::global_control most(tbb::global_control::max_allowed_parallelism, 64);
  const auto motion = Motion<double>::random(74, 1500, 0.05);
  for (const int threads : {1, 2, 8}) {
    FiberTreeOptions options = capsules();
    options.threads = threads;
    const FiberTree tree = steppedTree(motion, options);
    std::vector<std::vector<std::size_t>> calls(static_cast<std::size_t>(tree.workerCount()));
    for (auto& of_worker : calls) of_worker.resize(motion.end.pointCount());
    const auto count = [&](std::int32_t segment, int worker) {
      ++calls[static_cast<std::size_t>(worker)][static_cast<std::size_t>(segment)];
    };
    const HalfSpaceShape all{{0, 0, 1}, 100};
    tree.visitInParallel(Contacts{motion.end.view()}, all,
                         [&](const ShapeContact& c, int worker) { count(c.segment, worker); });
    tree.visitInParallel(Impacts{}, BoxShape{{-9, -9, -9}, {9, 9, 9}},
                         [&](const ShapeImpact& i, int worker) { count(i.segment, worker); });
    const std::vector<std::int32_t> segments = tree.segments();
    ASSERT_GT(segments.size(), 20000u);
    for (const std::int32_t segment : segments) {
      std::size_t sum = 0;
      for (const auto& of_worker : calls) sum += of_worker[static_cast<std::size_t>(segment)];
      ASSERT_EQ(sum, 2u) << segment << ", threads " << threads;
    }
    std::atomic<std::size_t> visited{0};
    EXPECT_TRUE(
        tree.visitInParallel(Pairs{}, all, [&](std::int32_t, int) { return ++visited == 10000; }));
    EXPECT_LT(visited, segments.size()) << "the visitor had enough";
  }
}

TEST(VisitInParallel, EndsThrowsAndMayQuery) {
  // If this fails, a visitor that has enough, fails or queries leaves threads behind or waits for
  // ever.
  const auto motion = Motion<double>::random(73, 300, 0.05);
  for (const int threads : {1, 2, 8}) {
    FiberTreeOptions options = capsules();
    options.threads = threads;
    FiberTree tree = steppedTree(motion, options);
    std::vector<SegmentPair> all;
    tree.find(Pairs{}, all);
    ASSERT_GT(all.size(), 1000u);
    std::atomic<std::size_t> calls{0};
    const auto enough = [&](SegmentPair, int) { return ++calls >= 5; };
    EXPECT_TRUE(tree.visitInParallel(Pairs{}, enough));
    EXPECT_GE(calls, 5u);
    EXPECT_LT(calls, all.size());

    const auto fail = [](SegmentPair, int) { throw std::runtime_error("enough"); };
    EXPECT_THROW(tree.visitInParallel(Pairs{}, fail), std::runtime_error);

    calls = 0;
    std::atomic<int> wrong{0};
    tree.visitInParallel(Pairs{}, [&](SegmentPair, int) {
      if (calls++ % 500 != 0) return;
      std::vector<SegmentPair> inner;
      tree.find(Pairs{}, inner);
      std::atomic<std::size_t> count{0};
      tree.visitInParallel(Pairs{}, [&](SegmentPair, int) { ++count; });
      if (inner.size() != all.size() || count != all.size()) ++wrong;
    });
    EXPECT_EQ(calls, all.size());
    EXPECT_EQ(wrong, 0);
    EXPECT_NO_THROW(tree.update(motion.end.view())) << "no query runs any more";
  }
}

/// Calls all at the same time, each on a thread of its own.
void callAtOnce(const std::vector<std::function<void()>>& calls) {
  std::atomic<std::size_t> ready{0};
  std::vector<std::thread> threads;
  for (const auto& call : calls) {
    threads.emplace_back([&] {
      for (++ready; ready < calls.size();) std::this_thread::yield();
      call();
    });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST(ArrayTreeThreadsTest, MayReadLivePairsAtOnce) {
  // If this fails, threads of a program fit a tree together that an update has left unfitted, or
  // read pairs in the making.
  for (const int threads : {1, 2}) {
    Assembly<double> fibers = curledFibers<double>(75, 120), others = curledFibers<double>(76, 60);
    FiberTreeOptions options = capsules();
    options.threads = threads;
    FiberTree tree(options), other(options), fresh(options), fresh_other(options);
    tree.build(fibers.view());
    other.build(others.view());
    const TriangleMesh mesh(ball<double>(0.3, 8, 12).view(), TriangleMesh::Kind::kSolid);
    const LivePairsOptions skin{0.02};
    LivePairs own(tree, skin), of_other(other, skin);
    LivePairs<FiberTree> both(tree, other, skin);
    LivePairs<TriangleMesh> of_mesh(tree, mesh, skin);
    Random random(77);
    for (int step = 0; step < 12; ++step) {
      SCOPED_TRACE(testing::Message() << threads << " threads, step " << step);
      const double size = step % 4 == 3 ? 0.05 : 0.001;
      for (Assembly<double>* const moved : {&fibers, &others}) {
        for (double& x : moved->points) x += random.between(-size, size);
      }
      fresh.build(fibers.view());
      fresh_other.build(others.view());
      const PairList pairs = pairsOf(fresh), of_both = pairsOf(fresh, fresh_other);
      const PairList with_mesh = pairsOfMesh(fresh, mesh), of_others = pairsOf(fresh_other);
      tree.update(fibers.view());
      other.update(others.view());
      const auto expectOwn = [&] { EXPECT_EQ(pairsOf(tree), pairs); };
      const auto expectOther = [&] { EXPECT_EQ(pairsOf(other), of_others); };
      const auto expectLive = [](const auto& live, const PairList& expected) {
        std::vector<typename std::decay_t<decltype(live)>::Pair> found;
        live.find(found);
        EXPECT_EQ(sorted(found).size(), expected.size());
        std::size_t visited = 0;
        live.visit([&](const auto&, std::int32_t) { ++visited; });
        EXPECT_EQ(visited, expected.size());
        EXPECT_LE(live.begun().size() + live.ended().size() + live.count(),
                  2 * static_cast<std::size_t>(live.slotCount()));
      };
      const auto expectSafe = [](const auto& live) {
        std::vector<double> distances, of_partner;
        live.safeDistances(distances, of_partner);
        EXPECT_FALSE(distances.empty() || of_partner.empty());
      };
      // They fit the trees.
      if (step % 3 == 0) callAtOnce({expectOwn, expectOther, expectOwn, expectOther});
      own.update();
      of_mesh.update();
      if (step % 2 == 0) of_other.update();
      // An update reads the partner as a query does.
      callAtOnce({[&] { both.update(); }, expectOther, expectOther, [&] { expectLive(own, pairs); },
                  [&] { expectLive(of_mesh, with_mesh); }});
      if (step % 2 == 1) of_other.update();
      for (int round = 0; round < 2; ++round) {
        callAtOnce({[&] { expectLive(own, pairs); }, [&] { expectLive(both, of_both); },
                    [&] { expectLive(of_other, of_others); }, [&] { expectSafe(own); },
                    [&] { expectSafe(both); }, [&] { expectSafe(own); }, expectOwn, expectOther});
      }
    }
    EXPECT_GT(own.count() + both.count() + of_mesh.count(), 300u);
  }
}

TEST(ArrayTreeThreadsTest, AreOnlyMadeIfAskedFor) {
  // If this fails, a program that may have no other threads gets some.
  const auto threadsMadeBy = [](int threads) {
    FiberTreeOptions options = capsules();
    options.threads = threads;
    const auto motion = Motion<double>::random(65, 200, 0.05);
    const std::size_t before = threadsOfThisProcess();
    const FiberTree tree = steppedTree(motion, options), other = steppedTree(motion, options);
    for (const TreeQuery& query : allQueries(options)) {
      Record record;
      query.ask({tree, other, motion.end.view()}, record);
    }
    return static_cast<int>(threadsOfThisProcess() - before);
  };
  // In processes of their own, started anew, because threads of other tests stay.
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(std::exit(threadsMadeBy(1)), testing::ExitedWithCode(0), "");
  // oneTBB makes none where there is one processor.
  if (processorsOfThisProcess() == 1) return;
  EXPECT_EXIT(std::exit(threadsMadeBy(2) > 0 ? 0 : 1), testing::ExitedWithCode(0), "");
}

TEST(ArrayTreeOnASmallStack, AnswersEveryQuery) {
  // If this fails, programs whose threads have little stack crash in some query.
  const auto first = Motion<double>::random(66, 150, 0.02),
             second = Motion<double>::random(67, 40, 0.02);
  for (FiberTreeOptions options : allKinds(Report::kCapsules)) {
    options.threads = options.topology == Topology::kBundle ? 1 : 2;
    options.ignored_neighbors = 1;
    runOnSmallStack([&] {
      const FiberTree tree = steppedTree(first, options), other = steppedTree(second, options);
      for (const TreeQuery& query : allQueries(options, /*rings=*/40)) {
        Record record;
        query.ask({tree, other, first.end.view()}, record);
        EXPECT_GT(record.size(), 10u) << query.name;
      }
    });
  }
}

INSTANTIATE_TEST_SUITE_P(Volumes, ArrayTreeThreads,
                         ::testing::ValuesIn(allKinds(Report::kVolumes)));
INSTANTIATE_TEST_SUITE_P(Capsules, ArrayTreeThreads,
                         ::testing::ValuesIn(allKinds(Report::kCapsules)));

}  // namespace
}  // namespace fcl_fibers::test
