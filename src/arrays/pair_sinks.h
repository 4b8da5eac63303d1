// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "fibers/fiber_table.h"
#include "geometry/obstacle.h"
#include "index/pair_filter.h"
#include "index/pair_query.h"
#include "index/segment_index.h"

namespace fcl_fibers::arrays {

/// A pair of one tree, ordered so that a < b, without a branch, which could not be predicted.
FCL_FIBERS_ALWAYS_INLINE SegmentPair ordered(const tree::Pair& pair) {
  // The sign is spread over all bits, because compilers turn std::min() into a branch.
  const std::int32_t differ = (pair.a ^ pair.b) & ((pair.b - pair.a) >> 31);
  return {pair.a ^ differ, pair.b ^ differ};
}

/// Orders pairs of one tree, and leaves out neighbours.
class PairsOfOne {
 public:
  using Found = SegmentPair;

  explicit PairsOfOne(const fibers::FiberTable& table) : are_neighbors_(table) {}

  /// Writes the pair to `out` and returns how many were written: 0 or 1.
  FCL_FIBERS_ALWAYS_INLINE std::size_t operator()(const tree::Pair& pair, SegmentPair& out) const {
    out = ordered(pair);
    return are_neighbors_(out.a, out.b) ? 0 : 1;
  }

 private:
  const fibers::FiberTable::NeighborTest are_neighbors_;
};

struct ImpactsOfOne {
  using Found = Impact;

  std::size_t operator()(const tree::Pair& pair, const geometry::Impact& impact, Found& out) const {
    out = {ordered(pair), impact.time, impact.s, impact.t};
    if (out.pair.a != pair.a) std::swap(out.s, out.t);
    return 1;
  }
};
struct ImpactsOfTwo {
  using Found = Impact;

  std::size_t operator()(const tree::Pair& pair, const geometry::Impact& impact, Found& out) const {
    out = {{pair.a, pair.b}, impact.time, impact.s, impact.t};
    return 1;
  }
};
struct ImpactsOfMesh {
  using Found = MeshImpact;

  std::size_t operator()(const tree::Pair& pair, const geometry::Impact& impact, Found& out) const {
    out = {{pair.a, pair.b}, impact.time};
    return 1;
  }
};

/// Keeps the pairs of one tree that are no neighbours.
class NoNeighbors final : public index::PairFilter {
 public:
  explicit NoNeighbors(const fibers::FiberTable& table) : pairs_(table) {}

  std::size_t keep(tree::Pair* pairs, std::size_t count,
                   std::vector<geometry::Impact>& /*impacts*/) const override {
    std::size_t kept = 0;
    SegmentPair ordered;
    for (std::size_t i = 0; i < count; ++i) {
      pairs[kept] = pairs[i];
      kept += pairs_(pairs[i], ordered);
    }
    return kept;
  }

 private:
  const PairsOfOne pairs_;
};

/// Converts a pair as it is.
template <class PublicPair>
struct PairsOfTwo {
  using Found = PublicPair;

  FCL_FIBERS_ALWAYS_INLINE std::size_t operator()(const tree::Pair& pair, Found& out) const {
    out = {pair.a, pair.b};
    return 1;
  }
};
/// Takes the first of each pair.
struct SegmentsOf {
  using Found = std::int32_t;

  std::size_t operator()(const tree::Pair& pair, Found& out) const {
    out = pair.a;
    return 1;
  }
};

/// Takes the first of each pair whose capsule touches a box. Pairs of volumes are taken as they
/// are.
class SegmentsAtBox {
 public:
  using Found = std::int32_t;

  /// @param box  in the frame of the index
  SegmentsAtBox(const index::SegmentIndex& index, const geometry::Segment& box)
      : index_(index), box_{geometry::Obstacle::Kind::kBox, midpoint(box)} {
    const geometry::Vec3d half = 0.5 * box.b - 0.5 * box.a;
    box_.vector[0].x = half.x;
    box_.vector[1].y = half.y;
    box_.vector[2].z = half.z;
    box_.error = endPointError(box);
  }

  std::size_t operator()(const tree::Pair& pair, Found& out) const {
    out = pair.a;
    if (!index_.keepsSegments()) return 1;
    const geometry::Segment capsule = index_.segment(pair.a);
    return touch(capsule, box_, index_.margin(), endPointError(capsule)) ? 1 : 0;
  }

 private:
  const index::SegmentIndex& index_;
  geometry::Obstacle box_;
};

/// Calls take(found, count) with runs of what convert(i, found) makes of the first `count` numbers
/// i. Returns kStop if `take` returns true.
template <class Found, class Convert, class F>
tree::Visit takeRuns(std::size_t count, const Convert& convert, F& take) {
  constexpr std::size_t kRun = 256;
  std::array<Found, kRun> run;
  for (std::size_t i = 0; i != count;) {
    const std::size_t end = std::min(i + kRun, count);
    std::size_t size = 0;
    for (; i != end; ++i) size += convert(i, run[size]);
    if (size > 0 && take(run.data(), size)) return tree::Visit::kStop;
  }
  return tree::Visit::kContinue;
}

/// Converts pairs to a public type and hands them to take(found, count), which returns true to end
/// the search.
template <class Convert, class F>
class PairsTo final : public index::PairSink {
 public:
  PairsTo(const Convert& convert, F take) : convert_(convert), take_(std::move(take)) {}

  tree::Visit take(const tree::Pair* pairs, std::size_t count) override {
    using Found = typename Convert::Found;
    return takeRuns<Found>(
        count, [&](std::size_t i, Found& out) { return convert_(pairs[i], out); }, take_);
  }

 private:
  const Convert convert_;
  F take_;
};

/// Does the same for impacts.
template <class Convert, class F>
class ImpactsTo final : public index::PairSink {
 public:
  ImpactsTo(const Convert& convert, F take) : convert_(convert), take_(std::move(take)) {}

  tree::Visit takeImpacts(const tree::Pair* pairs, const geometry::Impact* impacts,
                          std::size_t count) override {
    using Found = typename Convert::Found;
    return takeRuns<Found>(
        count, [&](std::size_t i, Found& out) { return convert_(pairs[i], impacts[i], out); },
        take_);
  }

 private:
  tree::Visit take(const tree::Pair* /*pairs*/, std::size_t /*count*/) override {
    assert(false && "a search for impacts hands on nothing else");
    return tree::Visit::kStop;
  }

  const Convert convert_;
  F take_;
};

}  // namespace fcl_fibers::arrays
