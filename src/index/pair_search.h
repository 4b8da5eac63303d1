// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include <fcl_fibers/tree_export.h>

#include "index/pair_query.h"
#include "parallel/executor.h"
#include "tree/search.h"

namespace fcl_fibers::index {

/// A search for overlapping pairs within one tree or between two. See tree/search.h.
class PairSearch {
 public:
  virtual std::int32_t leafCount() const = 0;  ///< of the larger tree
  virtual tree::Visit split(const tree::TraversalTask& task, std::int32_t grain,
                            tree::TaskSink& out) const = 0;
  virtual tree::Visit run(const tree::TraversalTask& task, tree::PairBuffer& out) const = 0;
  /// Is called after the last task of a job, on its thread. Who counts the work of jobs needs it.
  virtual void endJob() const {}

 protected:
  ~PairSearch() = default;
};

/// Collects pairs and hands them on, through the filter if there is one.
class SerialBuffer final : public tree::PairBuffer {
 public:
  /// @param worker   the number of the thread that uses it
  /// @param stopped  whether the search has been stopped; null if this thread alone stops it
  SerialBuffer(const PairFilter* filter, PairSink& sink, int worker = 0,
               const std::atomic<bool>* stopped = nullptr)
      : filter_(filter), sink_(&sink), worker_(worker), stopped_(stopped) {
    restart();
  }
  SerialBuffer(const SerialBuffer&) = delete;
  SerialBuffer& operator=(const SerialBuffer&) = delete;

  /// @pre it is empty
  void setSink(PairSink& sink) { sink_ = &sink; }

  /// Must be called at the end of a search, too.
  tree::Visit full() override;

 private:
  static constexpr std::size_t kFirst = 8, kCapacity = 1024;

  void restart() {
    next_ = pairs_;
    end_ = pairs_ + limit_;
  }

  const PairFilter* filter_;
  PairSink* sink_;
  const int worker_;
  const std::atomic<bool>* const stopped_;
  std::vector<geometry::Impact> impacts_;
  std::size_t limit_ = kFirst;
  tree::Pair pairs_[kCapacity + kRoom];
};

/// Memory for pairs that one thread has found, those of one job after those of another.
struct FoundBlock {
  static constexpr std::size_t kCapacity = 4096;

  std::unique_ptr<tree::Pair[]> pairs{new tree::Pair[kCapacity]};
  std::unique_ptr<geometry::Impact[]> impacts;  ///< null if none are searched for
  std::size_t count = 0;
  std::atomic<int> users{0};  ///< jobs whose pairs are needed, and the thread that fills it

  std::size_t memoryUsage() const {
    return sizeof(*this) +
           kCapacity * (sizeof(tree::Pair) + (impacts ? sizeof(geometry::Impact) : 0));
  }
};

/// Memory that one search on several threads leaves to the next.
class BlockPool {
 public:
  using Blocks = std::vector<std::unique_ptr<FoundBlock>>;

  FCL_FIBERS_TREE_EXPORT ~BlockPool();

  /// Excludes blocks that a search has at present.
  std::size_t memoryUsage();
  void clear() { take(); }
  /// Frees memory beyond this size, now and whenever blocks are given back.
  void keepAtMost(std::size_t bytes);

  /// Returns all blocks, which searches that run at the same time must not share.
  Blocks take();
  void giveBack(Blocks blocks);

 private:
  void trim();

  std::mutex mutex_;
  Blocks blocks_;
  std::size_t most_kept_ = std::size_t{1} << 22;
};

/// Hands on every pair whose volumes overlap and that passes the filter, if there is one. Pairs and
/// their order are the same for every executor, unless the sink takes them in any order.
/// @param executor  null for one thread
tree::Visit findPairs(const PairSearch& search, const PairFilter* filter,
                      parallel::Executor* executor, BlockPool& pool, PairSink& sink);

/// Hands on runs that have been found, in their order or as the sink takes them.
/// @param executor  null for one thread
tree::Visit handOn(const std::vector<PairRun>& runs, parallel::Executor* executor, PairSink& sink);

}  // namespace fcl_fibers::index
