// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/affine_map.h"
#include "geometry/box.h"
#include "geometry/frame.h"
#include "geometry/rigid_fit.h"
#include "index/kept_segments.h"
#include "live/block_tree.h"
#include "live/displacements.h"
#include "parallel/executor.h"
#include "parallel/unwritten.h"

namespace fcl_fibers::live {

/// Segments as an index has them now, in the order of its leaves.
struct SegmentsNow {
  const tree::SegmentIds* order;
  const index::KeptSegments* segments;
  double reach;  ///< bounds the ends' coordinates in the frame of the anchors, and the way there
  /// Leads to the frame of the anchors; null if the segments are in it.
  const geometry::FrameChange* to_anchors = nullptr;
};

/// Where the ends of segments were when their pairs were listed: their anchors.
///
/// An end that two segments of one block share has one anchor, and one in each block if they are of
/// two.
class Anchors : public BlockTree {
 public:
  /// Anchors all ends where they are.
  /// @param executor  null for one thread
  void set(const SegmentsNow& now, parallel::Executor* executor);

  /// Bounds the displacements of all ends by a motion of all anchors.
  void measure(const SegmentsNow& now, const geometry::AffineMap& motion,
               parallel::Executor* executor);

  /// Writes the nodes of the segments of a block, by the last motion.
  void writeNodes(const SegmentsNow& now, std::int32_t block, BlockNodes& nodes) const;

  /// Adds a sample of ends to `points`.
  void sample(const SegmentsNow& now, std::vector<geometry::MovedPoint>& points) const;

  /// A segment as it was anchored. Its radii are rounded down.
  geometry::Segment segment(const SegmentsNow& now, Leaf leaf) const;

  std::size_t memoryUsage() const {
    return anchors_.capacity() * sizeof(Anchor) + nodesMemory() +
           begins_.capacity() * sizeof(std::int32_t);
  }

 private:
  AnchoredEnds endsOf(const SegmentsNow& now, std::int32_t block) const;
  AnchoredEnds anchored(const SegmentsNow& now, std::int32_t block) const;
  std::size_t anchorOf(const SegmentsNow& now, Leaf leaf) const;
  void set(std::size_t place, const geometry::Vec3d& point, const geometry::CapsuleEnd& end);
  Node nodeOf(const Displacements& bounds) const;
  double errorOf(const SegmentsNow& now) const;

  double reach_ = 0;  ///< bounds the coordinates of anchors
  geometry::AffineMap motion_;
  Displacing displacing_{nullptr, motion_};
  double error_ = 0;                           ///< errorOf() the last ends
  parallel::UnwrittenVector<Anchor> anchors_;  ///< of block after block
  std::vector<std::int32_t> begins_;           ///< by block: its first anchor; and the end
};

}  // namespace fcl_fibers::live
