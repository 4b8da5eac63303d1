// SPDX-License-Identifier: BSD-3-Clause
#include "index/pair_search.h"

#include <algorithm>
#include <condition_variable>
#include <limits>
#include <queue>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

namespace fcl_fibers::index {

using geometry::Impact;
using tree::Pair;
using tree::TraversalTask;
using tree::Visit;
using Delivery = PairSink::Delivery;

void requireFew(const char* call, std::size_t pairs, std::size_t most, std::size_t elements,
                const char* remedy) {
  constexpr std::size_t kMostOfElement = 256;
  if (pairs <= most || pairs / kMostOfElement <= elements) return;
  throw std::length_error(std::string("fcl_fibers: ") + call + ": about everything touches " +
                          "everything: there are more than " + std::to_string(pairs - 1) +
                          " pairs of " + std::to_string(elements) +
                          " segments or triangles; see whether the radii and the margin have the "
                          "unit of the points" +
                          remedy);
}

Visit SerialBuffer::full() {
  if (stopped_ != nullptr && *stopped_) return Visit::kStop;
  auto count = static_cast<std::size_t>(next_ - pairs_);
  impacts_.clear();
  if (filter_ != nullptr) count = filter_->keep(pairs_, count, impacts_);
  Impact* const impacts = impacts_.empty() ? nullptr : impacts_.data();
  count = sink_->sift(pairs_, impacts, count);
  // The limit starts small, so that a search for the first pair does not wait for many.
  limit_ = std::min(2 * limit_, kCapacity);
  restart();
  return count == 0 ? Visit::kContinue : sink_->take({pairs_, impacts, count, worker_});
}

BlockPool::~BlockPool() = default;

std::size_t BlockPool::memoryUsage() {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::size_t bytes = 0;
  for (const auto& block : blocks_) bytes += block->memoryUsage();
  return bytes;
}

void BlockPool::keepAtMost(std::size_t bytes) {
  const std::lock_guard<std::mutex> lock(mutex_);
  most_kept_ = bytes;
  trim();
}

BlockPool::Blocks BlockPool::take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(blocks_, {});
}

void BlockPool::giveBack(Blocks blocks) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (blocks.size() > blocks_.size()) blocks_ = std::move(blocks);
  trim();
}

