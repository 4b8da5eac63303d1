// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/box.h"
#include "geometry/vec3.h"
#include "parallel/executor.h"
#include "simd/dispatch.h"

namespace fcl_fibers::live {

/// The place of a segment or triangle in the order of the leaves of its tree.
using Leaf = std::int32_t;

/// Bounds of blocks of leaves that follow each other, and of nodes above these. The points of each
/// leaf have anchors: where they were when pairs were listed. A displacement is what leads from
/// where a rigid motion takes an anchor to where the point is now.
class BlockTree {
 public:
  static constexpr Leaf kBlock = 16;  ///< leaves of a block
  static constexpr int kArity = 4;

  struct Node {
    geometry::Box where;  ///< around the anchors and radii
    geometry::Box moved;  ///< around the displacements
    float growth;         ///< bounds by how much a radius has grown
  };
  /// Those of the leaves of a block.
  using BlockNodes = std::array<Node, static_cast<std::size_t>(kBlock)>;

  int levelCount() const { return static_cast<int>(levels_.size()) - 1; }
  std::int32_t nodeCount(int level) const { return levelBegin(level + 1) - levelBegin(level); }
  const Node& node(int level, std::int32_t i) const {
    return nodes_[static_cast<std::size_t>(levelBegin(level) + i)];
  }
  std::int32_t blockCount() const { return levelCount() > 0 ? nodeCount(0) : 0; }
  Leaf leafCount() const { return leaf_count_; }
  Leaf blockEnd(std::int32_t block) const { return std::min((block + 1) * kBlock, leaf_count_); }

  /// How far a displacement is from the usual one of the blocks around a block.
  double deviationOf(const Node& node, std::int32_t block) const;

 protected:
  BlockTree() = default;
  ~BlockTree() = default;
  BlockTree(const BlockTree&) = default;
  BlockTree& operator=(const BlockTree&) = default;

  /// Makes room for the nodes, which are unspecified then.
  void resize(std::size_t leaf_count);
  template <class Visit>
  void forBlocks(parallel::Executor* executor, const Visit& visit) const {
    constexpr std::size_t kBlocksAtOnce = 128;  // they take some hundredths of a millisecond
    simd::readEnvironment();
    parallel::forRanges(executor, static_cast<std::size_t>(blockCount()), kBlocksAtOnce,
                        [&](std::size_t from, std::size_t to) {
                          for (std::size_t i = from; i < to; ++i) {
                            visit(static_cast<std::int32_t>(i));
                          }
                        });
  }
  static geometry::Box join(const geometry::Box& p, const geometry::Box& q);
  /// Bounds the nodes above blocks.
  void joinAbove();

  std::vector<Node> nodes_;  ///< blocks, and then level after level above them

 private:
  std::int32_t levelBegin(int level) const { return levels_[static_cast<std::size_t>(level)]; }
  geometry::Vec3d usualAround(std::int32_t block) const;

  Leaf leaf_count_ = 0;
  std::vector<std::int32_t> levels_ = {0};  ///< where each level begins, and the end
};

}  // namespace fcl_fibers::live
