// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <atomic>
#include <exception>

#include <tbb/info.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include "parallel/executor.h"

namespace fcl_fibers::parallel {
namespace {

class TbbExecutor : public Executor {
 public:
  /// More threads than the machine has would only make oneTBB print a warning.
  explicit TbbExecutor(int threads) : arena_(std::min(threads, tbb::info::default_concurrency())) {}

  void runBeside(OwnRef own, int count, TaskRef task) override {
    std::atomic<int> next{0};
    const auto take_tasks = [&](OwnRef first) {
      try {
        first();
        for (int i = next++; i < count; i = next++) task(i);
      } catch (...) {
        next = count;
        throw;
      }
    };
    // The caller's own work is done outside the arena, where no other thread can pick it up, nor
    // this one another query's. What helpers leave, because they come late or the caller's group of
    // tasks has been cancelled, this thread does.
    tbb::task_group helpers;
    arena_.execute([&] {
      for (int i = 1; i < std::min(arena_.max_concurrency(), count + 1); ++i) {
        helpers.run([&] { take_tasks([] {}); });
      }
    });
    std::exception_ptr error;
    try {
      take_tasks(own);
    } catch (...) {
      error = std::current_exception();
    }
    arena_.execute([&] { helpers.wait(); });
    if (error) std::rethrow_exception(error);
  }

 private:
  tbb::task_arena arena_;
};

}  // namespace

std::unique_ptr<Executor> makeExecutor(int threads) {
  if (threads == 1) return nullptr;
  return std::make_unique<TbbExecutor>(threads);
}

}  // namespace fcl_fibers::parallel
