// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_tree.h>

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

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
        for (std::size_t i = 0; i < 2 * queries.size(); ++i) {
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

TEST_P(ArrayTreeThreads, DoNotShowInTheOrder) {
  // If this fails, logs of a program depend on how many threads it has.
  const auto first = Motion<double>::random(63, 200, 0.05),
             second = Motion<double>::random(64, 100, 0.05);
  FiberTreeOptions options = GetParam();
  options.ignored_neighbors = 1;
  const std::vector<TreeQuery> queries = allQueries(options);
  std::vector<Record> expected(queries.size());
  for (const int threads : {1, 2, 3}) {
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
