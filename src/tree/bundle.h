// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tree/topology.h"

namespace fcl_fibers::tree {

/// Builds a tree whose nodes are blocks: sets of fibers over a range along each of them. A block is
/// split along its fibers, at about half of the range, or across them, near the median fiber,
/// whichever extent is longer. Sizes are chosen so that nodes fill. Inside one fiber this is the
/// chain-aligned tree; over fibers of one segment it is a kd-tree.
///
/// The constructor splits the fibers into parts. These may be built at the same time; finish() puts
/// them together. The result does not depend on who builds which part.
class BundleBuild {
 public:
  /// @param fibers   borrowed
  /// @param middles  by position in Fibers::ids: the segment's midpoint, in any frame; borrowed
  BundleBuild(const Fibers& fibers, const std::vector<Middle>& middles);

  std::size_t partCount() const { return parts_.size(); }
  void buildPart(std::size_t part);
  /// @pre all parts are built
  Topology<8> finish();

 private:
  friend class BlockBuilder;

  /// A range of one fiber, as a range of Fibers::ids.
  struct Strand {
    std::int32_t begin, end;
    Middle middle;  ///< the midpoint of its middle segment
  };
  /// A block that becomes a subtree, and where it hangs.
  struct Part {
    std::vector<Strand> strands;
    std::int32_t segments;
    std::int32_t leaf_begin;
    std::int32_t parent;  ///< in top_; -1 for the root
    int lane;
    Topology<8> subtree;
  };

  const Fibers& fibers_;
  const std::vector<Middle>& middles_;
  Topology<8> top_;  ///< the nodes above the parts
  std::vector<Part> parts_;
};

/// Builds the whole tree on one thread.
Topology<8> bundle(const Fibers& fibers, const std::vector<Middle>& middles);

}  // namespace fcl_fibers::tree