/// @pre the mutex is locked
void BlockPool::trim() {
  std::size_t bytes = 0;
  const auto isBeyond = [&](const auto& block) {
    return (bytes += block->memoryUsage()) > most_kept_;
  };
  blocks_.erase(std::find_if(blocks_.begin(), blocks_.end(), isBeyond), blocks_.end());
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

struct CollectTasks final : tree::TaskSink {
  Visit take(const TraversalTask& task) override {
    tasks.push_back(task);
    return Visit::kContinue;
  }
  std::vector<TraversalTask> tasks;
};

/// A part of a FoundBlock.
struct Piece {
  FoundBlock* block;
  std::size_t begin, count;

  PairRun run() const {
    const Impact* const impacts = block->impacts ? block->impacts.get() + begin : nullptr;
    return {block->pairs.get() + begin, impacts, count};
  }
};

/// Finds pairs on several threads.
///
/// A job is a run of consecutive tasks. A thread that takes a job of large tasks splits them into
/// smaller ones, which become jobs in its place, and goes on with the first. So the whole search is
/// the first job, and all threads split. They take the jobs in the order of their pairs. The
/// calling thread hands on what they find as soon as all before it is handed on, and takes jobs
/// while there is nothing to hand on. There is no other order among the threads, and they wait only
/// where there is no job.
class ParallelSearch {
 public:
  ParallelSearch(const PairSearch& search, const PairFilter* filter, parallel::Executor& executor,
                 BlockPool& pool, PairSink& sink)
      : search_(search),
        filter_(filter),
        executor_(executor),
        sink_(sink),
        delivery_(sink.delivery()),
        work_of_job_(std::clamp<std::size_t>(
            static_cast<std::size_t>(search.leafCount()) / kLeavesPerWork, 1, kMostWork)),
        pool_(pool),
        blocks_(pool.take()) {
    for (const auto& block : blocks_) free_.push_back(block.get());
  }
  ~ParallelSearch() { pool_.giveBack(std::move(blocks_)); }
  ParallelSearch(const ParallelSearch&) = delete;
  ParallelSearch& operator=(const ParallelSearch&) = delete;

  Visit run() {
    int level = 1;
    while (grainOf(level - 1) < search_.leafCount()) ++level;
    const auto all = std::make_shared<const std::vector<TraversalTask>>(1, tree::kAllPairs);
    unclaimed_.push({all, 0, 1, level, {0, Place{1} << 63}});
    while (!stopped_ && !has_ended_) {
      threads_leave_ = false;
      executor_.parallelForWithForeground([this] { protect([this] { lead(); }); },
                                          executor_.threads() - 1,
                                          [this](int i) { protect([&] { help(i + 1); }); });
    }
    if (stopped_) return Visit::kStop;
    if (delivery_ != Delivery::kPlaced) return Visit::kContinue;
    std::vector<PairRun> runs;
    for (; !found_.empty(); found_.pop()) {
      for (const Piece& piece : found_.top().pieces) runs.push_back(piece.run());
    }
    return handOn(runs, &executor_, sink_);
  }

 private:
  /// A place in the order of all pairs. A job has a range of places, which the jobs that it is
  /// split into divide.
  using Place = std::uint64_t;
  struct Range {
    Place begin, end;
  };

  struct Job {
    std::shared_ptr<const std::vector<TraversalTask>> tasks;
    std::size_t begin, end;  ///< of those tasks
    int level;               ///< its tasks have at most grainOf(level) leaves
    Range range;

    std::size_t count() const { return end - begin; }
  };
  /// What a job has found.
  struct Found {
    std::vector<Piece> pieces;
    Range range;
  };
  struct IsLater {
    template <class T>
    bool operator()(const T& p, const T& q) const {
      return p.range.begin > q.range.begin;
    }
  };
  template <class T>
  class FirstInOrder : public std::priority_queue<T, std::vector<T>, IsLater> {
   public:
    T take() {
      T first = std::move(this->c.front());  // IsLater still finds its range
      this->pop();
      return first;
    }
  };

  /// Keeps the pairs of a job.
  class Store final : public PairSink {
   public:
    explicit Store(ParallelSearch& search) : search_(search) {}

    std::size_t sift(Pair* pairs, Impact* impacts, std::size_t count) const override {
      return search_.sink_.sift(pairs, impacts, count);
    }
    Visit take(const PairRun& run) override {
      const std::size_t waited =
          search_.waiting_pairs_.fetch_add(run.count, std::memory_order_relaxed);
      if (search_.delivery_ == Delivery::kPlaced) search_.sink_.requireRoom(waited + run.count);
      for (std::size_t taken = 0; taken < run.count;) {
        if (block_ == nullptr || block_->count == FoundBlock::kCapacity) {
          block_ = search_.anotherBlock(block_, run.impacts != nullptr);
        }
        if (pieces_.empty() || pieces_.back().block != block_) {
          block_->users.fetch_add(1, std::memory_order_relaxed);
          pieces_.push_back({block_, block_->count, 0});
        }
        const std::size_t count =
            std::min(run.count - taken, FoundBlock::kCapacity - block_->count);
        std::copy_n(run.pairs + taken, count, block_->pairs.get() + block_->count);
        if (run.impacts != nullptr) {
          std::copy_n(run.impacts + taken, count, block_->impacts.get() + block_->count);
        }
        block_->count += count;
        pieces_.back().count += count;
        taken += count;
      }
      return Visit::kContinue;
    }
    std::vector<Piece> takePieces() { return std::exchange(pieces_, {}); }

   private:
    ParallelSearch& search_;
    FoundBlock* block_ = nullptr;
    std::vector<Piece> pieces_;
  };

  /// What a thread needs.
  struct Worker {
    Worker(ParallelSearch& search, int number)
        : store(search), buffer(search.filter_, search.sink_, number, &search.stopped_) {}

    Store store;
    SerialBuffer buffer;
  };
  using Lock = std::unique_lock<std::mutex>;
  static void relock(Lock& lock) {
    // The mutex is held for less than a microsecond, and to sleep takes several.
    constexpr int kTries = 30;
    for (int i = 0; i < kTries && !lock.owns_lock(); ++i) {
      if (!lock.try_lock()) std::this_thread::yield();
    }
    if (!lock.owns_lock()) lock.lock();
  }
  Lock locked() {
    Lock lock(mutex_, std::defer_lock);
    relock(lock);
    return lock;
  }

  /// Runs a thread. If it throws, the others stop.
  template <class F>
  void protect(F&& thread) {
    try {
      thread();
    } catch (...) {
      stop();
      throw;
    }
  }
  void stop() {
    const Lock lock = locked();
    stopped_ = true;
    changed_.notify_all();
  }

  /// The calling thread.
  void lead() {
    Worker worker(*this, 0);
    Lock lock = locked();
    while (!stopped_) {
      if (delivery_ == Delivery::kInOrder && isNext(found_)) {
        deliver(lock);
      } else if (threads_leave_ && 2 * waiting_pairs_ < kMostWaiting) {
        return;  // they are called again
      } else if (!unclaimed_.empty() && (mayKeepMore() || isNext(unclaimed_))) {
        perform(worker, lock, delivery_ == Delivery::kInOrder && isNext(unclaimed_));
      } else if (unclaimed_.empty() && running_ == 0) {
        has_ended_ = true;
        return;
      } else {
        wait(lock);
      }
    }
  }
  /// Any other thread.
  void help(int number) {
    Worker worker(*this, number);
    Lock lock = locked();
    while (!stopped_ && !threads_leave_) {
      if (!mayKeepMore()) {
        threads_leave_ = true;
        changed_.notify_all();
      } else if (!unclaimed_.empty()) {
        perform(worker, lock, /*is_next=*/false);
      } else if (running_ == 0) {
        return;
      } else {
        wait(lock);
      }
    }
  }
  void wait(Lock& lock) {
    ++idle_;
    changed_.wait(lock);
    --idle_;
  }

  template <class T>
  bool isNext(const FirstInOrder<T>& all) const {
    return !all.empty() && all.top().range.begin == next_;
  }
  /// Whether threads may go ahead of the sink.
  bool mayKeepMore() const {
    return delivery_ != Delivery::kInOrder || waiting_pairs_ < kMostWaiting;
  }

  /// Performs the first job.
  /// @param is_next  whether all pairs before it are handed on
  void perform(Worker& worker, Lock& lock, bool is_next) {
    Job job = unclaimed_.take();
    ++running_;
    lock.unlock();
    const bool stores =
        delivery_ == Delivery::kPlaced || (delivery_ == Delivery::kInOrder && !is_next);
    worker.buffer.setSink(stores ? static_cast<PairSink&>(worker.store) : sink_);
    while (job.level > 0) split(job);
    Visit visit = Visit::kContinue;
    for (; job.begin < job.end && visit == Visit::kContinue; ++job.begin) {
      if (stopped_) break;
      if (job.count() > 1) share(job, is_next);
      visit = search_.run((*job.tasks)[job.begin], worker.buffer);
    }
    if (visit == Visit::kContinue) visit = worker.buffer.full();
    search_.endJob();
    std::vector<Piece> pieces = worker.store.takePieces();
    relock(lock);
    --running_;
    if (visit == Visit::kStop) stopped_ = true;
    if (is_next) next_ = job.range.end;
    if (stores && (delivery_ == Delivery::kInOrder || !pieces.empty())) {
      found_.push({std::move(pieces), job.range});
    }
    if (idle_ > 0) changed_.notify_all();
  }

  /// Replaces the tasks of a job by smaller ones. All but the first of them become other jobs.
  void split(Job& job) {
    CollectTasks smaller;
    --job.level;
    for (; job.begin < job.end; ++job.begin) {
      search_.split((*job.tasks)[job.begin], grainOf(job.level), smaller);
    }
    job.begin = 0;
    job.end = smaller.tasks.size();
    job.tasks = std::make_shared<const std::vector<TraversalTask>>(std::move(smaller.tasks));
    const std::size_t most = job.level > 0 ? kWorkOfLargeTasks : work_of_job_;
    leave(job, endOfJob(job, most), most);
  }

  /// Leaves tasks to threads that have none, or to later, if too many pairs wait.
  void share(Job& job, bool is_next) {
    if (idle_ > 0) {
      leave(job, job.begin + (job.count() + 1) / 2, SIZE_MAX);
    } else if (!is_next && !mayKeepMore()) {
      leave(job, job.begin + 1, SIZE_MAX);
    }
  }

  /// The end of the first tasks of a job that have at most so much work, or of one task.
  static std::size_t endOfJob(const Job& job, std::size_t most) {
    std::size_t work = 0, end = job.begin;
    for (; end < job.end; ++end) {
      work += (*job.tasks)[end].node != TraversalTask::kCross ? kWorkOfSelfTask : 1;
      if (work > most && end > job.begin) break;
    }
    return end;
  }

  /// Makes other jobs of the tasks of a job from `end` on.
  /// @param most  the work of each of them
  void leave(Job& job, std::size_t end, std::size_t most) {
    if (end == job.end) return;
    const Place width = (job.range.end - job.range.begin) / job.count();
    if (width == 0) return;
    std::vector<Job> others;
    Job rest = job;
    job.end = end;
    for (Job* last = &job; last->end < rest.end; last = &others.back()) {
      rest.begin = last->end;
      last->range.end = rest.range.begin = last->range.begin + width * last->count();
      others.push_back(rest);
      others.back().end = endOfJob(rest, most);
    }
    const Lock lock = locked();
    for (Job& other : others) unclaimed_.push(std::move(other));
    if (idle_ > 0) changed_.notify_all();
  }

  /// Hands on what the next job has found.
  void deliver(Lock& lock) {
    const Found found = found_.take();
    lock.unlock();
    Visit visit = Visit::kContinue;
    std::size_t count = 0;
    for (const Piece& piece : found.pieces) {
      count += piece.count;
      if (visit == Visit::kContinue) visit = sink_.take(piece.run());
    }
    relock(lock);
    for (const Piece& piece : found.pieces) release(piece.block);
    waiting_pairs_.fetch_sub(count, std::memory_order_relaxed);
    next_ = found.range.end;
    if (visit == Visit::kStop) stopped_ = true;
    if (stopped_) changed_.notify_all();
  }

  /// @param full  the one that the thread has filled, or null
  FoundBlock* anotherBlock(FoundBlock* full, bool has_impacts) {
    Lock lock = locked();
    if (full != nullptr) release(full);
    FoundBlock* block = nullptr;
    if (free_.empty()) {
      lock.unlock();
      auto another = std::make_unique<FoundBlock>();
      block = another.get();
      relock(lock);
      blocks_.push_back(std::move(another));
      free_.reserve(blocks_.size());
    } else {
      block = free_.back();
      free_.pop_back();
    }
    lock.unlock();
    if (has_impacts && !block->impacts) block->impacts.reset(new Impact[FoundBlock::kCapacity]);
    if (!has_impacts) block->impacts.reset();
    block->count = 0;
    block->users = 1;
    return block;
  }
  /// @pre the mutex is locked
  void release(FoundBlock* block) {
    if (--block->users == 0) free_.push_back(block);
  }

  /// By each level tasks are eight times as large, as full nodes are by each level of the tree.
  static std::int32_t grainOf(int level) {
    constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
    return static_cast<std::int32_t>(
        std::min(std::int64_t{tree::kLeastGrain} << (3 * level), kMost));
  }

  /// The pairs below one node take about so many times the work of those between two.
  static constexpr std::size_t kWorkOfSelfTask = 16;
  /// A job is worth its locks: it takes some ten thousand tests of volumes. In a small tree it has
  /// less work, so that there are many jobs.
  static constexpr std::size_t kMostWork = 128, kLeavesPerWork = 1 << 14;
  static constexpr std::size_t kWorkOfLargeTasks = 16;
  /// So many pairs may wait for the sink.
  static constexpr std::size_t kMostWaiting = std::size_t{1} << 21;

  const PairSearch& search_;
  const PairFilter* filter_;
  parallel::Executor& executor_;
  PairSink& sink_;
  const Delivery delivery_;
  const std::size_t work_of_job_;
  std::atomic<bool> stopped_{false};
  std::atomic<int> idle_{0};  ///< threads that wait
  std::atomic<std::size_t> waiting_pairs_{0};

  std::mutex mutex_;  ///< of all below
  std::condition_variable changed_;
  FirstInOrder<Job> unclaimed_;
  FirstInOrder<Found> found_;
  Place next_ = 0;              ///< all pairs before are handed on
  int running_ = 0;             ///< jobs
  bool threads_leave_ = false;  ///< because too many pairs wait
  bool has_ended_ = false;
  BlockPool& pool_;
  BlockPool::Blocks blocks_;
  std::vector<FoundBlock*> free_;
};

}  // namespace

