// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "tree/topology.h"

namespace fcl_fibers::live {

/// A flag for each segment of a range of ids.
class SegmentFlags {
 public:
  SegmentFlags() = default;
  SegmentFlags(tree::SegmentId begin, tree::SegmentId end)
      : begin_(begin), flags_(static_cast<std::size_t>(end - begin)) {}

  bool has(tree::SegmentId id) const { return flags_[static_cast<std::size_t>(id - begin_)]; }
  void set(tree::SegmentId id, bool value = true) {
    flags_[static_cast<std::size_t>(id - begin_)] = value;
  }
  tree::SegmentId begin() const { return begin_; }
  tree::SegmentId end() const { return begin_ + static_cast<tree::SegmentId>(flags_.size()); }

  std::size_t memoryUsage() const { return flags_.capacity() / 8; }

 private:
  tree::SegmentId begin_ = 0;
  std::vector<bool> flags_;
};

}  // namespace fcl_fibers::live
