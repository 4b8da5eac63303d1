// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
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
  FCL_FIBERS_ALWAYS_INLINE bool operator()(SegmentPair& pair) const {
    // The sign is spread over all bits, because compilers turn std::min() into a branch.
    const std::int32_t differ = (pair.a ^ pair.b) & ((pair.b - pair.a) >> 31);
    pair = {pair.a ^ differ, pair.b ^ differ};
    return !are_neighbors_(pair.a, pair.b);
  }
  /// Orders an impact of a pair that keep() has kept.
  bool operator()(Impact& impact) const {
    if (impact.pair.a > impact.pair.b) {
      std::swap(impact.pair.a, impact.pair.b);
      std::swap(impact.s, impact.t);
    }
    return true;
  }

  std::size_t keep(tree::Pair* pairs, std::size_t count,
                   std::vector<geometry::Impact>& /*impacts*/) const override {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      SegmentPair pair{pairs[i].a, pairs[i].b};
      pairs[kept] = pairs[i];
      kept += (*this)(pair) ? 1 : 0;
    }
    return kept;
  }

 private:
  const fibers::FiberTable::NeighborTest are_neighbors_;
};

/// Takes a run of what a query finds, of the type that its question and partner have. Returns true
/// to end the query.
using Take = std::function<bool(const void* found, std::size_t count)>;

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

/// Converts what a search finds to a public type, and hands on what keep(found) is true for. `keep`
/// may change it.
template <class Found, class Keep>
class SinkTo final : public index::PairSink {
 public:
  SinkTo(const Take& take, const Keep& keep) : take_(take), keep_(keep) {}

  tree::Visit take(const tree::Pair* pairs, std::size_t count) override {
    return takeRuns(count, [&](std::size_t i) { return toPublic<Found>(pairs[i], {}); });
  }
  tree::Visit takeImpacts(const tree::Pair* pairs, const geometry::Impact* impacts,
                          std::size_t count) override {
    return takeRuns(count, [&](std::size_t i) { return toPublic<Found>(pairs[i], impacts[i]); });
  }

 private:
  template <class F>
  tree::Visit takeRuns(std::size_t count, F&& foundAt) {
    constexpr std::size_t kRun = 256;
    std::array<Found, kRun> run;
    for (std::size_t i = 0; i != count;) {
      const std::size_t end = std::min(i + kRun, count);
      std::size_t size = 0;
      for (; i != end; ++i) {
        run[size] = foundAt(i);
        size += keep_(run[size]) ? 1 : 0;
      }
      if (size > 0 && take_(run.data(), size)) return tree::Visit::kStop;
    }
    return tree::Visit::kContinue;
  }

  const Take& take_;
  const Keep& keep_;
};

}  // namespace fcl_fibers::arrays
