// SPDX-License-Identifier: BSD-3-Clause
#include "parallel/executor.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <new>
#include <utility>

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

namespace fcl_fibers::parallel {
namespace {

/// Whether this thread runs a task.
thread_local bool t_runs_task = false;

/// One call of parallelForWithForeground().
///
/// The caller's thread never enters oneTBB. If it waited there for its helpers, it would run
/// helpers of other calls meanwhile, which may wait for what this call's foreground does. Helpers
/// that come when the call is closed find nothing to do, so a call keeps itself until the last of
/// them has come.
class Call {
 public:
  Call(int count, FunctionRef<int> task) : count_(count), task_(task) {}

  void run(tbb::task_arena& arena, int helpers, FunctionRef<> foreground) {
    try {
      for (int i = 0; i < helpers; ++i) arena.enqueue(Helper(*this));
    } catch (...) {
      // There is no memory for another helper. Those that there are do the work, or the caller.
    }
    takeTasks(foreground);
    std::unique_lock<std::mutex> lock(mutex_);
    is_closed_ = true;
    all_left_.wait(lock, [this] { return inside_ == 0; });
    const std::exception_ptr error = std::move(error_);
    lock.unlock();
    letGo();
    if (error) std::rethrow_exception(error);
  }

 private:
  ~Call() = default;

  /// What oneTBB runs. ThreadSanitizer does not look into oneTBB, so an atomic tells it that this
  /// happens after the call began.
  class Helper {
   public:
    explicit Helper(Call& call) {
      call.users_.fetch_add(1, std::memory_order_relaxed);
      call_.store(&call, std::memory_order_release);
    }
    Helper(const Helper& other) : Helper(*other.call_.load(std::memory_order_acquire)) {}
    Helper& operator=(const Helper&) = delete;
    ~Helper() { call_.load(std::memory_order_acquire)->letGo(); }

    void operator()() const { call_.load(std::memory_order_acquire)->help(); }

   private:
    std::atomic<Call*> call_;
  };

  void letGo() {
    if (users_.fetch_sub(1, std::memory_order_acq_rel) == 1) delete this;
  }

  void help() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (is_closed_) return;
      ++inside_;
    }
    // A task that uses oneTBB and waits there must not become a helper of another call.
    tbb::this_task_arena::isolate([this] { takeTasks([] {}); });
    const std::lock_guard<std::mutex> lock(mutex_);
    if (--inside_ == 0) all_left_.notify_all();
  }

  int next() { return next_.fetch_add(1, std::memory_order_relaxed); }
  void takeTasks(FunctionRef<> first) {
    struct RunsTask {
      const bool before = std::exchange(t_runs_task, true);
      ~RunsTask() { t_runs_task = before; }
    };
    try {
      first();
      const RunsTask runs_task;
      for (int i = next(); i < count_; i = next()) task_(i);
    } catch (...) {
      next_.store(count_, std::memory_order_relaxed);
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!error_) error_ = std::current_exception();
    }
  }

  const int count_;
  const FunctionRef<int> task_;
  std::atomic<int> next_{0};
  std::atomic<int> users_{1};  ///< the caller, and helpers that have not come or are inside

  std::mutex mutex_;  ///< of all below
  std::condition_variable all_left_;
  bool is_closed_ = false;
  int inside_ = 0;  ///< helpers
  std::exception_ptr error_;
};

class TbbExecutor : public Executor {
 public:
  /// More threads than oneTBB allows would only make it print a warning.
  explicit TbbExecutor(int threads) : arena_(std::min(threads, mostThreads())) {}

  int threads() const override { return arena_.max_concurrency(); }

  void parallelForWithForeground(FunctionRef<> foreground, int count,
                                 FunctionRef<int> task) override {
    Call* const call = t_runs_task ? nullptr : new (std::nothrow) Call(count, task);
    if (call != nullptr) return call->run(arena_, std::min(threads() - 1, count), foreground);
    foreground();
    for (int i = 0; i < count; ++i) task(i);
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
