// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <new>
#include <utility>
#include <vector>

#include "geometry/segment_block.h"
#include "parallel/executor.h"
#include "tree/layered_boxes.h"
#include "tree/topology.h"
#include "tree/topology_builder.h"
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
  using Groups = decltype(Topology<kArity>::groups);
  using Meets = decltype(Topology<kArity>::meets);

  Bvh() = default;

  /// The volumes are valid after the first refit.
  explicit Bvh(Topology<kArity> topology) {
    Groups groups = std::move(topology.groups);
    Meets meets = std::move(topology.meets);
    TopologyParts<kArity> parts;
    if (!topology.nodes.empty()) parts.parts.push_back({std::move(topology), 0, 0});
    place(parts, nullptr);
    groups_ = std::move(groups);
    meets_ = std::move(meets);
  }
  /// @param fibers    that the topology was built for
  /// @param executor  null for one thread
  Bvh(TopologyParts<kArity> parts, const Fibers& fibers, parallel::Executor* executor) {
    const std::vector<NodeRange> subtrees = place(parts, executor);
    addRules(fibers, nodes_.data(), subtrees, executor, groups_, meets_);
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
  const SegmentIds& leaves() const { return leaves_; }  ///< see Topology
  const Groups& groups() const { return groups_; }      ///< see Topology
  const Meets& meets() const { return meets_; }         ///< see Topology
  const Hierarchy& hierarchy() const { return hierarchy_; }
  Volume nodeVolume(std::int32_t i) const {
    return hierarchy_.nodeVolume(nodes_, static_cast<std::size_t>(i));
  }

  // A refit starts with startRefit(), fits all chunks, in any order and on any thread, and then, on
  // the threads of an executor, the nodes above them. A chunk is a subtree of at most kChunk
  // leaves. Its nodes are contiguous and so small together that they stay in a cache while its
  // leaves are read, in the tree's order.
  //
  // read(ids, count, ahead, block) reads the segments ids[0], ..., ids[count - 1] into `block` and
  // returns a bit for each that is present. The `ahead` ids behind them will be read soon, so it
  // may prefetch those. If a segment is not present, fitChunk() of boxes leaves it out of all
  // boxes. In a tree of spheres, and in all other calls, it keeps the volume that it had.

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
    std::int32_t fetched = end;
    for (std::int32_t leaf = first; leaf < last; leaf += SegmentBlock::kCapacity) {
      const int count = std::min(SegmentBlock::kCapacity, last - leaf);
      // The nodes come from memory while the leaves are read, in the order of their fitting.
      const std::int32_t due = begin + (end - begin) * (last - leaf - count) / (last - first);
      while (fetched > due) prefetch(--fetched);
      const int ahead = std::min(SegmentBlock::kCapacity, leafCount() - leaf - count);
      const geometry::BlockMask present =
          read(&leaves_[static_cast<std::size_t>(leaf)], count, ahead, block);
      hierarchy_.fitLeaves(block, present, count, padding_, leaf, leaves, leaf - first);
    }
    return hierarchy_.fitChunk(nodes_, begin, end, leaves);
  }

  /// Finds the place of each segment by its id.
  void findPlaces(parallel::Executor* executor = nullptr) {
    if (!slots_.empty() || empty()) return;
    const auto [least, last] = idRange(leaves_, executor);
    first_id_ = least;
    slots_.resize(static_cast<std::size_t>(last - least) + 1);
    parallel::forRanges(executor, slots_.size(), kNodesAtOnce,
                        [&](std::size_t from, std::size_t to) {
                          std::fill(slots_.data() + from, slots_.data() + to, kNone);
                        });
    forLinks(executor, [&](std::int32_t i, int lane, Link child) {
      if (!child.isLeaf()) return;
      slots_[static_cast<std::size_t>(child.segment() - first_id_)] = kArity * i + lane;
    });
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
  /// Fits the nodes of a chunk, whose leaves placeLeaves() has fitted.
  void fitChunkAbove(std::size_t chunk) {
    hierarchy_.fitChunkAbove(nodes_, chunks_[chunk].begin, chunks_[chunk].end);
  }
  /// Fits the nodes above the chunks, after fitChunkAbove() of each chunk.
  void fitAboveChunks(parallel::Executor* executor) {
    forAboveChunks(executor, /*changed=*/true, [&](std::int32_t i, bool changed) {
      hierarchy_.fitNode(nodes_, static_cast<std::size_t>(i));
      return changed;
    });
  }

  /// Fits the nodes above the chunks after fitChunk() of each chunk, with those leaves that are
  /// their children. It does nothing where nothing has changed below.
  template <class Read>
  void fitAboveChunks(bool chunks_changed, Read&& read, parallel::Executor* executor = nullptr) {
    forAboveChunks(executor, chunks_changed, [&](std::int32_t i, bool changed) {
      SegmentBlock block;
      forEachLeafOf(nodes_.data(), node(i), [&](int lane, std::int32_t leaf) {
        if (read(&leaves_[static_cast<std::size_t>(leaf)], 1, 0, block) == 0) return;
        changed |= hierarchy_.fitLeaf(nodes_, i, lane, leaf, block[0], padding_);
      });
      if (changed) hierarchy_.fitNode(nodes_, static_cast<std::size_t>(i));
      return changed;
    });
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
           chunks_.capacity() * sizeof(NodeRange) +
           (above_chunks_.capacity() + above_units_.capacity() + above_batches_.capacity() +
            slots_.capacity() + parent_.capacity()) *
               sizeof(std::int32_t) +
           is_stale_.capacity() / 8 + hierarchy_.memoryUsage();
  }

 private:
  static constexpr std::int32_t kNone = -1;
  static constexpr std::size_t kNodesAtOnce = 1 << 13;  ///< of a task that visits all nodes

  /// The chunks of a part, and its nodes above them.
  struct PartChunks {
    std::vector<NodeRange> chunks;
    std::vector<std::int32_t> above;
  };

  /// Puts all nodes and leaves in their places and finds the chunks. It frees the subtrees. Returns
  /// the nodes near the root and those of each part.
  std::vector<NodeRange> place(TopologyParts<kArity>& whole, parallel::Executor* executor) {
    nodes_.resize(whole.nodeCount());
    leaves_.resize(whole.leafCount());
    hierarchy_.reserve(leaves_.size(), nodes_.size(), executor);
    std::vector<NodeRange> subtrees = {{0, static_cast<std::int32_t>(whole.top.size())}};
    for (const auto& part : whole.parts) {
      const auto count = static_cast<std::int32_t>(part.subtree.nodes.size());
      subtrees.push_back({part.node_begin, part.node_begin + count});
    }
    std::vector<PartChunks> found(whole.parts.size());
    parallel::forRanges(executor, found.size(), 1, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        auto& part = whole.parts[i];
        auto place = static_cast<std::size_t>(part.node_begin);
        for (std::size_t n = 0; n < part.subtree.nodes.size(); ++n, ++place) {
          ::new (static_cast<void*>(&nodes_[place])) Node(part.nodeOfWhole(n));
        }
        std::copy(part.subtree.leaves.begin(), part.subtree.leaves.end(),
                  leaves_.begin() + part.leaf_begin);
        part.subtree = {};
        found[i] = findChunks(subtrees[i + 1]);
      }
    });
    for (std::size_t i = whole.top.size(); i-- > 0;) {
      ::new (static_cast<void*>(&nodes_[i])) Node(whole.top[i]);
      forEachLeafOf(nodes_.data(), nodes_[i], [&](int lane, std::int32_t leaf) {
        const Link child = nodes_[i].children[static_cast<std::size_t>(lane)];
        leaves_[static_cast<std::size_t>(leaf)] = child.segment();
      });
    }
    takeChunks(found, subtrees.front().end);
    return subtrees;
  }

  /// Finds the chunks of a subtree.
  PartChunks findChunks(const NodeRange& subtree) const {
    PartChunks found;
    std::int32_t chunk_end = 0;
    for (std::int32_t i = subtree.begin; i < subtree.end; ++i) {
      if (node(i).leaf_begin < chunk_end) {
        ++found.chunks.back().end;
      } else if (node(i).leafCount() > kChunk) {
        found.above.push_back(i);
      } else {
        found.chunks.push_back({i, i + 1});
        chunk_end = node(i).leaf_end;
      }
    }
    return found;
  }

  /// @param top  the number of nodes near the root
  void takeChunks(const std::vector<PartChunks>& found, std::int32_t top) {
    std::size_t chunks = 0, above = static_cast<std::size_t>(top);
    for (const PartChunks& part : found) {
      chunks += part.chunks.size();
      above += part.above.size();
    }
    chunks_.reserve(chunks);
    above_chunks_.reserve(above);
    above_units_.reserve(found.size() + static_cast<std::size_t>(top));
    const auto endUnit = [this] {
      above_units_.push_back(static_cast<std::int32_t>(above_chunks_.size()));
    };
    const auto endBatch = [this] {
      above_batches_.push_back(static_cast<std::int32_t>(above_units_.size()));
    };
    for (const PartChunks& part : found) {
      chunks_.insert(chunks_.end(), part.chunks.begin(), part.chunks.end());
      above_chunks_.insert(above_chunks_.end(), part.above.rbegin(), part.above.rend());
      endUnit();
    }
    endBatch();
    const std::vector<NodeRange> levels = levelsOf(top);
    for (auto level = levels.rbegin(); level != levels.rend(); ++level) {
      for (std::int32_t i = level->begin; i < level->end; ++i) {
        above_chunks_.push_back(i);
        endUnit();
      }
      endBatch();
    }
  }

  /// The levels of the first `top` nodes, which are ordered by their depth.
  std::vector<NodeRange> levelsOf(std::int32_t top) const {
    std::vector<NodeRange> levels;
    for (NodeRange level{0, std::min(top, 1)}; level.begin < level.end;) {
      levels.push_back(level);
      std::int32_t end = level.end;
      for (std::int32_t i = level.begin; i < level.end; ++i) {
        for (int lane = 0; lane < node(i).child_count; ++lane) {
          const Link child = node(i).children[static_cast<std::size_t>(lane)];
          if (!child.isLeaf() && child.node() < top) ++end;
        }
      }
      level = {level.end, end};
    }
    return levels;
  }

  /// Calls visit(node, changed) for the nodes above chunks, children before parents. `visit` gets
  /// whether anything below has changed, and returns whether anything has changed now.
  /// @param changed  whether anything in the chunks has changed
  template <class F>
  void forAboveChunks(parallel::Executor* executor, bool changed, F&& visit) {
    constexpr std::size_t kMostTasks = 256;
    std::size_t first = 0;
    for (const std::int32_t end : above_batches_) {
      const std::size_t count = static_cast<std::size_t>(end) - first;
      std::atomic<bool> any_changed{changed};
      parallel::forRanges(
          executor, count, count / kMostTasks + 1, [&](std::size_t from, std::size_t to) {
            for (std::size_t unit = first + from; unit < first + to; ++unit) {
              // It does not depend on other units, and so not on the threads.
              bool unit_changed = changed;
              for (auto i = unit > 0 ? above_units_[unit - 1] : 0; i < above_units_[unit]; ++i) {
                unit_changed = visit(above_chunks_[static_cast<std::size_t>(i)], unit_changed);
              }
              if (unit_changed) any_changed.store(true, std::memory_order_relaxed);
            }
          });
      changed = any_changed;
      first = static_cast<std::size_t>(end);
    }
  }

  /// Calls visit(node, lane, child) for all children, on all threads.
  template <class F>
  void forLinks(parallel::Executor* executor, F&& visit) const {
    parallel::forRanges(
        executor, nodes_.size(), kNodesAtOnce, [&](std::size_t from, std::size_t to) {
          for (auto i = static_cast<std::int32_t>(from); i < static_cast<std::int32_t>(to); ++i) {
            for (int lane = 0; lane < node(i).child_count; ++lane) {
              visit(i, lane, node(i).children[static_cast<std::size_t>(lane)]);
            }
          }
        });
  }

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
    forLinks(nullptr, [&](std::int32_t i, int /*lane*/, Link child) {
      if (!child.isLeaf()) parent_[static_cast<std::size_t>(child.node())] = i;
    });
  }

  Nodes nodes_;
  SegmentIds leaves_;
  Groups groups_;
  Meets meets_;
  double padding_ = 0;
  Hierarchy hierarchy_;
  std::vector<NodeRange> chunks_;
  std::vector<std::int32_t> above_chunks_;  ///< the nodes of more than kChunk leaves
  // They are fitted in units, which are nodes in a row, and these in batches. The units of a batch
  // do not depend on each other: those of all parts, and then one for each node near the root, a
  // level at a time.
  std::vector<std::int32_t> above_units_;    ///< where each ends in above_chunks_
  std::vector<std::int32_t> above_batches_;  ///< where each ends in above_units_

  // By id from first_id_ on: kArity times the node above, plus the lane. Empty until it is needed.
  SegmentId first_id_ = 0;
  parallel::UnwrittenVector<std::int32_t> slots_;

  // For refits in part.
  std::vector<std::int32_t> parent_;  ///< by node; kNone for the root
  std::vector<bool> is_stale_;        ///< by node; all false between refits
};

template <int Arity>
using LayeredBoxTree = Bvh<LayeredBoxes<Arity>>;
template <int Arity>
using WrappedSphereTree = Bvh<WrappedSpheres<Arity>>;

}  // namespace fcl_fibers::tree
