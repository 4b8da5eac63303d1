// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "geometry/segment.h"
#include "tree/bundle.h"

namespace fcl_fibers::tree {

/// A bundle over segments given by id.
inline Topology<8> bundleOf(const Fibers& fibers, const std::vector<geometry::Segment>& segments) {
  std::vector<Middle> middles;
  for (const SegmentId id : fibers.ids) {
    middles.push_back(middleOf(segments[static_cast<std::size_t>(id)]));
  }
  return bundle(fibers, middles);
}

/// Refits these segments, the only ones that have moved.
template <class Tree>
void refitMoved(Tree& tree, const std::vector<geometry::Segment>& segments,
                const std::vector<SegmentId>& ids) {
  std::vector<geometry::Segment> moved;
  for (const SegmentId id : ids) moved.push_back(segments[static_cast<std::size_t>(id)]);
  tree.refitSome(ids, moved);
}

}  // namespace fcl_fibers::tree
