// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "geometry/segment_block.h"
#include "tree/layered_boxes.h"
#include "tree/topology.h"
#include "tree/traversal_task.h"
#include "tree/wrapped_spheres.h"

namespace fcl_fibers::tree {

/// A topology and its volumes. The volume of the root is in no pack.
template <class Hierarchy>
class Bvh {
 public:
  static constexpr int kArity = Hierarchy::kArity;
  using Volume = typename Hierarchy::Volume;
  using Pack = typename Hierarchy::Pack;
  using Nodes = typename Hierarchy::Nodes;
  using Node = typename Nodes::value_type;
  using SegmentBlock = geometry::SegmentBlock;

  Bvh() = default;

  /// The volumes are valid after the first refit.
  explicit Bvh(Topology<kArity> topology)
      : nodes_(topology.nodes.begin(), topology.nodes.end()),
        leaves_(std::move(topology.leaves)),
        groups_(std::move(topology.groups)),
        meets_(std::move(topology.meets)) {
    hierarchy_.reserve(leaves_.size(), nodes_.size());
    std::int32_t chunk_end = 0;
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(nodes_.size()); ++i) {
      const std::int32_t leaves = node(i).leafCount();
      if (node(i).leaf_begin < chunk_end) {
        ++chunks_.back().end;
      } else if (leaves > kChunk) {
        above_chunks_.push_back(i);
      } else {
        chunks_.push_back({i, i + 1});
        chunk_end = node(i).leaf_end;
      }
    }
  }

  bool empty() const { return nodes_.empty(); }
  double padding() const { return padding_; }
  const Nodes& nodes() const { return nodes_; }
  const Node& node(std::int32_t i) const { return nodes_[static_cast<std::size_t>(i)]; }
  const Pack& pack(std::int32_t i) const { return node(i).pack; }
  FCL_FIBERS_ALWAYS_INLINE void prefetch(std::int32_t i) const {
    const char* const bytes = reinterpret_cast<const char*>(&node(i));
    for (std::size_t line = 0; line < sizeof(Node); line += 64) __builtin_prefetch(bytes + line);
  }
  const std::vector<SegmentId>& leaves() const { return leaves_; }  ///< see Topology
  const std::vector<Group>& groups() const { return groups_; }      ///< see Topology
  const std::vector<Categories>& meets() const { return meets_; }   ///< see Topology
  const Hierarchy& hierarchy() const { return hierarchy_; }
  Volume nodeVolume(std::int32_t i) const {
    return hierarchy_.nodeVolume(nodes_, static_cast<std::size_t>(i));
  }

  // A refit starts with startRefit(), fits all chunks, in any order and on any thread, and then the
  // nodes above them. A chunk is a subtree of at most kChunk leaves. Its nodes are contiguous and
  // so small together that they stay in a cache while its leaves are read, in the tree's order.
  //
  // read(ids, count, ahead, block) reads the segments ids[0], ..., ids[count - 1] and returns a bit
  // for each that is present; it soon reads the `ahead` ids after them. fitChunk() leaves segments
  // that are not present out of all boxes; elsewhere they keep their volumes.

  static constexpr std::int32_t kChunk = geometry::BoxRows::kCapacity;

  /// @param padding  thickens every segment: half the margin at which pairs are searched for
  void startRefit(double padding) {
    padding_ = padding;
    hierarchy_.startRefit();
  }
  std::size_t chunkCount() const { return chunks_.size(); }

  /// Returns whether any volume has changed.
  template <class Read>
  bool fitChunk(std::size_t chunk, Read&& read) {
    const auto [begin, end] = chunks_[chunk];
    const std::int32_t first = node(begin).leaf_begin, last = node(begin).leaf_end;
    typename Hierarchy::Leaves leaves;
    SegmentBlock block;
    for (std::int32_t leaf = first; leaf < last; leaf += SegmentBlock::kCapacity) {
      const int count = std::min(SegmentBlock::kCapacity, last - leaf);
      const int ahead = std::min(SegmentBlock::kCapacity, leafCount() - leaf - count);
      const geometry::BlockMask present =
          read(&leaves_[static_cast<std::size_t>(leaf)], count, ahead, block);
      hierarchy_.fitLeaves(block, present, count, padding_, leaf, leaves, leaf - first);
    }
    return hierarchy_.fitChunk(nodes_, begin, end, leaves);
  }

