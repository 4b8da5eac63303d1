// SPDX-License-Identifier: BSD-3-Clause
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "parallel/executor.h"

namespace fcl_fibers::parallel {
namespace {

/// Workers that sleep between runs.
class ThreadExecutor : public Executor {
 public:
  explicit ThreadExecutor(int threads) {
    try {
      for (int i = 1; i < threads; ++i) workers_.emplace_back([this] { work(); });
    } catch (...) {
      stop();
      throw;
    }
  }
  ~ThreadExecutor() override { stop(); }

  void runBeside(OwnRef own, int count, TaskRef task) override {
    const std::unique_lock<Claim> running(claim_, std::try_to_lock);
    if (!running) {
      // The workers are busy with another query.
      own();
      for (int i = 0; i < count; ++i) task(i);
      return;
    }
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      task_ = &task;
      count_ = count;
      next_ = 0;
      error_ = nullptr;
      ++round_;
    }
    wake_.notify_all();
    takeTasks(own, task, count);
    std::unique_lock<std::mutex> lock(mutex_);
    task_ = nullptr;  // a worker that wakes only now finds nothing
    done_.wait(lock, [&] { return active_ == 0; });
    // Not to be kept: its last owner destroys it, and that should be who catches it.
    if (error_) std::rethrow_exception(std::move(error_));
  }

 private:
  /// Who uses the workers. Other than a mutex, its holder may try to have it again.
  class Claim {
   public:
    bool try_lock() { return !held_.exchange(true, std::memory_order_acquire); }
    void unlock() { held_.store(false, std::memory_order_release); }

   private:
    std::atomic<bool> held_{false};
  };

  void work() {
    std::size_t seen = 0;
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      wake_.wait(lock, [&] { return stopping_ || round_ != seen; });
      if (stopping_) return;
      seen = round_;
      if (task_ == nullptr) continue;
      const TaskRef task = *task_;
      const int count = count_;
      ++active_;
      lock.unlock();
      takeTasks([] {}, task, count);
      lock.lock();
      if (--active_ == 0) done_.notify_all();
    }
  }

  void takeTasks(OwnRef own, TaskRef task, int count) {
    try {
      own();
      for (int i = next_++; i < count; i = next_++) task(i);
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!error_) error_ = std::current_exception();
      next_ = count;
    }
  }

  void stop() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stopping_ = true;
    }
    wake_.notify_all();
    for (std::thread& worker : workers_) worker.join();
  }

  Claim claim_;
  std::mutex mutex_;  ///< guards all that follows but next_
  std::condition_variable wake_, done_;
  const TaskRef* task_ = nullptr;
  int count_ = 0;
  std::size_t round_ = 0;
  int active_ = 0;
  bool stopping_ = false;
  std::exception_ptr error_;
  std::atomic<int> next_{0};
  std::vector<std::thread> workers_;
};

}  // namespace

std::unique_ptr<Executor> makeExecutor(int threads) {
  if (threads == 1) return nullptr;
  return std::make_unique<ThreadExecutor>(threads);
}

}  // namespace fcl_fibers::parallel
