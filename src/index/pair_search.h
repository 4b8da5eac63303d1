// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include <fcl_fibers/tree_export.h>

#include "index/pair_query.h"
#include "parallel/executor.h"
#include "tree/search.h"

namespace fcl_fibers::index {

/// A search for overlapping pairs within one tree or between two, split into tasks of some
/// microseconds.
class PairSearch {
 public:
  virtual tree::Visit split(tree::TaskSink& out) const = 0;
  virtual tree::Visit run(const tree::TraversalTask& task, tree::PairBuffer& out) const = 0;

 protected:
  ~PairSearch() = default;
};

/// Collects pairs on the stack and hands them on, through the filter if there is one.
class SerialBuffer final : public tree::PairBuffer {
 public:
  SerialBuffer(const PairFilter* filter, PairSink& sink) : filter_(filter), sink_(sink) {
    restart();
  }
  SerialBuffer(const SerialBuffer&) = delete;
  SerialBuffer& operator=(const SerialBuffer&) = delete;

  /// Must be called at the end of a search, too.
  tree::Visit full() override;

 private:
  static constexpr std::size_t kFirst = 8, kCapacity = 1024;

  void restart() {
    next_ = pairs_;
    end_ = pairs_ + limit_;
  }

  const PairFilter* filter_;
  PairSink& sink_;
  std::vector<geometry::Impact> impacts_;
  std::size_t limit_ = kFirst;
  tree::Pair pairs_[kCapacity + kRoom];
};

/// Keeps all pairs of a task. It has cache lines of its own, because several threads run tasks at
/// once and each pair that they find moves next_.
class alignas(64) TaskBuffer final : public tree::PairBuffer {
 public:
  void start();
  /// Filters the pairs, if there is a filter, and returns how many there were before.
  std::size_t finish(const PairFilter* filter);
  tree::Visit full() override;

  tree::Visit handTo(PairSink& sink) const;
  std::size_t memoryUsage() const {
    return pairs_.capacity() * sizeof(tree::Pair) + impacts_.capacity() * sizeof(geometry::Impact);
  }
  void release() {
    pairs_ = std::vector<tree::Pair>();
    impacts_ = std::vector<geometry::Impact>();
  }
  /// Frees memory that only tasks with very many pairs need.
  void trim() {
    if (std::max(pairs_.capacity(), impacts_.capacity()) > kMostKept) release();
  }

 private:
  static constexpr std::size_t kFirst = 256, kMostKept = 8192;

  void restart(std::size_t count) {
    next_ = pairs_.data() + count;
    end_ = pairs_.data() + pairs_.size() - kRoom;
  }

  std::vector<tree::Pair> pairs_;
  std::vector<geometry::Impact> impacts_;
  std::size_t count_ = 0;
};

/// Memory that one search on several threads leaves to the next.
struct SearchScratch {
  /// Consecutive tasks and the pairs found by each.
  struct Window {
    std::vector<tree::TraversalTask> tasks;
    std::vector<TaskBuffer> buffers;
  };
  std::array<Window, 2> windows;

  /// Frees the pairs of some tasks, until at most this many bytes are left or all pairs are freed.
  void trim(std::size_t most);
  std::size_t memoryUsage() const;  ///< including this object
};

/// Lends scratch memory, which searches that run at the same time must not share.
class ScratchPool {
 public:
  FCL_FIBERS_TREE_EXPORT ~ScratchPool();

  /// Excludes memory that is lent at present.
  std::size_t memoryUsage();
  void clear() { giveBack(nullptr); }
  /// Frees kept memory beyond this size, now and whenever a scratch is given back.
  void keepAtMost(std::size_t bytes);

  /// Holds a scratch until it goes out of scope.
  class Lease {
   public:
    explicit Lease(ScratchPool& pool) : pool_(pool), scratch_(pool.take()) {}
    ~Lease() { pool_.giveBack(std::move(scratch_)); }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    SearchScratch& operator*() const { return *scratch_; }

   private:
    ScratchPool& pool_;
    std::unique_ptr<SearchScratch> scratch_;
  };

 private:
  std::unique_ptr<SearchScratch> take();
  /// Keeps only the last scratch that was given back, and at most most_kept_ bytes of it.
  void giveBack(std::unique_ptr<SearchScratch> scratch);

  void trimSpare();

  std::mutex mutex_;
  std::unique_ptr<SearchScratch> spare_;
  std::size_t most_kept_ = std::size_t{1} << 22;
};

/// Hands on every pair whose volumes overlap and that passes the filter, if there is one. Pairs and
/// their order are the same for every executor. The sink is called on the calling thread.
/// @param executor  null for one thread
tree::Visit findPairs(const PairSearch& search, const PairFilter* filter,
                      parallel::Executor* executor, ScratchPool& scratch, PairSink& sink);

}  // namespace fcl_fibers::index