Visit findPairs(const PairSearch& search, const PairFilter* filter, parallel::Executor* executor,
                BlockPool& pool, PairSink& sink) {
  const bool is_small = search.leafCount() <= tree::kLeastGrain;
  if (executor == nullptr || is_small) {
    SerialBuffer buffer(filter, sink);
    SerialTasks tasks(search, buffer);
    const Visit visit = is_small ? search.run(tree::kAllPairs, buffer)
                                 : search.split(tree::kAllPairs, tree::kLeastGrain, tasks);
    return visit == Visit::kStop ? visit : buffer.full();
  }
  return ParallelSearch(search, filter, *executor, pool, sink).run();
}

Visit handOn(const std::vector<PairRun>& runs, parallel::Executor* executor, PairSink& sink) {
  if (executor == nullptr || runs.size() < 2 || sink.delivery() == Delivery::kInOrder) {
    for (const PairRun& run : runs) {
      if (run.count > 0 && sink.take(run) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }
  if (sink.delivery() == Delivery::kPlaced) {
    std::vector<std::size_t> begin(1, 0);
    begin.reserve(runs.size() + 1);
    for (const PairRun& run : runs) begin.push_back(begin.back() + run.count);
    sink.makeRoom(begin.back());
    const std::size_t grain = 1 + runs.size() / (8 * static_cast<std::size_t>(executor->threads()));
    parallel::forRanges(executor, runs.size(), grain, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) sink.place(begin[i], runs[i]);
    });
    return Visit::kContinue;
  }
  std::atomic<std::size_t> next{0};
  std::atomic<bool> stopped{false};
  const auto takeRuns = [&](int worker) {
    for (std::size_t i = next++; i < runs.size() && !stopped; i = next++) {
      PairRun run = runs[i];
      run.worker = worker;
      try {
        if (run.count > 0 && sink.take(run) == Visit::kStop) stopped = true;
      } catch (...) {
        stopped = true;
        throw;
      }
    }
  };
  executor->parallelForWithForeground([&] { takeRuns(0); }, executor->threads() - 1,
                                      [&](int i) { takeRuns(i + 1); });
  return stopped ? Visit::kStop : Visit::kContinue;
}

}  // namespace fcl_fibers::index
