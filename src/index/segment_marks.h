// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tree/topology.h"

namespace fcl_fibers::index {

/// A set of segments, to which several threads may add at the same time.
class SegmentMarks {
 public:
  SegmentMarks(tree::SegmentId begin, tree::SegmentId end)
      : begin_(begin), marks_((static_cast<std::size_t>(end - begin) + kBits - 1) / kBits) {}

  bool has(tree::SegmentId id) const {
    return (marks_[index(id) / kBits].load(std::memory_order_relaxed) & bitOf(id)) != 0;
  }
  /// Returns whether the segment is new.
  bool add(tree::SegmentId id) {
    if (has(id)) return false;
    const Bits bit = bitOf(id);
    return (marks_[index(id) / kBits].fetch_or(bit, std::memory_order_relaxed) & bit) == 0;
  }

 private:
  using Bits = std::uint64_t;
  static constexpr std::size_t kBits = 64;

  std::size_t index(tree::SegmentId id) const { return static_cast<std::size_t>(id - begin_); }
  Bits bitOf(tree::SegmentId id) const { return Bits{1} << index(id) % kBits; }

  tree::SegmentId begin_;
  std::vector<std::atomic<Bits>> marks_;
};

}  // namespace fcl_fibers::index
