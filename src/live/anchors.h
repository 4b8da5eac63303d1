// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/affine_map.h"
#include "geometry/box.h"
#include "geometry/frame.h"
#include "geometry/rigid_fit.h"
#include "index/kept_segments.h"
#include "parallel/executor.h"
#include "parallel/unwritten.h"
#include "tree/segment_range.h"

namespace fcl_fibers::live {

/// Segments as an index has them now, in the order of its leaves.
struct SegmentsNow {
  const tree::SegmentIds* order;
  const index::KeptSegments* segments;
  /// Leads to the frame of the anchors; null if the segments are in it.
  const geometry::FrameChange* to_anchors = nullptr;
};

/// Where the ends of segments were when their pairs were listed: their anchors. For blocks of
/// segments that follow each other in the order of the leaves, and for nodes above these, it has
/// boxes around the anchors, and boxes around the displacements since. A displacement is what leads
/// from where a rigid motion takes the anchor to where the end is now.
///
/// Any anchors are valid: they need not be places where the ends have ever been.
class Anchors {
 public:
  static constexpr std::int32_t kBlock = 16;  ///< segments of a block
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
  bool empty() const { return anchors_.empty(); }

  /// Bounds the displacements of all ends.
  void measure(const SegmentsNow& now, const geometry::AffineMap& motion,
               parallel::Executor* executor);

  /// Anchors the ends of these blocks, which ascend, where they would be displaced by what the
  /// blocks around them are. Then measure() has to follow with the same motion.
  void renew(const SegmentsNow& now, const geometry::AffineMap& motion,
             const std::vector<std::int32_t>& blocks);

  /// How far the displacement of a block is from that of the blocks around it.
  double deviationOf(std::int32_t block) const;

  /// Adds a sample of ends to `points`.
  void sample(const SegmentsNow& now, std::vector<geometry::MovedPoint>& points) const;

  int levelCount() const { return static_cast<int>(levels_.size()) - 1; }
  std::int32_t nodeCount(int level) const { return levelBegin(level + 1) - levelBegin(level); }
  const Node& node(int level, std::int32_t i) const {
    return nodes_[static_cast<std::size_t>(levelBegin(level) + i)];
  }
  std::int32_t blockCount() const { return levelCount() > 0 ? nodeCount(0) : 0; }

  /// The segments of a block.
  struct Ids {
    const tree::SegmentId *first, *last;
    const tree::SegmentId* begin() const { return first; }
    const tree::SegmentId* end() const { return last; }
  };
  Ids idsOf(const SegmentsNow& now, std::int32_t block) const {
    const tree::SegmentId* const all = now.order->data();
    return {all + block * kBlock, all + std::min((block + 1) * kBlock, leaf_count_)};
  }

  /// A segment as it was anchored. A capsule's radius is rounded down.
  geometry::Segment segment(tree::SegmentId id, bool is_box) const;

  std::size_t memoryUsage() const {
    return anchors_.capacity() * sizeof(Anchor) + nodes_.capacity() * sizeof(Node);
  }

 private:
  /// x, y, z and the radius of the capsule that begins there, 0 for a box.
  struct Anchor {
    float numbers[4];
  };

  std::int32_t levelBegin(int level) const { return levels_[static_cast<std::size_t>(level)]; }
  std::size_t placeOf(tree::SegmentId id) const {
    return stride_ * static_cast<std::size_t>(id - begin_);
  }
  geometry::Vec3d at(std::size_t place) const {
    const float* const numbers = anchors_[place].numbers;
    return {numbers[0], numbers[1], numbers[2]};
  }
  void set(std::size_t place, const geometry::Vec3d& p);
  template <class Visit>
  void forBlocks(parallel::Executor* executor, const Visit& visit) const;
  template <class Move>
  void measureBlock(const SegmentsNow& now, const tree::SegmentRange& segments, std::int32_t block,
                    const Move& move);
  geometry::Vec3d usualAround(std::int32_t block) const;

  std::size_t stride_ = 2;
  tree::SegmentId begin_ = 0;
  std::int32_t leaf_count_ = 0;
  parallel::UnwrittenVector<Anchor> anchors_;  ///< as the ends of KeptSegments
  std::vector<Node> nodes_;                    ///< blocks, and then level after level above them
  std::vector<std::int32_t> levels_ = {0};     ///< where each level begins, and the end
};

}  // namespace fcl_fibers::live
