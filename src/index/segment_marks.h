// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "tree/topology.h"

namespace fcl_fibers::index {

/// A set of segments.
class SegmentMarks {
 public:
  SegmentMarks(tree::SegmentId begin, tree::SegmentId end)
      : begin_(begin), is_marked_(static_cast<std::size_t>(end - begin)) {}

  bool has(tree::SegmentId id) const { return is_marked_[index(id)]; }
  /// Returns whether the segment is new.
  bool add(tree::SegmentId id) {
    const bool is_new = !has(id);
    is_marked_[index(id)] = true;
    return is_new;
  }

 private:
  std::size_t index(tree::SegmentId id) const { return static_cast<std::size_t>(id - begin_); }

  tree::SegmentId begin_;
  std::vector<bool> is_marked_;
};

}  // namespace fcl_fibers::index
