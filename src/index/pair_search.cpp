// SPDX-License-Identifier: BSD-3-Clause
#include "index/pair_search.h"

#include <algorithm>
#include <atomic>
#include <utility>

namespace fcl_fibers::index {

using geometry::Impact;
using tree::Pair;
using tree::TraversalTask;
using tree::Visit;

namespace {

/// @param impacts  that of each pair; empty if the search is not one for impacts
Visit hand(const Pair* pairs, const std::vector<Impact>& impacts, std::size_t count,
           PairSink& sink) {
  if (count == 0) return Visit::kContinue;
  return impacts.empty() ? sink.take(pairs, count) : sink.takeImpacts(pairs, impacts.data(), count);
}

}  // namespace

Visit SerialBuffer::full() {
  auto count = static_cast<std::size_t>(next_ - pairs_);
  impacts_.clear();
  if (filter_ != nullptr) count = filter_->keep(pairs_, count, impacts_);
  // The limit starts small, so that a search for the first pair does not wait for many.
  limit_ = std::min(2 * limit_, kCapacity);
  restart();
  return hand(pairs_, impacts_, count, sink_);
}

void TaskBuffer::start() {
  if (pairs_.empty()) pairs_.resize(kFirst + kRoom);
  restart(0);
}

std::size_t TaskBuffer::finish(const PairFilter* filter) {
  const auto found = static_cast<std::size_t>(next_ - pairs_.data());
  impacts_.clear();
  count_ = filter != nullptr ? filter->keep(pairs_.data(), found, impacts_) : found;
  return found;
}

Visit TaskBuffer::handTo(PairSink& sink) const {
  return hand(pairs_.data(), impacts_, count_, sink);
}

Visit TaskBuffer::full() {
  const auto count = static_cast<std::size_t>(next_ - pairs_.data());
  pairs_.resize(2 * pairs_.size());
  restart(count);
  return Visit::kContinue;
}

void SearchScratch::trim(std::size_t most) {
  for (Window& window : windows) {
    for (TaskBuffer& buffer : window.buffers) buffer.trim();
  }
  std::size_t bytes = memoryUsage();
  for (Window& window : windows) {
    // Every window uses the first buffers.
    for (auto buffer = window.buffers.rbegin(); buffer != window.buffers.rend(); ++buffer) {
      if (bytes <= most) return;
      bytes -= buffer->memoryUsage();
      buffer->release();
    }
  }
}

std::size_t SearchScratch::memoryUsage() const {
  std::size_t bytes = sizeof(*this);
  for (const Window& window : windows) {
    bytes += window.tasks.capacity() * sizeof(TraversalTask) +
             window.buffers.capacity() * sizeof(TaskBuffer);
    for (const TaskBuffer& buffer : window.buffers) bytes += buffer.memoryUsage();
  }
  return bytes;
}

ScratchPool::~ScratchPool() = default;

std::size_t ScratchPool::memoryUsage() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return spare_ ? spare_->memoryUsage() : 0;
}

std::unique_ptr<SearchScratch> ScratchPool::take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::unique_ptr<SearchScratch> scratch = std::move(spare_);
  return scratch ? std::move(scratch) : std::make_unique<SearchScratch>();
}

void ScratchPool::giveBack(std::unique_ptr<SearchScratch> scratch) {
  const std::lock_guard<std::mutex> lock(mutex_);
  spare_ = std::move(scratch);
  trimSpare();
}

void ScratchPool::keepAtMost(std::size_t bytes) {
  const std::lock_guard<std::mutex> lock(mutex_);
  most_kept_ = bytes;
  trimSpare();
}

/// @pre the mutex is locked
void ScratchPool::trimSpare() {
  if (spare_) spare_->trim(most_kept_);
  if (spare_ && spare_->memoryUsage() > most_kept_) spare_.reset();
}

namespace {

/// Runs each task at once.
class SerialTasks final : public tree::TaskSink {
 public:
  SerialTasks(const PairSearch& search, tree::PairBuffer& out) : search_(search), out_(out) {}
  Visit take(const TraversalTask& task) override { return search_.run(task, out_); }

