// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "parallel/executor.h"

namespace fcl_fibers::parallel {
namespace {

class TbbExecutor : public Executor {
 public:
  /// More threads than the machine has would only make oneTBB print a warning.
  explicit TbbExecutor(int threads) : arena_(std::min(threads, tbb::info::default_concurrency())) {}

  void run(int count, TaskRef task) override {
    arena_.execute([&] {
      // Isolated, so that a waiting caller does not pick up another query's callback.
      tbb::this_task_arena::isolate([&] { tbb::parallel_for(0, count, task); });
    });
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
