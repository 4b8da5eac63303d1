// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "parallel/executor.h"
#include "tree/topology.h"

namespace fcl_fibers::tree {

/// Builds a tree whose nodes are blocks: sets of fibers over a range along each of them. A block is
/// split along its fibers, at about half of the range, or across them, near the median fiber,
/// whichever extent is longer. A few fibers far from all others are parted from these first. Sizes
/// are chosen so that nodes fill. Inside one fiber this is the
/// chain-aligned tree; over fibers of one segment it is a kd-tree.
///
/// Neither the tree nor its parts depend on the number of threads.
/// @param middles   by position in Fibers::ids: the segment's midpoint, in any frame
/// @param executor  null for one thread
TopologyParts<8> bundleInParts(const Fibers& fibers, const Middle* middles,
                               parallel::Executor* executor);

/// The same tree, put together on the calling thread.
Topology<8> bundle(const Fibers& fibers, const Middle* middles,
                   parallel::Executor* executor = nullptr);
inline Topology<8> bundle(const Fibers& fibers, const std::vector<Middle>& middles,
                          parallel::Executor* executor = nullptr) {
  return bundle(fibers, middles.data(), executor);
}

}  // namespace fcl_fibers::tree
