// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "tree/topology.h"

namespace fcl_fibers::tree {

/// Appends nodes so that the invariants of Topology hold.
template <int Arity>
class TopologyBuilder {
 public:
  /// Opens a node whose children follow, and returns its index.
  std::int32_t openNode() {
    const auto index = static_cast<std::int32_t>(topology_.nodes.size());
    topology_.nodes.push_back({unlinked(std::make_index_sequence<Arity>{}), 0, leafCount(), 0});
    return index;
  }
  void addLeaf(std::int32_t node, SegmentId id) {
    topology_.leaves.push_back(id);
    addChild(node, Link::leaf(id));
  }
  void addChild(std::int32_t parent, Link child) {
    auto& node = topology_.nodes[static_cast<std::size_t>(parent)];
    node.children[static_cast<std::size_t>(node.child_count++)] = child;
  }
  void closeNode(std::int32_t index) {
    topology_.nodes[static_cast<std::size_t>(index)].leaf_end = leafCount();
  }

  void reserve(std::size_t leaves, std::size_t nodes) {
    topology_.leaves.reserve(leaves);
    topology_.nodes.reserve(nodes);
  }
  /// Makes room for the leaves of a subtree that is built elsewhere. Returns the first place.
  std::int32_t skipLeaves(std::int32_t count) {
    const std::int32_t first = leafCount();
    topology_.leaves.resize(topology_.leaves.size() + static_cast<std::size_t>(count));
    return first;
  }
  Topology<Arity> take() { return std::move(topology_); }

 private:
  template <std::size_t... I>
  static std::array<Link, Arity> unlinked(std::index_sequence<I...>) {
    return {((void)I, Link::node(0))...};
  }
  std::int32_t leafCount() const { return static_cast<std::int32_t>(topology_.leaves.size()); }

  Topology<Arity> topology_;
};

/// See Topology::groups.
template <int Arity>
std::vector<Group> groupsBySlot(const Topology<Arity>& topology, const Fibers& fibers) {
  if (fibers.groups.empty() || topology.leaves.empty()) return {};
  const auto [first, last] = std::minmax_element(fibers.ids.begin(), fibers.ids.end());
  const auto index = [first_id = *first](SegmentId id) {
    return static_cast<std::size_t>(id - first_id);
  };
  std::vector<Group> by_segment(index(*last) + 1);
  for (std::size_t f = 0; f + 1 < fibers.begin.size(); ++f) {
    for (std::int32_t i = fibers.begin[f]; i < fibers.begin[f + 1]; ++i) {
      by_segment[index(fibers.ids[static_cast<std::size_t>(i)])] = fibers.groups[f];
    }
  }
  constexpr auto kArity = static_cast<std::size_t>(Arity);
  std::vector<Group> by_slot(kArity * topology.nodes.size(), kNoGroup);
  // Children come after their parent.
  for (std::size_t i = topology.nodes.size(); i-- > 0;) {
    const auto& node = topology.nodes[i];
    for (std::size_t lane = 0; lane < static_cast<std::size_t>(node.child_count); ++lane) {
      const Link child = node.children[lane];
      Group& group = by_slot[kArity * i + lane];
      if (child.isLeaf()) {
        group = by_segment[index(child.segment())];
        continue;
      }
      const auto below = static_cast<std::size_t>(child.node());
      const auto begin = by_slot.begin() + static_cast<std::ptrdiff_t>(kArity * below);
      const auto end = begin + topology.nodes[below].child_count;
      const bool is_common = std::all_of(begin, end, [&](Group other) { return other == *begin; });
      group = is_common ? *begin : kNoGroup;
    }
  }
  return by_slot;
}

}  // namespace fcl_fibers::tree
