// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "geometry/capsule_test.h"
#include "geometry/frame.h"
#include "geometry/touch.h"
#include "parallel/executor.h"
#include "tree/search.h"

namespace fcl_fibers::tree {

/// Takes the pairs of a query, in runs.
class PairSink {
 public:
  virtual Visit take(const Pair* pairs, std::size_t count) = 0;

 protected:
  ~PairSink() = default;
};

/// Keeps the pairs whose capsules touch: many at a time in float, those near the boundary by
/// touch().
class CapsuleFilter {
 public:
  using Segment = geometry::Segment;

  /// @param a, b    segments by id; those of b are brought into a's frame where `b_to_a` is given
  /// @param margin  in a's frame
  /// @param unit    see CapsulePairs
  CapsuleFilter(const Segment* a, const Segment* b, const geometry::FrameChange* b_to_a,
                double margin, double unit)
      : a_(a), b_(b), b_to_a_(b_to_a), margin_(margin), unit_(unit) {}

  /// Moves the pairs that touch to the front, in their order; returns how many they are.
  std::size_t keepTouching(Pair* pairs, std::size_t count) const {
    return b_to_a_ == nullptr ? keep(pairs, count, FirstFrame{}) : keep(pairs, count, *b_to_a_);
  }

 private:
  struct FirstFrame {
    const Segment& operator()(const Segment& segment) const { return segment; }
    static double error(const Segment& segment) { return endPointError(segment); }
  };

  template <class ToFirst>
  std::size_t keep(Pair* pairs, std::size_t count, const ToFirst& to_first) const {
    const auto first = [&](const Pair& pair) -> const Segment& {
      return a_[static_cast<std::size_t>(pair.a)];
    };
    const auto second = [&](const Pair& pair) -> const Segment& {
      return b_[static_cast<std::size_t>(pair.b)];
    };
    constexpr std::size_t kBlock = geometry::CapsulePairs::kCapacity;
    geometry::CapsulePairs block(unit_);
    std::size_t kept = 0;
    for (std::size_t begin = 0; begin < count; begin += kBlock) {
      const std::size_t end = std::min(begin + kBlock, count);
      block.clear();
      for (std::size_t i = begin; i < end; ++i) {
        const Segment& p = first(pairs[i]);
        const auto& q = to_first(second(pairs[i]));
        block.add(p, q, margin_, endPointError(p) + to_first.error(q));
      }
      const auto verdict = block.decide();
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t byte = (i - begin) / 8, bit = (i - begin) % 8;
        if (verdict.apart[byte] >> bit & 1u) continue;
        if (verdict.touching[byte] >> bit & 1u ||
            touches(first(pairs[i]), to_first(second(pairs[i])), to_first)) {
          pairs[kept++] = pairs[i];
        }
      }
    }
    return kept;
  }
  template <class ToFirst>
  bool touches(const Segment& p, const Segment& q, const ToFirst& to_first) const {
    return touch(p, q, margin_, endPointError(p) + to_first.error(q));
  }

  const Segment* a_;
  const Segment* b_;
  const geometry::FrameChange* b_to_a_;
  double margin_, unit_;
};

namespace internal {

/// Fills a buffer on the stack with pairs and hands them on.
class SerialRun final : public PairBuffer {
 public:
  SerialRun(const CapsuleFilter* filter, PairSink& sink) : filter_(filter), sink_(sink) {
    restart();
  }
  SerialRun(const SerialRun&) = delete;
  SerialRun& operator=(const SerialRun&) = delete;

  Visit full() override {
    auto count = static_cast<std::size_t>(next_ - pairs_);
    if (filter_ != nullptr) count = filter_->keepTouching(pairs_, count);
    // A query that wants the first pair only should not have to wait for many.
    limit_ = std::min(2 * limit_, kCapacity);
    restart();
    return count == 0 ? Visit::kContinue : sink_.take(pairs_, count);
  }

 private:
  static constexpr std::size_t kFirst = 8, kCapacity = 1024;

  void restart() {
    next_ = pairs_;
    end_ = pairs_ + limit_;
  }

  const CapsuleFilter* filter_;
  PairSink& sink_;
  std::size_t limit_ = kFirst;
  Pair pairs_[kCapacity + kRoom];
};

/// Does the work piece by piece as it comes.
template <class Tree, class Trees>
class SerialWork : public WorkSink {
 public:
  SerialWork(const Trees& trees, PairBuffer& out) : trees_(trees), out_(out) {}
  Visit take(const Work& piece) override { return Search<Tree>::overlaps(trees_, piece, out_); }

