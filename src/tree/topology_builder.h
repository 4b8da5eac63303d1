// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
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

/// Returns a value for each slot of a topology.
/// @param values  by position in `ids`, the segments of the topology in any order
/// @param unite   unite(begin, end): the value of a child from those of its children
template <int Arity, typename Value, class Unite>
std::vector<Value> valuesBySlot(const Topology<Arity>& topology, const std::vector<SegmentId>& ids,
                                const std::vector<Value>& values, Unite&& unite) {
  const auto [first, last] = std::minmax_element(ids.begin(), ids.end());
  const auto index = [first_id = *first](SegmentId id) {
    return static_cast<std::size_t>(id - first_id);
  };
  std::vector<Value> by_segment(index(*last) + 1);
  for (std::size_t i = 0; i < ids.size(); ++i) by_segment[index(ids[i])] = values[i];
  constexpr auto kArity = static_cast<std::size_t>(Arity);
  std::vector<Value> by_slot(kArity * topology.nodes.size());
  // Children come after their parent.
  for (std::size_t i = topology.nodes.size(); i-- > 0;) {
    const auto& node = topology.nodes[i];
    for (std::size_t lane = 0; lane < static_cast<std::size_t>(node.child_count); ++lane) {
      const Link child = node.children[lane];
      Value& value = by_slot[kArity * i + lane];
      if (child.isLeaf()) {
        value = by_segment[index(child.segment())];
        continue;
      }
      const auto below = static_cast<std::size_t>(child.node());
      const auto begin = by_slot.begin() + static_cast<std::ptrdiff_t>(kArity * below);
      value = unite(begin, begin + topology.nodes[below].child_count);
    }
  }
  return by_slot;
}

/// Sets Topology::groups and Topology::meets.
template <int Arity>
void addRules(const Fibers& fibers, Topology<Arity>& topology) {
  if (topology.leaves.empty()) return;
  if (!fibers.groups.empty()) {
    std::vector<Group> groups(fibers.ids.size());
    for (std::size_t f = 0; f + 1 < fibers.begin.size(); ++f) {
      std::fill(groups.begin() + fibers.begin[f], groups.begin() + fibers.begin[f + 1],
                fibers.groups[f]);
    }
    topology.groups = valuesBySlot(topology, fibers.ids, groups, [](auto begin, auto end) {
      const bool is_common = std::all_of(begin, end, [&](Group other) { return other == *begin; });
      return is_common ? *begin : kNoGroup;
    });
  }
  if (!fibers.meets.empty()) {
    topology.meets = valuesBySlot(topology, fibers.ids, fibers.meets, [](auto begin, auto end) {
      return std::accumulate(begin, end, kNoCategories, std::bit_or<>());
    });
  }
}

}  // namespace fcl_fibers::tree
