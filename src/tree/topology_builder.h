// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <type_traits>
#include <utility>
#include <vector>

#include "parallel/executor.h"
#include "tree/topology.h"

namespace fcl_fibers::tree {

/// Appends nodes so that the invariants of Topology hold.
template <int Arity>
class TopologyBuilder {
 public:
  /// Opens a node whose children follow, and returns its index.
  std::int32_t openNode() {
    const auto index = static_cast<std::int32_t>(topology_.nodes.size());
    topology_.nodes.push_back(Topology<Arity>::Node::of(leafCount(), 0));
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
  Topology<Arity> take() { return std::move(topology_); }

 private:
  std::int32_t leafCount() const { return static_cast<std::int32_t>(topology_.leaves.size()); }

  Topology<Arity> topology_;
};

/// The nodes [begin, end).
struct NodeRange {
  std::int32_t begin, end;
};

/// The least and the largest id. There is at least one.
inline std::pair<SegmentId, SegmentId> idRange(const SegmentIds& ids,
                                               parallel::Executor* executor) {
  constexpr std::size_t kRange = 1 << 16;
  std::vector<std::pair<SegmentId, SegmentId>> ranges((ids.size() + kRange - 1) / kRange,
                                                      {ids.front(), ids.front()});
  parallel::forRanges(executor, ids.size(), kRange, [&](std::size_t begin, std::size_t end) {
    const auto first = ids.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto [low, high] =
        std::minmax_element(first, ids.begin() + static_cast<std::ptrdiff_t>(end));
    ranges[begin / kRange] = {*low, *high};
  });
  std::pair<SegmentId, SegmentId> all = ranges.front();
  for (const auto& [low, high] : ranges) {
    all = {std::min(all.first, low), std::max(all.second, high)};
  }
  return all;
}

/// Returns a value for each slot of a tree.
/// @param subtrees  ranges of nodes whose children are in the same range; the first one comes last,
///                  and children of its nodes may be anywhere
/// @param ids       the segments of the tree in any order
/// @param valueAt   valueAt(i): the value of the segment ids[i]
/// @param unite     unite(begin, end): the value of a child from those of its children
template <class Node, class ValueAt, class Unite>
auto valuesBySlot(const Node* nodes, const std::vector<NodeRange>& subtrees, const SegmentIds& ids,
                  parallel::Executor* executor, const ValueAt& valueAt, const Unite& unite) {
  using Value = std::decay_t<decltype(valueAt(std::size_t{0}))>;
  constexpr auto kArity = static_cast<std::size_t>(Node::kArity);
  constexpr std::size_t kRange = 1 << 14;
  const auto [first, last] = idRange(ids, executor);
  const auto index = [first_id = first](SegmentId id) {
    return static_cast<std::size_t>(id - first_id);
  };
  parallel::UnwrittenVector<Value> by_segment(index(last) + 1);
  parallel::forRanges(executor, ids.size(), kRange, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) by_segment[index(ids[i])] = valueAt(i);
  });
  parallel::UnwrittenVector<Value> by_slot(kArity * static_cast<std::size_t>(subtrees.back().end));
  const auto fill = [&](const NodeRange& range) {
    // Children come after their parent.
    for (auto i = static_cast<std::size_t>(range.end);
         i-- > static_cast<std::size_t>(range.begin);) {
      for (std::size_t lane = 0; lane < kArity; ++lane) {
        Value& value = by_slot[kArity * i + lane];
        value = {};
        if (lane >= static_cast<std::size_t>(nodes[i].child_count)) continue;
        const Link child = nodes[i].children[lane];
        if (child.isLeaf()) {
          value = by_segment[index(child.segment())];
          continue;
        }
        const auto below = static_cast<std::size_t>(child.node());
        const Value* const begin = by_slot.data() + kArity * below;
        value = unite(begin, begin + nodes[below].child_count);
      }
    }
  };
  parallel::forRanges(executor, subtrees.size() - 1, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) fill(subtrees[i + 1]);
  });
  fill(subtrees.front());
  return by_slot;
}

/// Sets Topology::groups and Topology::meets, or what has the same meaning.
/// @param subtrees  see valuesBySlot()
template <class Node, class Groups, class Meets>
void addRules(const Fibers& fibers, const Node* nodes, const std::vector<NodeRange>& subtrees,
              parallel::Executor* executor, Groups& groups, Meets& meets) {
  if (fibers.ids.empty()) return;
  if (!fibers.groups.empty()) {
    parallel::UnwrittenVector<Group> group_at(fibers.ids.size());
    const std::size_t count = fibers.groups.size();
    const std::size_t grain = 1 + (count << 14) / fibers.ids.size();
    parallel::forRanges(executor, count, grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t f = begin; f < end; ++f) {
        std::fill(group_at.begin() + fibers.begin[f], group_at.begin() + fibers.begin[f + 1],
                  fibers.groups[f]);
      }
    });
    groups = valuesBySlot(
        nodes, subtrees, fibers.ids, executor, [&](std::size_t i) { return group_at[i]; },
        [](const Group* begin, const Group* end) {
          const bool is_common =
              std::all_of(begin, end, [&](Group other) { return other == *begin; });
          return is_common ? *begin : kNoGroup;
        });
  }
  if (!fibers.meets.empty()) {
    meets = valuesBySlot(
        nodes, subtrees, fibers.ids, executor, [&](std::size_t i) { return fibers.meets[i]; },
        [](const Categories* begin, const Categories* end) {
          return std::accumulate(begin, end, kNoCategories, std::bit_or<>());
        });
  }
}

/// Sets the groups and categories of a topology on the calling thread.
template <int Arity>
void addRules(const Fibers& fibers, Topology<Arity>& topology) {
  const std::vector<NodeRange> all = {{0, static_cast<std::int32_t>(topology.nodes.size())}};
  addRules(fibers, topology.nodes.data(), all, nullptr, topology.groups, topology.meets);
}

}  // namespace fcl_fibers::tree