 private:
  const Trees& trees_;
  PairBuffer& out_;
};

/// Keeps all pairs of a piece of work. On cache lines of its own, as threads search pieces side by
/// side, and each pair moves next_.
class alignas(64) PieceRun final : public PairBuffer {
 public:
  void start() {
    if (pairs_.empty()) pairs_.resize(kFirst + kRoom);
    restart(0);
  }
  /// Returns how many pairs it has found, of which the filter keeps some.
  std::size_t finish(const CapsuleFilter* filter) {
    const auto found = static_cast<std::size_t>(next_ - pairs_.data());
    count_ = filter != nullptr ? filter->keepTouching(pairs_.data(), found) : found;
    return found;
  }
  Visit full() override {
    const auto count = static_cast<std::size_t>(next_ - pairs_.data());
    pairs_.resize(2 * pairs_.size());
    restart(count);
    return Visit::kContinue;
  }
  const Pair* pairs() const { return pairs_.data(); }
  std::size_t count() const { return count_; }
  std::size_t memoryUsage() const { return pairs_.capacity() * sizeof(Pair); }
  void release() { pairs_ = std::vector<Pair>(); }
  /// Gives back what only dense parts of a scene need.
  void trim() {
    if (pairs_.capacity() > kMostKept) release();
  }

 private:
  static constexpr std::size_t kFirst = 256, kMostKept = 8192;

  void restart(std::size_t count) {
    next_ = pairs_.data() + count;
    end_ = pairs_.data() + pairs_.size() - kRoom;
  }

  std::vector<Pair> pairs_;
  std::size_t count_ = 0;
};

}  // namespace internal

/// What a search on several threads keeps for the next one.
struct SearchScratch {
  /// Pieces of work that follow each other, and what has been found in each.
  struct Window {
    std::vector<Work> work;
    std::vector<internal::PieceRun> pieces;
  };
  std::array<Window, 2> windows;

  /// Gives back what is more than a few megabytes in all.
  void trim() {
    constexpr std::size_t kAll = std::size_t{1} << 22;
    std::size_t kept = 0;
    for (Window& window : windows) {
      for (internal::PieceRun& piece : window.pieces) {
        piece.trim();
        if (kept + piece.memoryUsage() > kAll) piece.release();
        kept += piece.memoryUsage();
      }
    }
  }
  std::size_t memoryUsage() const {
    std::size_t bytes = 0;
    for (const Window& window : windows) {
      bytes += window.work.capacity() * sizeof(Work) +
               window.pieces.capacity() * sizeof(internal::PieceRun);
      for (const internal::PieceRun& piece : window.pieces) bytes += piece.memoryUsage();
    }
    return bytes;
  }
};

/// Lends what queries that run at the same time each need for themselves.
class ScratchPool {
 public:
  /// Of what is kept for the next query.
  std::size_t memoryUsage() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return spare_ ? sizeof(SearchScratch) + spare_->memoryUsage() : 0;
  }
  void clear() { giveBack(nullptr); }

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
  std::unique_ptr<SearchScratch> take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::unique_ptr<SearchScratch> scratch = std::move(spare_);
    return scratch ? std::move(scratch) : std::make_unique<SearchScratch>();
  }
  /// One is kept for the next query; where several gave theirs back, the last.
  void giveBack(std::unique_ptr<SearchScratch> scratch) {
    if (scratch) scratch->trim();
    const std::lock_guard<std::mutex> lock(mutex_);
    spare_ = std::move(scratch);
  }

  std::mutex mutex_;
  std::unique_ptr<SearchScratch> spare_;
};

namespace internal {

/// Collects work, shares it out, and hands the pairs on in the order of the work: a window of it at
/// a time, while the other threads search the next one.
template <class Tree, class Trees>
class ParallelWork : public WorkSink {
 public:
  ParallelWork(const Trees& trees, const CapsuleFilter* filter, parallel::Executor& executor,
               SearchScratch& scratch, PairSink& sink)
      : trees_(trees),
        filter_(filter),
        executor_(executor),
        sink_(sink),
        searched_(&scratch.windows[0]),
        filling_(&scratch.windows[1]) {
    for (SearchScratch::Window& window : scratch.windows) {
      window.work.clear();
      window.work.reserve(kCapacity);
      window.pieces.resize(kCapacity);
    }
  }

