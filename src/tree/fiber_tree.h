// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "geometry/box.h"
#include "tree/layered.h"
#include "tree/topology.h"
#include "tree/wrapped_spheres.h"

namespace fcl_fibers::tree {

/// A topology and its volumes. A node keeps the volumes of its children, as one pack, so that one
/// test answers for all of them; the root's own volume is not kept.
template <class Hierarchy>
class FiberTree {
 public:
  static constexpr int kArity = Hierarchy::kArity;
  using Volume = typename Hierarchy::Volume;
  using Pack = typename Hierarchy::Pack;
  using Node = typename Topology<kArity>::Node;

  FiberTree() = default;

  /// Volumes are there after the first refit.
  explicit FiberTree(Topology<kArity> topology)
      : topology_(std::move(topology)), packs_(topology_.nodes.size()) {}

  bool empty() const { return topology_.nodes.empty(); }
  double padding() const { return padding_; }
  const Topology<kArity>& topology() const { return topology_; }
  const Hierarchy& hierarchy() const { return hierarchy_; }
  const Node& node(std::int32_t i) const { return topology_.nodes[static_cast<std::size_t>(i)]; }
  const Pack& pack(std::int32_t i) const { return packs_[static_cast<std::size_t>(i)]; }

  /// After any segment has moved: one backward sweep.
  /// @param padding  thickens every segment; half the margin at which pairs are to be found
  void refit(const std::vector<geometry::Segment>& segments, double padding) {
    padding_ = padding;
    hierarchy_.startRefit(topology_);
    // In a bundle neighbouring leaves are segments of different fibers, far apart in memory.
    constexpr std::size_t kAhead = 64;
    std::size_t next_leaf = topology_.leaves.size();
    for (std::size_t i = topology_.nodes.size(); i-- > 0;) {
      const auto ahead = static_cast<std::size_t>(topology_.nodes[i].leaf_begin);
      while (next_leaf > 0 && next_leaf + kAhead > ahead) {
        __builtin_prefetch(&segments[static_cast<std::size_t>(topology_.leaves[--next_leaf])]);
      }
      hierarchy_.refitNode(topology_, i, segments, padding_, packs_);
    }
  }

  /// After these segments have moved, and no others: the nodes above them.
  void refitMoved(const std::vector<geometry::Segment>& segments,
                  const std::vector<SegmentId>& moved) {
    if (moved.empty()) return;
    findParents();
    std::vector<std::int32_t> stale;
    for (const SegmentId id : moved) {
      for (std::int32_t i = leaf_parent_[static_cast<std::size_t>(id)]; i >= 0;
           i = parent_[static_cast<std::size_t>(i)]) {
        if (is_stale_[static_cast<std::size_t>(i)]) break;
        is_stale_[static_cast<std::size_t>(i)] = true;
        stale.push_back(i);
      }
    }
    std::sort(stale.begin(), stale.end());
    hierarchy_.startRefit(topology_);
    for (auto i = stale.rbegin(); i != stale.rend(); ++i) {
      hierarchy_.refitNode(topology_, static_cast<std::size_t>(*i), segments, padding_, packs_);
      is_stale_[static_cast<std::size_t>(*i)] = false;
    }
  }

  std::size_t memoryUsage() const {
    return topology_.nodes.capacity() * sizeof(Node) +
           topology_.leaves.capacity() * sizeof(SegmentId) + packs_.capacity() * sizeof(Pack) +
           (parent_.capacity() + leaf_parent_.capacity()) * sizeof(std::int32_t) +
           is_stale_.capacity() / 8 + hierarchy_.memoryUsage();
  }

 private:
  /// Only a tree that is refitted in part pays for the way up.
  void findParents() {
    if (!parent_.empty()) return;
    const SegmentId last = *std::max_element(topology_.leaves.begin(), topology_.leaves.end());
    leaf_parent_.resize(static_cast<std::size_t>(last) + 1);
    is_stale_.resize(topology_.nodes.size());
    parent_.resize(topology_.nodes.size(), -1);
    for (std::size_t i = 0; i < topology_.nodes.size(); ++i) {
      const Node& node = topology_.nodes[i];
      for (int lane = 0; lane < node.child_count; ++lane) {
        const Link child = node.children[static_cast<std::size_t>(lane)];
        auto& parent = child.isLeaf() ? leaf_parent_[static_cast<std::size_t>(child.segment())]
                                      : parent_[static_cast<std::size_t>(child.node())];
        parent = static_cast<std::int32_t>(i);
      }
    }
  }

  Topology<kArity> topology_;
  double padding_ = 0;
  Hierarchy hierarchy_;
  std::vector<Pack> packs_;

  // For refits in part:
  std::vector<std::int32_t> parent_;       ///< by node; -1 for the root
  std::vector<std::int32_t> leaf_parent_;  ///< by segment
  std::vector<bool> is_stale_;             ///< by node; all false between refits
};

template <int Arity>
using LayeredBoxTree = FiberTree<Layered<geometry::Box, Arity>>;
template <int Arity>
using WrappedSphereTree = FiberTree<WrappedSpheres<Arity>>;

}  // namespace fcl_fibers::tree
