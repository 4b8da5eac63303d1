// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/frame.h"
#include "tree/bvh.h"
#include "tree/traversal_task.h"

// The traversal of tree/traversal-inl.h for one instruction set, recursive and without batches.
// What it visits is behind a virtual call, so that it is compiled once and not for each test.

namespace fcl_fibers::tree::plain {

/// What a traversal for volumes that overlap visits.
class OverlapVisitor {
 public:
  virtual ~OverlapVisitor() = default;
  virtual Visit leafPair(SegmentId a, SegmentId b) = 0;
  virtual Visit leaf(SegmentId a) = 0;
};

template <class Tree>
Visit visitPairs(const Tree& tree, OverlapVisitor& visitor);
template <class Tree>
Visit visitPairs(const Tree& a, const Tree& b, const geometry::FrameChange& b_to_a,
                 const geometry::FrameChange& a_to_b, OverlapVisitor& visitor);
template <class Tree>
Visit visitLeaves(const Tree& tree, const typename Tree::Volume& volume, OverlapVisitor& visitor);

}  // namespace fcl_fibers::tree::plain
