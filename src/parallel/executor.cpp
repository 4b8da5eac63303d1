// SPDX-License-Identifier: BSD-3-Clause
#include "parallel/executor.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <utility>

#include <tbb/global_control.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

namespace fcl_fibers::parallel {
namespace {

/// Whether this thread runs a task.
thread_local bool t_runs_task = false;

/// One call of parallelForWithForeground().
class Call {
 public:
  Call(tbb::task_arena& arena, int count, FunctionRef<int> task)
      : arena_(arena), count_(count), task_(task) {}

  void run(FunctionRef<> foreground) {
    // The foreground runs outside the arena, where no other thread can pick it up and this thread
    // cannot pick up another query's tasks. If helpers leave tasks, because they start late or the
    // caller's task group was cancelled, this thread does them.
    arena_.execute(OnAnyThread<&Call::startHelpers>(*this));
    takeTasks(foreground);
    arena_.execute(OnAnyThread<&Call::waitForHelpers>(*this));
    ended_.load(std::memory_order_acquire);
    if (error_) std::rethrow_exception(std::move(error_));
  }

 private:
  struct RunsTask {
    RunsTask() { t_runs_task = true; }
    ~RunsTask() { t_runs_task = false; }
    RunsTask(const RunsTask&) = delete;
    RunsTask& operator=(const RunsTask&) = delete;
  };

  /// Calls a member function on the thread that oneTBB chooses. ThreadSanitizer does not look into
  /// oneTBB, so two atomics tell it that this happens after the call began and before it ends.
  template <void (Call::*kFunction)()>
  class OnAnyThread {
   public:
    explicit OnAnyThread(Call& call) { call_.store(&call, std::memory_order_release); }
    OnAnyThread(const OnAnyThread& other) : OnAnyThread(*other.call_.load()) {}

    void operator()() const {
      Call& call = *call_.load(std::memory_order_acquire);
      (call.*kFunction)();
      call.ended_.fetch_add(1, std::memory_order_release);
    }

   private:
    std::atomic<Call*> call_;
  };

  void startHelpers() {
    for (int i = 1; i < std::min(arena_.max_concurrency(), count_ + 1); ++i) {
      helpers_.run(OnAnyThread<&Call::help>(*this));
    }
  }
  void waitForHelpers() { helpers_.wait(); }
  void help() {
    takeTasks([] {});
  }

  int next() { return next_.fetch_add(1, std::memory_order_relaxed); }
  void takeTasks(FunctionRef<> first) {
    try {
      first();
      const RunsTask runs_task;
      for (int i = next(); i < count_; i = next()) task_(i);
    } catch (...) {
      next_.store(count_, std::memory_order_relaxed);
      if (!failed_.exchange(true)) error_ = std::current_exception();
    }
  }

  tbb::task_arena& arena_;
  const int count_;
  const FunctionRef<int> task_;
  std::atomic<int> next_{0};
  std::atomic<int> ended_{0};  ///< functions that have ended, on any thread
  std::atomic<bool> failed_{false};
  std::exception_ptr error_;
  tbb::task_group helpers_;
};

class TbbExecutor : public Executor {
 public:
  /// More threads than oneTBB allows would only make it print a warning.
  explicit TbbExecutor(int threads) : arena_(std::min(threads, mostThreads())) {}

  int threads() const override { return arena_.max_concurrency(); }

  void parallelForWithForeground(FunctionRef<> foreground, int count,
                                 FunctionRef<int> task) override {
    if (t_runs_task) {
      foreground();
      for (int i = 0; i < count; ++i) task(i);
      return;
    }
    Call(arena_, count, task).run(foreground);
  }

 private:
  /// As many as there are cores, unless the program asks for more or fewer.
  static int mostThreads() {
    using Control = tbb::global_control;
    return static_cast<int>(Control::active_value(Control::max_allowed_parallelism));
  }

  tbb::task_arena arena_;
};

}  // namespace

std::unique_ptr<Executor> makeExecutor(int threads) {
  if (threads == 1) return nullptr;
  return std::make_unique<TbbExecutor>(threads);
}

}  // namespace fcl_fibers::parallel
