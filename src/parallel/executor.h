// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>

namespace fcl_fibers::parallel {

/// Refers to a callable. Unlike std::function it does not allocate.
template <class... Args>
class FunctionRef {
 public:
  /// @pre the callee outlives the reference
  template <class F>
  FunctionRef(const F& callee)  // NOLINT: passed like the callee itself
      : callee_(&callee),
        call_([](const void* f, Args... args) { (*static_cast<const F*>(f))(args...); }) {}

  void operator()(Args... args) const { call_(callee_, args...); }

 private:
  const void* callee_;
  void (*call_)(const void*, Args...);
};

/// Runs tasks on several threads. No answer may depend on which thread runs which task.
class Executor {
 public:
  virtual ~Executor() = default;

  /// The most threads that run tasks at the same time, the caller's included.
  virtual int threads() const = 0;

  /// Calls task(0), ..., task(count - 1), some of them at the same time, while the caller's thread
  /// runs `foreground` and then takes part. Returns when all have ended. If any of them throws, one
  /// of the exceptions is thrown here, and tasks that have not started may be skipped. May be
  /// called from several threads, and within `foreground`, which may wait for other threads that
  /// call it. Within a task it runs all on the task's thread, because the other threads have tasks
  /// of their own.
  virtual void parallelForWithForeground(FunctionRef<> foreground, int count,
                                         FunctionRef<int> task) = 0;

  void parallelFor(int count, FunctionRef<int> task) {
    parallelForWithForeground([] {}, count, task);
  }
};

/// Returns an executor of this many threads; null for one thread, which needs no executor. More
/// threads than oneTBB allows are not made: that is as many as there are cores, unless the program
/// has a tbb::global_control.
std::unique_ptr<Executor> makeExecutor(int threads);

/// Splits [0, count) into tasks of `grain` each and calls visit(begin, end) for every task.
template <class F>
void forRanges(Executor* executor, std::size_t count, std::size_t grain, F&& visit) {
  if (executor == nullptr || count <= grain) return visit(std::size_t{0}, count);
  const auto tasks = static_cast<int>((count + grain - 1) / grain);
  executor->parallelFor(tasks, [&](int i) {
    const std::size_t begin = static_cast<std::size_t>(i) * grain;
    visit(begin, begin + grain < count ? begin + grain : count);
  });
}

}  // namespace fcl_fibers::parallel