 private:
  const PairSearch& search_;
  tree::PairBuffer& out_;
};

/// Collects tasks in windows. While other threads search a window, the calling thread hands on the
/// pairs of the window before, in the order of the tasks.
class ParallelTasks final : public tree::TaskSink {
 public:
  ParallelTasks(const PairSearch& search, const PairFilter* filter, parallel::Executor& executor,
                SearchScratch& scratch, PairSink& sink)
      : search_(search),
        filter_(filter),
        executor_(executor),
        sink_(sink),
        searched_(&scratch.windows[0]),
        filling_(&scratch.windows[1]) {
    for (SearchScratch::Window& window : scratch.windows) {
      window.tasks.clear();
    }
  }

  Visit take(const TraversalTask& task) override {
    filling_->tasks.push_back(task);
    while (filling_->tasks.size() >= limit_) {
      if (advance() == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }
  Visit finish() {
    while (!filling_->tasks.empty()) {
      if (advance() == Visit::kStop) return Visit::kStop;
    }
    return deliver();
  }

 private:
  Visit advance() {
    if (filling_->buffers.size() < filling_->tasks.size()) {
      filling_->buffers.resize(filling_->tasks.size());
    }
    std::atomic<bool> stopped{false};
    std::atomic<std::size_t> found{0}, searched{filling_->tasks.size()};
    const auto search = [&](int i) {
      if (stopped.load(std::memory_order_relaxed)) return;
      const auto number = static_cast<std::size_t>(i);
      TaskBuffer& buffer = filling_->buffers[number];
      if (i > 0 && found.load(std::memory_order_relaxed) > kManyPairs) {
        // This task and all after it go to the next window.
        std::size_t end = searched.load(std::memory_order_relaxed);
        while (number < end && !searched.compare_exchange_weak(end, number)) {
        }
        buffer.release();
        return;
      }
      buffer.start();
      search_.run(filling_->tasks[number], buffer);
      found.fetch_add(buffer.finish(filter_), std::memory_order_relaxed);
    };
    const auto deliver_before = [&] {
      if (deliver() == Visit::kStop) stopped.store(true, std::memory_order_relaxed);
    };
    executor_.parallelForWithForeground(deliver_before, static_cast<int>(filling_->tasks.size()),
                                        search);
    if (stopped) return Visit::kStop;
    std::swap(searched_, filling_);
    for (TaskBuffer& buffer : filling_->buffers) buffer.trim();
    const auto left = searched_->tasks.begin() + static_cast<std::ptrdiff_t>(searched.load());
    filling_->tasks.assign(left, searched_->tasks.end());
    for (std::size_t i = searched; i < searched_->tasks.size(); ++i) {
      searched_->buffers[i].release();
    }
    searched_->tasks.erase(left, searched_->tasks.end());
    limit_ =
        found > kManyPairs ? std::max(limit_ / 2, kFirstLimit) : std::min(2 * limit_, kCapacity);
    return Visit::kContinue;
  }

  Visit deliver() {
    for (std::size_t i = 0; i < searched_->tasks.size(); ++i) {
      if (searched_->buffers[i].handTo(sink_) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }

  /// The number of tasks in a window. A task finds at most two megabytes of pairs, the square of
  /// its grain. A window that has found many pairs starts no further task.
  static constexpr std::size_t kFirstLimit = 4, kCapacity = 256;
  static constexpr std::size_t kManyPairs = std::size_t{1} << 20;
  const PairSearch& search_;
  const PairFilter* filter_;
  parallel::Executor& executor_;
  PairSink& sink_;
  SearchScratch::Window* searched_;  ///< the window whose pairs are handed on next
  SearchScratch::Window* filling_;
  std::size_t limit_ = kFirstLimit;
};

}  // namespace

Visit findPairs(const PairSearch& search, const PairFilter* filter, parallel::Executor* executor,
                ScratchPool& scratch, PairSink& sink) {
  if (executor == nullptr) {
    SerialBuffer buffer(filter, sink);
    SerialTasks tasks(search, buffer);
    return search.split(tasks) == Visit::kStop ? Visit::kStop : buffer.full();
  }
  const ScratchPool::Lease lease(scratch);
  ParallelTasks tasks(search, filter, *executor, *lease, sink);
  return search.split(tasks) == Visit::kStop ? Visit::kStop : tasks.finish();
}

}  // namespace fcl_fibers::index
