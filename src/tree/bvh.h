// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "geometry/box.h"
#include "tree/layered.h"
#include "tree/topology.h"
#include "tree/traversal_task.h"
#include "tree/wrapped_spheres.h"

namespace fcl_fibers::tree {

/// A topology and its volumes. A node keeps the volumes of its children as one pack, so one test
/// answers for all of them. The volume of the root is in no pack.
template <class Hierarchy>
class Bvh {
 public:
  static constexpr int kArity = Hierarchy::kArity;
  using Volume = typename Hierarchy::Volume;
  using Pack = typename Hierarchy::Pack;
  using Node = typename Topology<kArity>::Node;

  Bvh() = default;

  /// The volumes are valid after the first refit.
  explicit Bvh(Topology<kArity> topology)
      : topology_(std::move(topology)), packs_(topology_.nodes.size()) {
    hierarchy_.reserve(topology_);
    if (topology_.leaves.empty()) return;
    const auto [least, last] =
        std::minmax_element(topology_.leaves.begin(), topology_.leaves.end());
    first_id_ = *least;
    slots_.resize(indexOf(*last) + 1, kNoSlot);
    forEachLeaf([&](std::int32_t node, int lane, std::int32_t leaf, SegmentId id) {
      slots_[indexOf(id)] = Hierarchy::slot(node, lane, leaf);
    });
  }

  bool empty() const { return topology_.nodes.empty(); }
  double padding() const { return padding_; }
  const Topology<kArity>& topology() const { return topology_; }
  const Hierarchy& hierarchy() const { return hierarchy_; }
  const Node& node(std::int32_t i) const { return topology_.nodes[static_cast<std::size_t>(i)]; }
  const Pack& pack(std::int32_t i) const { return packs_[static_cast<std::size_t>(i)]; }
  Volume nodeVolume(std::int32_t i) const {
    return hierarchy_.nodeVolume(static_cast<std::size_t>(i), packs_);
  }

  // A refit starts with startRefit(), then fits leaves, then the nodes above them. Several threads
  // may fit leaves at once.

  /// @param padding  thickens every segment: half the margin at which pairs are searched for
  void startRefit(double padding) { padding_ = padding; }

  /// Returns whether the leaf's volume has changed. A segment that is not in the tree is skipped.
  FCL_FIBERS_ALWAYS_INLINE bool fitLeaf(SegmentId id, const geometry::Segment& segment) {
    const std::int32_t slot = slotOf(id);
    return slot != kNoSlot && hierarchy_.fitLeaf(slot, segment, padding_, packs_);
  }

  /// Whether fitLeaf() would change nothing.
  bool isFitted(SegmentId id, const geometry::Segment& segment) const {
    const std::int32_t slot = slotOf(id);
    return slot == kNoSlot || hierarchy_.isFitted(slot, segment, padding_, packs_);
  }

  /// Call this a few leaves ahead of fitLeaf().
  FCL_FIBERS_ALWAYS_INLINE void prefetchLeaf(SegmentId id) const {
    const std::int32_t slot = slotOf(id);
    if (slot != kNoSlot) hierarchy_.prefetchLeaf(slot, packs_);
  }

  /// Fits all nodes in one backward sweep, unless no leaf has changed.
  void fitNodes(bool leaves_changed = true) {
    hierarchy_.startRefit();
    if (!leaves_changed) return;
    for (std::size_t i = topology_.nodes.size(); i-- > 0;) hierarchy_.fitNode(topology_, i, packs_);
  }

  void fitNodesAbove(const std::vector<SegmentId>& leaves) {
    if (leaves.empty()) return;
    findParents();
    std::vector<std::int32_t> stale;
    for (const SegmentId id : leaves) {
      for (std::int32_t i = leaf_parent_[indexOf(id)]; i >= 0;
           i = parent_[static_cast<std::size_t>(i)]) {
        if (is_stale_[static_cast<std::size_t>(i)]) break;
        is_stale_[static_cast<std::size_t>(i)] = true;
        stale.push_back(i);
      }
    }
    std::sort(stale.begin(), stale.end());
    hierarchy_.startRefit();
    for (auto i = stale.rbegin(); i != stale.rend(); ++i) {
      hierarchy_.fitNode(topology_, static_cast<std::size_t>(*i), packs_);
      is_stale_[static_cast<std::size_t>(*i)] = false;
    }
  }

  void refit(const std::vector<geometry::Segment>& segments, double padding) {
    startRefit(padding);
    for (const SegmentId id : topology_.leaves) {
      fitLeaf(id, segments[static_cast<std::size_t>(id)]);
    }
    fitNodes();
  }

  /// Fits these segments, the only ones that have moved, and the nodes above them.
  void refitMoved(const std::vector<geometry::Segment>& segments,
                  const std::vector<SegmentId>& moved) {
    for (const SegmentId id : moved) fitLeaf(id, segments[static_cast<std::size_t>(id)]);
    fitNodesAbove(moved);
  }

