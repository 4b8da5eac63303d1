// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "fibers/fiber_table.h"
#include "index/pair_query.h"

namespace fcl_fibers::arrays {

/// Orders pairs of one tree, so that a < b, and leaves out neighbours.
class PairsOfOne final : public index::PairFilter {
 public:
  explicit PairsOfOne(const fibers::FiberTable& table) : are_neighbors_(table) {}

  /// Orders the pair, without a branch, which could not be predicted. Returns whether it counts.
  FCL_FIBERS_ALWAYS_INLINE bool operator()(tree::Pair& pair) const {
    // The sign is spread over all bits, because compilers turn std::min() into a branch.
    const std::int32_t differ = (pair.a ^ pair.b) & ((pair.b - pair.a) >> 31);
    pair = {pair.a ^ differ, pair.b ^ differ};
    return !are_neighbors_(pair.a, pair.b);
  }

  std::size_t keep(tree::Pair* pairs, std::size_t count,
                   std::vector<geometry::Impact>& /*impacts*/) const override {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      tree::Pair pair = pairs[i];
      pairs[kept] = pairs[i];
      kept += (*this)(pair) ? 1 : 0;
    }
    return kept;
  }

  /// See PairSink. Neighbours are kept among impacts, because keep() has left them out before.
  std::size_t sift(tree::Pair* pairs, geometry::Impact* impacts, std::size_t count) const {
    if (impacts != nullptr) {
      for (std::size_t i = 0; i < count; ++i) {
        if (pairs[i].a < pairs[i].b) continue;
        std::swap(pairs[i].a, pairs[i].b);
        std::swap(impacts[i].s, impacts[i].t);
      }
      return count;
    }
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      tree::Pair pair = pairs[i];
      const bool counts = (*this)(pair);
      pairs[kept] = pair;
      kept += counts ? 1 : 0;
    }
    return kept;
  }

 private:
  const fibers::FiberTable::NeighborTest are_neighbors_;
};

/// Takes a run of what a query finds, of the type that its question and partner have, on the thread
/// of this number. Returns true to end the query.
using Take = std::function<bool(const void* found, std::size_t count, int worker)>;
/// Returns where `count` or more of what a query finds have room. What was written to the memory
/// that it returned before is there.
using Room = std::function<void*(std::size_t count)>;

/// Where a query puts what it finds.
class Output {
 public:
  using Delivery = index::PairSink::Delivery;

  Output(Delivery delivery, const Take& take) : delivery_(delivery), take_(&take) {}
  /// @param call      what keeps all that is found
  /// @param elements  as requireFew() has it
  /// @param bytes     that each will take, if that is more than what is found itself
  Output(const Room& room, std::string call, std::size_t elements, std::size_t bytes = 0)
      : delivery_(Delivery::kPlaced),
        room_(&room),
        call_(std::move(call)),
        elements_(elements),
        bytes_(bytes) {}

  Delivery delivery() const { return delivery_; }
  /// Calls take(), unless the delivery is kPlaced. Once it has returned true or thrown on any
  /// thread, it is called no more.
  bool take(const void* found, std::size_t count, int worker) {
    if (has_ended_) return true;
    try {
      if ((*take_)(found, count, worker)) has_ended_ = true;
    } catch (...) {
      has_ended_ = true;
      throw;
    }
    return has_ended_;
  }
  /// Throws if so many more are hopelessly many, if the delivery is kPlaced.
  template <class Found>
  void requireRoom(std::size_t count) const {
    index::requireFew(call_.c_str(), count_ + count,
                      index::kMostKept / std::max(sizeof(Found), bytes_), elements_,
                      ", or ask visit(Pairs{}) or visitInParallel(), which keep nothing");
  }
  /// Makes room for so many more, if the delivery is kPlaced.
  template <class Found>
  void makeRoom(std::size_t count) {
    requireRoom<Found>(count);
    begin_ = count_;
    count_ += count;
    all_ = (*room_)(count_);
  }
  /// @param place  in the room that was made last
  template <class Found>
  Found* at(std::size_t place) const {
    return static_cast<Found*>(all_) + begin_ + place;
  }
  std::size_t count() const { return count_; }  ///< of all places

 private:
  const Delivery delivery_;
  const Take* take_ = nullptr;
  const Room* room_ = nullptr;
  const std::string call_;
  const std::size_t elements_ = 0, bytes_ = 0;
  std::atomic<bool> has_ended_{false};
  std::size_t begin_ = 0, count_ = 0;
  void* all_ = nullptr;
};

template <class Found>
FCL_FIBERS_ALWAYS_INLINE Found toPublic(const tree::Pair& pair, const geometry::Impact& impact) {
  if constexpr (std::is_same_v<Found, std::int32_t>) {
    return pair.a;
  } else if constexpr (std::is_same_v<Found, Impact>) {
    return {{pair.a, pair.b}, impact.time, impact.s, impact.t};
  } else if constexpr (std::is_same_v<Found, MeshImpact>) {
    return {{pair.a, pair.b}, impact.time};
  } else if constexpr (std::is_same_v<Found, ShapeImpact>) {
    return {pair.a, impact.time};
  } else {
    return {pair.a, pair.b};
  }
}

/// Converts what a search finds to a public type.
template <class Found>
class SinkTo final : public index::PairSink {
 public:
  /// @param own  sifts the pairs of one tree; null for others
  SinkTo(Output& output, const PairsOfOne* own) : output_(output), own_(own) {}

  Delivery delivery() const override { return output_.delivery(); }
  std::size_t sift(tree::Pair* pairs, geometry::Impact* impacts, std::size_t count) const override {
    return own_ != nullptr ? own_->sift(pairs, impacts, count) : count;
  }
  tree::Visit take(const index::PairRun& run) override {
    if (delivery() == Delivery::kPlaced) {
      makeRoom(run.count);
      place(0, run);
      return tree::Visit::kContinue;
    }
    constexpr std::size_t kRun = 256, kFew = 16;
    std::array<Found, kRun> found;
    // Threads that go on for a while after one of them has ended the query take few at a time.
    const std::size_t most = delivery() == Delivery::kAtOnce ? kFew : kRun;
    for (std::size_t i = 0; i < run.count; i += most) {
      const std::size_t size = std::min(most, run.count - i);
      convert(run, i, size, found.data());
      if (output_.take(found.data(), size, run.worker)) return tree::Visit::kStop;
    }
    return tree::Visit::kContinue;
  }
  void requireRoom(std::size_t count) const override { output_.requireRoom<Found>(count); }
  void makeRoom(std::size_t count) override { output_.makeRoom<Found>(count); }
  void place(std::size_t begin, const index::PairRun& run) const override {
    convert(run, 0, run.count, output_.at<Found>(begin));
  }

 private:
  static void convert(const index::PairRun& run, std::size_t begin, std::size_t count,
                      Found* found) {
    const tree::Pair* const pairs = run.pairs + begin;
    const geometry::Impact* const impacts = run.impacts != nullptr ? run.impacts + begin : nullptr;
    for (std::size_t i = 0; i < count; ++i) {
      found[i] = toPublic<Found>(pairs[i], impacts != nullptr ? impacts[i] : geometry::Impact{});
    }
  }

  Output& output_;
  const PairsOfOne* const own_;
};

}  // namespace fcl_fibers::arrays
