// SPDX-License-Identifier: BSD-3-Clause
#include "parallel/executor.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/info.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <future>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace fcl_fibers::parallel {
namespace {

/// How often each task ran.
class Tally {
 public:
  explicit Tally(int count) : runs_(static_cast<std::size_t>(count)) {}
  void operator()(int i) { ++runs_[static_cast<std::size_t>(i)]; }
  bool eachRanOnce() const {
    return std::all_of(runs_.begin(), runs_.end(), [](const auto& n) { return n == 1; });
  }
  bool noneRanTwice() const {
    return std::all_of(runs_.begin(), runs_.end(), [](const auto& n) { return n <= 1; });
  }
  bool ran(int i) const { return runs_[static_cast<std::size_t>(i)] == 1; }

 private:
  std::vector<std::atomic<int>> runs_;
};

class ExecutorTest : public testing::TestWithParam<int> {
 protected:
  ExecutorTest() : executor_(makeExecutor(GetParam())) {}

  void expectWorks(int count) {
    Tally tally(count);
    executor_->parallelFor(count, [&](int i) { tally(i); });
    EXPECT_TRUE(tally.eachRanOnce()) << "of " << count;
  }

  std::unique_ptr<Executor> executor_;
};
INSTANTIATE_TEST_SUITE_P(, ExecutorTest, testing::Values(2, 3, 8),
                         testing::PrintToStringParamName());

// One thread would pay for what several need.
TEST(MakeExecutor, OneThreadNeedsNone) { EXPECT_EQ(makeExecutor(1), nullptr); }

// Pairs would be missed or reported twice. So they would by a worker that wakes late, when its
// tasks are done and the next ones there.
TEST_P(ExecutorTest, EachTaskRunsOnce) {
  for (const int count : {0, 1, 2, 3, 1000, 0, 1, 1000}) expectWorks(count);
  for (int round = 0; round < 3000; ++round) expectWorks(round % 5);
}

// An object that cannot be read would end the program, or the manager be of no use after it.
TEST_P(ExecutorTest, WhatATaskThrowsIsThrownToTheCaller) {
  for (const int count : {1, 2, 10, 1000}) {
    for (const int at : {0, count / 2, count - 1}) {
      Tally tally(count);
      try {
        executor_->parallelFor(count, [&](int i) {
          if (i == at) throw std::runtime_error("task " + std::to_string(i));
          tally(i);
        });
        ADD_FAILURE() << "nothing was thrown";
      } catch (const std::runtime_error& error) {
        EXPECT_EQ(error.what(), "task " + std::to_string(at));
      }
      EXPECT_TRUE(tally.noneRanTwice());
      EXPECT_FALSE(tally.ran(at));
      expectWorks(100);
    }
  }
}

// Of several, one is thrown, and no other one is left for the next run.
TEST_P(ExecutorTest, OneOfManyExceptionsIsThrown) {
  for (int round = 0; round < 100; ++round) {
    EXPECT_THROW(executor_->parallelFor(50, [](int i) { throw i; }), int);
    expectWorks(20);
  }
}

// A query's callbacks would run on another thread, more than once, or not at all.
TEST_P(ExecutorTest, TheForegroundRunsOnceOnTheCallersThread) {
  for (const int count : {0, 1, 2, 1000}) {
    Tally tally(count);
    std::vector<std::thread::id> own;
    executor_->parallelForWithForeground([&] { own.push_back(std::this_thread::get_id()); }, count,
                                         [&](int i) { tally(i); });
    EXPECT_EQ(own, std::vector{std::this_thread::get_id()}) << "of " << count;
    EXPECT_TRUE(tally.eachRanOnce()) << "of " << count;
  }
}

// The other threads would wait for the callbacks.
TEST_P(ExecutorTest, TasksRunBesideTheForeground) {
  if (tbb::info::default_concurrency() < 2) GTEST_SKIP() << "oneTBB has no second thread here";
  std::promise<void> all_ran;
  std::atomic<int> ran{0};
  const auto task = [&](int) {
    if (++ran == 100) all_ran.set_value();
  };
  executor_->parallelForWithForeground(
      [&] {
        EXPECT_EQ(all_ran.get_future().wait_for(std::chrono::minutes(1)),
                  std::future_status::ready);
      },
      100, task);
}

// What throws would leave threads behind that search what may be gone.
TEST_P(ExecutorTest, NothingRunsAfterAnException) {
  for (int round = 0; round < 200; ++round) {
    const bool is_task = round % 2 == 0;
    std::atomic<int> running{0};
    const auto task = [&](int i) {
      ++running;
      std::this_thread::yield();
      --running;
      if (is_task && i == 3) throw std::logic_error("3");
    };
    const auto foreground = [is_task] {
      if (!is_task) throw std::logic_error("own");
    };
    EXPECT_THROW(executor_->parallelForWithForeground(foreground, 200, task), std::logic_error);
    EXPECT_EQ(running, 0);
    expectWorks(20);
  }
}

// A callback that queries would wait for itself.
TEST_P(ExecutorTest, TheForegroundMayRunTasks) {
  for (int round = 0; round < 100; ++round) {
    Tally outer(50);
    executor_->parallelForWithForeground([&] { expectWorks(30); }, 50, [&](int i) { outer(i); });
    EXPECT_TRUE(outer.eachRanOnce());
  }
}

// A task that asks for tasks would wait for threads that all run tasks, or be interrupted by one of
// them, as if it were two workers.
TEST_P(ExecutorTest, ATaskRunsItsOwnTasksItself) {
  for (int round = 0; round < 100; ++round) {
    Tally outer(50), inner(50 * 30);
    std::atomic<int> elsewhere{0};
    executor_->parallelFor(50, [&](int i) {
      const std::thread::id own = std::this_thread::get_id();
      executor_->parallelFor(30, [&](int k) {
        inner(30 * i + k);
        if (std::this_thread::get_id() != own) ++elsewhere;
      });
      outer(i);
    });
    EXPECT_TRUE(outer.eachRanOnce());
    EXPECT_TRUE(inner.eachRanOnce());
    EXPECT_EQ(elsewhere, 0);
  }
}

// Two queries whose callbacks wait for each other, by a lock or because they query, would wait for
// ever: a caller that waits for its own tasks would run those of the other.
TEST_P(ExecutorTest, ForegroundsMayWaitForOtherCallers) {
  for (int round = 0; round < 200; ++round) {
    std::atomic<int> inner_calls{0};
    const auto use = [&] {
      std::atomic<bool> is_over{false};
      const auto foreground = [&] {
        executor_->parallelFor(20, [](int) {});
        for (++inner_calls; inner_calls < 3;) std::this_thread::yield();
        is_over = true;
      };
      // Tasks that last as long as the foreground.
      executor_->parallelForWithForeground(foreground, GetParam() - 1, [&](int) {
        while (!is_over) std::this_thread::yield();
      });
    };
    std::thread second(use), third(use);
    use();
    second.join();
    third.join();
  }
}

// A program that allows more threads than cores, or fewer, would not get them.
TEST(MakeExecutor, MakesAsManyThreadsAsOneTbbAllows) {
  using Control = tbb::global_control;
  {
    const Control more(Control::max_allowed_parallelism, 64);
    EXPECT_EQ(makeExecutor(64)->threads(), 64);
    EXPECT_EQ(makeExecutor(100)->threads(), 64);
  }
  const Control fewer(Control::max_allowed_parallelism, 2);
  EXPECT_EQ(makeExecutor(100)->threads(), 2);
}

// Two queries at once would mix up their tasks, or wait for each other for ever.
TEST_P(ExecutorTest, RunsForSeveralThreadsAtOnce) {
  constexpr int kUsers = 6;
  std::atomic<int> failures{0};
  std::vector<std::thread> users;
  for (int user = 0; user < kUsers; ++user) {
    users.emplace_back([&, user] {
      for (int round = 0; round < 200; ++round) {
        const int count = 1 + (37 * user + round) % 60;
        Tally tally(count);
        try {
          executor_->parallelFor(count, [&](int i) {
            tally(i);
            if (user == 0 && i == count - 1) throw user;
          });
          if (user == 0) ++failures;
        } catch (int who) {
          if (who != user) ++failures;  // another user's exception
        }
        if (user != 0 && !tally.eachRanOnce()) ++failures;
        if (!tally.noneRanTwice()) ++failures;
      }
    });
  }
  for (std::thread& user : users) user.join();
  EXPECT_EQ(failures, 0);
  expectWorks(1000);
}

// A manager that is never queried, or not after its first query, would hang when it goes.
TEST_P(ExecutorTest, MayGoAtAnyTime) {
  for (int round = 0; round < 50; ++round) {
    const auto unused = makeExecutor(GetParam());
    const auto used = makeExecutor(GetParam());
    used->parallelFor(round % 4, [](int) {});
  }
}

// Segments at the seams would not be read, or be read by two threads.
TEST_P(ExecutorTest, RangesCoverAllOnce) {
  for (const std::size_t count : {0u, 1u, 9u, 10u, 11u, 19u, 20u, 21u, 1000u}) {
    for (const std::size_t grain : {1u, 10u, 4096u}) {
      for (Executor* executor : {executor_.get(), static_cast<Executor*>(nullptr)}) {
        std::vector<std::atomic<int>> visits(count);
        std::atomic<int> tasks{0};
        forRanges(executor, count, grain, [&](std::size_t begin, std::size_t end) {
          ++tasks;
          EXPECT_LE(begin, end);
          EXPECT_LE(end, count);
          EXPECT_TRUE(executor == nullptr || end - begin <= grain);
          for (std::size_t i = begin; i < std::min(end, count); ++i) ++visits[i];
        });
        EXPECT_TRUE(std::all_of(visits.begin(), visits.end(), [](const auto& n) { return n == 1; }))
            << count << " by " << grain;
        EXPECT_TRUE(executor != nullptr || tasks == 1);
      }
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::parallel
