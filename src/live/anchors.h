// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/affine_map.h"
#include "geometry/box.h"
#include "geometry/frame.h"
#include "geometry/rigid_fit.h"
#include "index/kept_segments.h"
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

/// The place of a segment in the order of the leaves.
using Leaf = std::int32_t;

/// Where the ends of segments were when their pairs were listed: their anchors. For blocks of
/// segments that follow each other in the order of the leaves, and for nodes above these, it has
/// boxes around the anchors, and boxes around the displacements since. A displacement is what leads
/// from where a rigid motion takes the anchor to where the end is now.
///
/// Any anchors are valid: they need not be places where the ends have ever been. An end that two
/// segments of one block share has one anchor, and one in each block if they are of two.
class Anchors {
 public:
  static constexpr Leaf kBlock = 16;  ///< segments of a block
  static constexpr int kArity = 4;

  struct Node {
    geometry::Box where;  ///< around the anchors and radii of the segments
    geometry::Box moved;  ///< around the displacements of their ends
    float growth;         ///< bounds by how much a radius has grown
  };

  /// Anchors all ends where they are.
  /// @param executor  null for one thread
  void set(const SegmentsNow& now, parallel::Executor* executor);
  void clear() { *this = Anchors(); }

  /// Bounds the displacements of all ends by a motion of all anchors.
  void measure(const SegmentsNow& now, const geometry::AffineMap& motion,
               parallel::Executor* executor);

  /// A segment that is to be anchored where it has this displacement now.
  struct Renewal {
    Leaf leaf;
    geometry::Vec3d displacement;
  };
  /// Anchors segments anew; of several renewals of one, the median by axis counts. Adds all
  /// segments of which an end has another anchor now to `changed`. The displacements of blocks
  /// remain bounds.
  void renew(const SegmentsNow& now, std::vector<Renewal> renewals, std::vector<Leaf>& changed);

  /// Writes the nodes of the segments of a block, by the last motion.
  using BlockNodes = std::array<Node, static_cast<std::size_t>(kBlock)>;
  void writeNodes(const SegmentsNow& now, std::int32_t block, BlockNodes& nodes) const;

  /// How far a displacement is from the usual one of the blocks around a block.
  double deviationOf(const Node& node, std::int32_t block) const;

  /// Adds a sample of ends to `points`.
  void sample(const SegmentsNow& now, std::vector<geometry::MovedPoint>& points) const;

  /// A segment as it was anchored. A capsule's radius is rounded down.
  geometry::Segment segment(const SegmentsNow& now, Leaf leaf) const;

  int levelCount() const { return static_cast<int>(levels_.size()) - 1; }
  std::int32_t nodeCount(int level) const { return levelBegin(level + 1) - levelBegin(level); }
  const Node& node(int level, std::int32_t i) const {
    return nodes_[static_cast<std::size_t>(levelBegin(level) + i)];
  }
  std::int32_t blockCount() const { return levelCount() > 0 ? nodeCount(0) : 0; }
  Leaf leafCount() const { return leaf_count_; }
  Leaf blockEnd(std::int32_t block) const { return std::min((block + 1) * kBlock, leaf_count_); }

  std::size_t memoryUsage() const {
    return anchors_.capacity() * sizeof(Anchor) + nodes_.capacity() * sizeof(Node) +
           begins_.capacity() * sizeof(std::int32_t);
  }

 private:
  std::int32_t levelBegin(int level) const { return levels_[static_cast<std::size_t>(level)]; }
  template <class Visit>
  void forBlocks(parallel::Executor* executor, const Visit& visit) const;
  AnchoredEnds anchored(const SegmentsNow& now, std::int32_t block) const;
  std::size_t anchorOf(const SegmentsNow& now, Leaf leaf) const;
  void set(std::size_t place, const geometry::Vec3d& point, const geometry::CapsuleEnd& end);
  Node measured(const AnchoredEnds& ends) const;
  void bound(const SegmentsNow& now, std::int32_t block);
  void joinAbove();
  geometry::Vec3d usualAround(std::int32_t block) const;

  Leaf leaf_count_ = 0;
  double reach_ = 0;  ///< bounds the coordinates of anchors
  geometry::AffineMap motion_;
  Displacing displacing_{nullptr, motion_};
  double error_ = 0;                           ///< bounds the error of a displacement, by axis
  parallel::UnwrittenVector<Anchor> anchors_;  ///< of block after block
  std::vector<std::int32_t> begins_;           ///< by block: its first anchor; and the end
  std::vector<Node> nodes_;                    ///< blocks, and then level after level above them
  std::vector<std::int32_t> levels_ = {0};     ///< where each level begins, and the end
};

}  // namespace fcl_fibers::live
