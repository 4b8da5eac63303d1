// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>

namespace fcl_fibers::parallel {

/// Refers to something that is called with the number of a task. Other than std::function it takes
/// no memory.
class TaskRef {
 public:
  /// @pre the task outlives the reference
  template <class F>
  TaskRef(const F& task)  // NOLINT: to be passed like the task itself
      : task_(&task), call_([](const void* f, int i) { (*static_cast<const F*>(f))(i); }) {}

  void operator()(int i) const { call_(task_, i); }

 private:
  const void* task_;
  void (*call_)(const void*, int);
};

/// Runs tasks on several threads. Nothing of an answer may depend on which thread runs what.
class Executor {
 public:
  virtual ~Executor() = default;

  /// Calls task(0), ..., task(count - 1), some of them at the same time, the caller's thread taking
  /// part; returns when all have ended. What a task throws is thrown here, one of them if several
  /// do, and tasks that have not started then need not run. May be called from several threads.
  virtual void run(int count, TaskRef task) = 0;
};

/// An executor of that many threads; null for one, which needs none. Of oneTBB if the library was
/// built with it, else of std::thread.
/// @pre threads > 0
std::unique_ptr<Executor> makeExecutor(int threads);

/// Splits [0, count) among tasks of some `grain` each: visit(begin, end).
template <class F>
void forRanges(Executor* executor, std::size_t count, std::size_t grain, F&& visit) {
  if (executor == nullptr || count <= grain) return visit(std::size_t{0}, count);
  const auto tasks = static_cast<int>((count + grain - 1) / grain);
  const auto task = [&](int i) {
    const std::size_t begin = static_cast<std::size_t>(i) * grain;
    visit(begin, begin + grain < count ? begin + grain : count);
  };
  executor->run(tasks, task);
}

}  // namespace fcl_fibers::parallel
