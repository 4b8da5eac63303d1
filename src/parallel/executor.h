// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>

namespace fcl_fibers::parallel {

/// Refers to something that is called with these arguments. Unlike std::function it does not
/// allocate.
template <class... Args>
class FunctionRef {
 public:
  /// @pre the callee outlives the reference
  template <class F>
  FunctionRef(const F& callee)  // NOLINT: to be passed like the callee itself
      : callee_(&callee),
        call_([](const void* f, Args... args) { (*static_cast<const F*>(f))(args...); }) {}

  void operator()(Args... args) const { call_(callee_, args...); }

 private:
  const void* callee_;
  void (*call_)(const void*, Args...);
};

/// Runs tasks on several threads. Nothing of an answer may depend on which thread runs what.
class Executor {
 public:
  virtual ~Executor() = default;

  /// Calls task(0), ..., task(count - 1), some of them at the same time, while the caller's thread
  /// does `foreground`; then that thread takes part. Returns when all have ended. What any of them
  /// throws is thrown here, one of them if several do, and tasks that have not started then need
  /// not run. May be called from several threads, and within `foreground`.
  virtual void parallelForWithForeground(FunctionRef<> foreground, int count,
                                         FunctionRef<int> task) = 0;

  void parallelFor(int count, FunctionRef<int> task) {
    parallelForWithForeground([] {}, count, task);
  }
};

/// An executor of that many threads; null for one, which needs none.
/// @pre threads > 0
std::unique_ptr<Executor> makeExecutor(int threads);

/// Splits [0, count) among tasks of some `grain` each: visit(begin, end).
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