  Visit take(const Work& piece) override {
    filling_->work.push_back(piece);
    while (filling_->work.size() >= limit_) {
      if (advance() == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }
  Visit finish() {
    while (!filling_->work.empty()) {
      if (advance() == Visit::kStop) return Visit::kStop;
    }
    return deliver();
  }

 private:
  Visit advance() {
    std::atomic<bool> stopped{false};
    std::atomic<std::size_t> found{0}, searched{filling_->work.size()};
    const auto search = [&](int i) {
      if (stopped.load(std::memory_order_relaxed)) return;
      const auto number = static_cast<std::size_t>(i);
      PieceRun& piece = filling_->pieces[number];
      if (i > 0 && found.load(std::memory_order_relaxed) > kManyPairs) {
        // Left to the next window, and all behind it.
        std::size_t end = searched.load(std::memory_order_relaxed);
        while (number < end && !searched.compare_exchange_weak(end, number)) {
        }
        piece.release();
        return;
      }
      piece.start();
      Search<Tree>::overlaps(trees_, filling_->work[number], piece);
      found.fetch_add(piece.finish(filter_), std::memory_order_relaxed);
    };
    const auto deliver_before = [&] {
      if (deliver() == Visit::kStop) stopped.store(true, std::memory_order_relaxed);
    };
    executor_.parallelForWithForeground(deliver_before, static_cast<int>(filling_->work.size()),
                                        search);
    if (stopped) return Visit::kStop;
    std::swap(searched_, filling_);
    for (PieceRun& piece : filling_->pieces) piece.trim();
    const auto left = searched_->work.begin() + static_cast<std::ptrdiff_t>(searched.load());
    filling_->work.assign(left, searched_->work.end());
    for (std::size_t i = searched; i < searched_->work.size(); ++i) searched_->pieces[i].release();
    searched_->work.erase(left, searched_->work.end());
    limit_ =
        found > kManyPairs ? std::max(limit_ / 2, kFirstLimit) : std::min(2 * limit_, kCapacity);
    return Visit::kContinue;
  }

  Visit deliver() {
    for (std::size_t i = 0; i < searched_->work.size(); ++i) {
      const PieceRun& piece = searched_->pieces[i];
      if (piece.count() > 0 && sink_.take(piece.pairs(), piece.count()) == Visit::kStop) {
        return Visit::kStop;
      }
    }
    return Visit::kContinue;
  }

  /// Pieces in a window. A piece has at most the square of the grain of Search::cut() of pairs, two
  /// megabytes; a window ends before the piece at which it has many.
  static constexpr std::size_t kFirstLimit = 4, kCapacity = 256;
  static constexpr std::size_t kManyPairs = std::size_t{1} << 20;
  const Trees& trees_;
  const CapsuleFilter* filter_;
  parallel::Executor& executor_;
  PairSink& sink_;
  SearchScratch::Window* searched_;  ///< whose pairs are to be handed on
  SearchScratch::Window* filling_;
  std::size_t limit_ = kFirstLimit;
};

}  // namespace internal

/// Every pair whose volumes overlap and that the filter, if there is one, keeps: of one tree
/// (`Trees` is Tree), or of two (`Search<Tree>::Two`). The same pairs in the same order whatever
/// the executor; the sink is called on this thread.
template <class Tree, class Trees>
Visit findPairs(const Trees& trees, const CapsuleFilter* filter, parallel::Executor* executor,
                SearchScratch& scratch, PairSink& sink) {
  if (executor == nullptr) {
    internal::SerialRun run(filter, sink);
    internal::SerialWork<Tree, Trees> work(trees, run);
    return Search<Tree>::cut(trees, work) == Visit::kStop ? Visit::kStop : run.full();
  }
  internal::ParallelWork<Tree, Trees> work(trees, filter, *executor, scratch, sink);
  return Search<Tree>::cut(trees, work) == Visit::kStop ? Visit::kStop : work.finish();
}

/// The same of a tree and one volume. `second` is b of each pair; segments of `group` are left out.
template <class Tree>
Visit findPairs(const Tree& tree, const typename Tree::Volume& volume, SegmentId second,
                Group group, const CapsuleFilter* filter, PairSink& sink) {
  internal::SerialRun run(filter, sink);
  return Search<Tree>::overlaps(tree, volume, second, group, run) == Visit::kStop ? Visit::kStop
                                                                                  : run.full();
}

}  // namespace fcl_fibers::tree