  /// Calls visit(volume, leaf_begin, leaf_end) for the volumes `depth` levels below the root, and
  /// for leaves that are less deep. Their ranges of topology().leaves follow each other from first
  /// to last.
  template <class F>
  void visitVolumes(int depth, F&& visit) const {
    if (empty()) return;
    const Node& root = topology_.nodes.front();
    if (depth == 0) {
      visit(nodeVolume(0), root.leaf_begin, root.leaf_end);
    } else {
      visitVolumesBelow(0, depth, visit);
    }
  }

  /// The size of nodes divided by the size of leaves, from a sample: how far the tree is from one
  /// whose nodes hold what is close together. It grows when fibers move apart, not when everything
  /// grows.
  double looseness() const {
    constexpr std::size_t kSamples = 1024;
    double nodes = 0, leaves = 0;
    for (std::size_t i = 0; i < topology_.nodes.size();
         i += topology_.nodes.size() / kSamples + 1) {
      for (int lane = 0; lane < topology_.nodes[i].child_count; ++lane) {
        const auto size = static_cast<double>(packs_[i].get(lane).size());
        if (!std::isfinite(size)) continue;
        const bool leaf = topology_.nodes[i].children[static_cast<std::size_t>(lane)].isLeaf();
        (leaf ? leaves : nodes) += size;
      }
    }
    return leaves > 0 && std::isfinite(nodes / leaves) ? nodes / leaves : 0;
  }

  std::size_t memoryUsage() const {
    return topology_.nodes.capacity() * sizeof(Node) +
           topology_.leaves.capacity() * sizeof(SegmentId) +
           topology_.groups.capacity() * sizeof(Group) + packs_.capacity() * sizeof(Pack) +
           (slots_.capacity() + parent_.capacity() + leaf_parent_.capacity()) *
               sizeof(std::int32_t) +
           is_stale_.capacity() / 8 + hierarchy_.memoryUsage();
  }

 private:
  static constexpr std::int32_t kNoSlot = -1;

  std::size_t indexOf(SegmentId id) const { return static_cast<std::size_t>(id - first_id_); }
  FCL_FIBERS_ALWAYS_INLINE std::int32_t slotOf(SegmentId id) const {
    // The index of an id before the first one wraps around to a large number.
    const std::size_t index = indexOf(id);
    return index < slots_.size() ? slots_[index] : kNoSlot;
  }

  /// Calls visit(node, lane, position among the leaves, id) for all leaves.
  template <class F>
  void forEachLeaf(F&& visit) const {
    for (std::size_t i = 0; i < topology_.nodes.size(); ++i) {
      const Node& node = topology_.nodes[i];
      std::int32_t leaf = node.leaf_begin;
      for (int lane = 0; lane < node.child_count; ++lane) {
        const Link child = node.children[static_cast<std::size_t>(lane)];
        if (child.isLeaf()) visit(static_cast<std::int32_t>(i), lane, leaf, child.segment());
        leaf += leafCount(*this, child);
      }
    }
  }

  template <class F>
  void visitVolumesBelow(std::int32_t index, int depth, F&& visit) const {
    std::int32_t leaf = node(index).leaf_begin;
    for (int lane = 0; lane < node(index).child_count; ++lane) {
      const Link child = node(index).children[static_cast<std::size_t>(lane)];
      const std::int32_t end = leaf + leafCount(*this, child);
      if (child.isLeaf() || depth == 1) {
        visit(pack(index).get(lane), leaf, end);
      } else {
        visitVolumesBelow(child.node(), depth - 1, visit);
      }
      leaf = end;
    }
  }

  /// Only a tree that is refitted in part pays for the way up.
  void findParents() {
    if (!parent_.empty()) return;
    leaf_parent_.resize(slots_.size());
    is_stale_.resize(topology_.nodes.size());
    parent_.resize(topology_.nodes.size(), -1);
    forEachLeaf([&](std::int32_t node, int, std::int32_t, SegmentId id) {
      leaf_parent_[indexOf(id)] = node;
    });
    for (std::size_t i = 0; i < topology_.nodes.size(); ++i) {
      const Node& node = topology_.nodes[i];
      for (int lane = 0; lane < node.child_count; ++lane) {
        const Link child = node.children[static_cast<std::size_t>(lane)];
        if (child.isLeaf()) continue;
        parent_[static_cast<std::size_t>(child.node())] = static_cast<std::int32_t>(i);
      }
    }
  }

  Topology<kArity> topology_;
  double padding_ = 0;
  Hierarchy hierarchy_;
  std::vector<Pack> packs_;
  SegmentId first_id_ = 0;
  std::vector<std::int32_t> slots_;  ///< by id from first_id_ on: the place of its volume

  // For refits in part.
  std::vector<std::int32_t> parent_;       ///< by node; -1 for the root
  std::vector<std::int32_t> leaf_parent_;  ///< by id, like slots_
  std::vector<bool> is_stale_;             ///< by node; all false between refits
};

template <int Arity>
using LayeredBoxTree = Bvh<Layered<geometry::Box, Arity>>;
template <int Arity>
using WrappedSphereTree = Bvh<WrappedSpheres<Arity>>;

}  // namespace fcl_fibers::tree
