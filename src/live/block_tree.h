// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "live/node_pack.h"
#include "parallel/executor.h"
#include "simd/dispatch.h"
#include "simd/lanes.h"

namespace fcl_fibers::live {

/// The place of a segment or triangle in the order of the leaves of its tree.
using Leaf = std::int32_t;

/// Bounds of blocks of leaves that follow each other, and of nodes above these. The points of each
/// leaf have anchors: where they were when pairs were listed. A displacement is what leads from
/// where a rigid motion takes an anchor to where the point is now.
class BlockTree {
 public:
  static constexpr Leaf kBlock = 16;  ///< leaves of a block
  static constexpr int kArity = NodePack::kSize;

  /// The nodes of the leaves of a block.
  struct BlockNodes {
    void set(Leaf leaf, const Node& node) {
      packs[leaf % kBlock / kArity].set(leaf % kArity, node);
    }

    NodePack packs[kBlock / kArity];
  };
  /// Those leaves of such a pack that are there.
  simd::LaneMask leafLanes(std::int32_t block, int pack) const {
    const Leaf first = block * kBlock + pack * kArity;
    return simd::firstLanes(std::clamp(leaf_count_ - first, 0, kArity));
  }

  int levelCount() const { return static_cast<int>(levels_.size()); }
  std::int32_t nodeCount(int level) const { return levels_[static_cast<std::size_t>(level)].count; }
  Node node(int level, std::int32_t i) const {
    return pack(level, i / kArity).get(static_cast<int>(i % kArity));
  }
  /// Nodes that follow each other: the children of node i of the level above.
  const NodePack& pack(int level, std::int32_t i) const { return packs_[placeOf(level, i)]; }
  /// Those nodes of a pack that are there.
  simd::LaneMask lanes(int level, std::int32_t i) const {
    return simd::firstLanes(static_cast<int>(std::min(nodeCount(level) - i * kArity, kArity)));
  }
  /// What is around all leaves.
  Node root() const { return node(levelCount() - 1, 0); }

  std::int32_t blockCount() const { return levelCount() > 0 ? nodeCount(0) : 0; }
  Leaf leafCount() const { return leaf_count_; }
  Leaf blockEnd(std::int32_t block) const { return std::min((block + 1) * kBlock, leaf_count_); }

 protected:
  BlockTree() = default;
  ~BlockTree() = default;
  BlockTree(const BlockTree&) = default;
  BlockTree& operator=(const BlockTree&) = default;

  /// Makes room for the nodes, which have to be set then.
  void resize(std::size_t leaf_count);
  template <class Visit>
  void forBlocks(parallel::Executor* executor, const Visit& visit) const {
    // They take some hundredths of a millisecond. No two threads have blocks of one pack.
    constexpr std::size_t kBlocksAtOnce = 128;
    simd::readEnvironment();
    parallel::forRanges(executor, static_cast<std::size_t>(blockCount()), kBlocksAtOnce,
                        [&](std::size_t from, std::size_t to) {
                          for (std::size_t i = from; i < to; ++i) {
                            visit(static_cast<std::int32_t>(i));
                          }
                        });
  }
  Node block(std::int32_t i) const { return node(0, i); }
  void setBlock(std::int32_t i, const Node& node) { setNode(0, i, node); }
  /// Bounds the nodes above blocks.
  void joinAbove();
  std::size_t nodesMemory() const { return packs_.capacity() * sizeof(NodePack); }

 private:
  struct Level {
    std::size_t first_pack;
    std::int32_t count;
  };
  std::size_t placeOf(int level, std::int32_t pack) const {
    return levels_[static_cast<std::size_t>(level)].first_pack + static_cast<std::size_t>(pack);
  }
  void setNode(int level, std::int32_t i, const Node& node) {
    packs_[placeOf(level, i / kArity)].set(static_cast<int>(i % kArity), node);
  }

  Leaf leaf_count_ = 0;
  std::vector<Level> levels_;  ///< blocks, and then level after level above them
  std::vector<NodePack> packs_;
};

}  // namespace fcl_fibers::live