  /// Finds the place of each segment by its id.
  void findPlaces() {
    if (!slots_.empty() || empty()) return;
    const auto [least, last] = std::minmax_element(leaves_.begin(), leaves_.end());
    first_id_ = *least;
    slots_.resize(static_cast<std::size_t>(*last - *least) + 1, kNone);
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(nodes_.size()); ++i) {
      for (int lane = 0; lane < node(i).child_count; ++lane) {
        const Link child = node(i).children[static_cast<std::size_t>(lane)];
        if (!child.isLeaf()) continue;
        slots_[static_cast<std::size_t>(child.segment() - first_id_)] = kArity * i + lane;
      }
    }
  }

  // If segments are read faster in the order of ids, placeLeaves() fits the leaves, after a call of
  // findPlaces(). Then fitChunkAbove() fits all chunks, and fitAboveChunks() the rest.

  /// Fits the leaves of these ids. Returns whether any has changed. It ignores ids that are not in
  /// the tree.
  bool placeLeaves(const SegmentId* ids, int count, geometry::BlockMask present,
                   const SegmentBlock& segments) {
    std::array<std::int32_t, static_cast<std::size_t>(SegmentBlock::kCapacity)> slots;
    for (int i = 0; i < count; ++i) {
      slots[static_cast<std::size_t>(i)] = (present >> i & 1u) != 0 ? slotOf(ids[i]) : kNone;
    }
    return hierarchy_.placeLeaves(nodes_, slots.data(), segments, count, padding_);
  }
  void fitChunkAbove(std::size_t chunk) {
    hierarchy_.fitChunkAbove(nodes_, chunks_[chunk].begin, chunks_[chunk].end);
  }
  void fitAboveChunks() {
    for (auto i = above_chunks_.rbegin(); i != above_chunks_.rend(); ++i) {
      hierarchy_.fitNode(nodes_, static_cast<std::size_t>(*i));
    }
  }

  template <class Read>
  void fitAboveChunks(bool chunks_changed, Read&& read) {
    SegmentBlock block;
    for (auto i = above_chunks_.rbegin(); i != above_chunks_.rend(); ++i) {
      forEachLeafOf(nodes_.data(), node(*i), [&](int lane, std::int32_t leaf) {
        if (read(&leaves_[static_cast<std::size_t>(leaf)], 1, 0, block) == 0) return;
        chunks_changed |= hierarchy_.fitLeaf(nodes_, *i, lane, leaf, block[0], padding_);
      });
      if (chunks_changed) hierarchy_.fitNode(nodes_, static_cast<std::size_t>(*i));
    }
  }

  /// Fits all volumes to segments given by id, on the calling thread.
  void refit(const std::vector<geometry::Segment>& segments, double padding) {
    const auto read = [&](const SegmentId* ids, int count, int /*ahead*/, SegmentBlock& block) {
      for (int i = 0; i < count; ++i) block.set(i, segments[static_cast<std::size_t>(ids[i])]);
      return geometry::firstOfBlock(count);
    };
    startRefit(padding);
    bool changed = false;
    for (std::size_t i = 0; i < chunks_.size(); ++i) changed |= fitChunk(i, read);
    fitAboveChunks(changed, read);
  }

  /// Fits these segments, which are the only ones that have moved, and the nodes above them. It
  /// ignores ids that are not in the tree. Returns how many leaves have changed.
  std::size_t refitSome(const std::vector<SegmentId>& ids,
                        const std::vector<geometry::Segment>& moved) {
    findPlaces();
    findParents();
    std::vector<std::int32_t> stale;
    std::size_t changed = 0;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      const std::int32_t slot = slotOf(ids[i]);
      if (slot == kNone) continue;
      std::int32_t above = slot / kArity;
      const int lane = slot % kArity;
      const std::int32_t leaf = leafAt(nodes_.data(), node(above), lane);
      if (!hierarchy_.fitLeaf(nodes_, above, lane, leaf, moved[i], padding_)) continue;
      ++changed;
      for (; above != kNone; above = parent_[static_cast<std::size_t>(above)]) {
        if (is_stale_[static_cast<std::size_t>(above)]) break;
        is_stale_[static_cast<std::size_t>(above)] = true;
        stale.push_back(above);
      }
    }
    std::sort(stale.begin(), stale.end());
    hierarchy_.startRefit();
    for (auto i = stale.rbegin(); i != stale.rend(); ++i) {
      hierarchy_.fitNode(nodes_, static_cast<std::size_t>(*i));
      is_stale_[static_cast<std::size_t>(*i)] = false;
    }
    return changed;
  }

  /// Calls visit(id, holds) for all leaves, where holds(segment) tells whether fitting this segment
  /// would leave the leaf's volume as it is.
  template <class F>
  void forEachLeaf(F&& visit) const {
    for (const Node& above : nodes_) {
      forEachLeafOf(nodes_.data(), above, [&](int lane, std::int32_t leaf) {
        visit(leaves_[static_cast<std::size_t>(leaf)], [&](const geometry::Segment& segment) {
          return hierarchy_.holds(above, lane, leaf, segment, padding_);
        });
      });
    }
  }

  std::size_t memoryUsage() const {
    return nodes_.capacity() * sizeof(Node) + leaves_.capacity() * sizeof(SegmentId) +
           groups_.capacity() * sizeof(Group) + meets_.capacity() * sizeof(Categories) +
           chunks_.capacity() * sizeof(Chunk) +
           (above_chunks_.capacity() + slots_.capacity() + parent_.capacity()) *
               sizeof(std::int32_t) +
           is_stale_.capacity() / 8 + hierarchy_.memoryUsage();
  }

 private:
  static constexpr std::int32_t kNone = -1;

  /// A subtree: the nodes begin, ..., end - 1.
  struct Chunk {
    std::int32_t begin, end;
  };

  std::int32_t leafCount() const { return static_cast<std::int32_t>(leaves_.size()); }

  std::int32_t slotOf(SegmentId id) const {
    // The index of an id before the first one wraps around to a large number.
    const auto index = static_cast<std::size_t>(id - first_id_);
    return index < slots_.size() ? slots_[index] : kNone;
  }

  /// Only a tree that is refitted in part needs the way up to the root and pays for it.
  void findParents() {
    if (!parent_.empty()) return;
    is_stale_.resize(nodes_.size());
    parent_.resize(nodes_.size(), kNone);
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(nodes_.size()); ++i) {
      for (int lane = 0; lane < node(i).child_count; ++lane) {
        const Link child = node(i).children[static_cast<std::size_t>(lane)];
        if (!child.isLeaf()) parent_[static_cast<std::size_t>(child.node())] = i;
      }
    }
  }

  Nodes nodes_;
  std::vector<SegmentId> leaves_;
  std::vector<Group> groups_;
  std::vector<Categories> meets_;
  double padding_ = 0;
  Hierarchy hierarchy_;
  std::vector<Chunk> chunks_;
  std::vector<std::int32_t> above_chunks_;  ///< the nodes of more than kChunk leaves

  // By id from first_id_ on: kArity times the node above, plus the lane. Empty until it is needed.
  SegmentId first_id_ = 0;
  std::vector<std::int32_t> slots_;

  // For refits in part.
  std::vector<std::int32_t> parent_;  ///< by node; kNone for the root
  std::vector<bool> is_stale_;        ///< by node; all false between refits
};

template <int Arity>
using LayeredBoxTree = Bvh<LayeredBoxes<Arity>>;
template <int Arity>
using WrappedSphereTree = Bvh<WrappedSpheres<Arity>>;

}  // namespace fcl_fibers::tree
