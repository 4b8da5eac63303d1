// SPDX-License-Identifier: BSD-3-Clause
#include "tree/topology.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "geometry/rounding.h"

namespace fcl_fibers::tree {
namespace {

using geometry::nearestFloat;
using geometry::Vec3d;

/// Appends nodes so that the invariants of Topology hold.
template <int Arity>
class Builder {
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
  Topology<Arity> take() { return std::move(topology_); }

 private:
  template <std::size_t... I>
  static std::array<Link, Arity> unlinked(std::index_sequence<I...>) {
    return {((void)I, Link::node(0))...};
  }
  std::int32_t leafCount() const { return static_cast<std::int32_t>(topology_.leaves.size()); }

  Topology<Arity> topology_;
};

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

/// A balanced binary tree over a sequence.
class ChainBuilder {
 public:
  explicit ChainBuilder(const std::vector<SegmentId>& chain) : chain_(chain) {
    builder_.reserve(chain.size(), chain.size());
  }

  Topology<2> build() {
    if (!chain_.empty()) addNode(0, chain_.size());
    return builder_.take();
  }

 private:
  std::int32_t addNode(std::size_t begin, std::size_t end) {
    const std::int32_t node = builder_.openNode();
    const std::size_t middle = begin + (end - begin + 1) / 2;
    addChild(node, begin, middle);
    if (middle < end) addChild(node, middle, end);
    builder_.closeNode(node);
    return node;
  }
  void addChild(std::int32_t parent, std::size_t begin, std::size_t end) {
    if (end - begin == 1) {
      builder_.addLeaf(parent, chain_[begin]);
    } else {
      builder_.addChild(parent, Link::node(addNode(begin, end)));
    }
  }

  const std::vector<SegmentId>& chain_;
  Builder<2> builder_;
};

class BundleBuilder {
 public:
  BundleBuilder(const Fibers& fibers, const SegmentRange& segments) : fibers_(fibers) {
    middles_.reserve(fibers.ids.size());
    for (const SegmentId id : fibers.ids) {
      // A box that is unbounded on a side counts as at the origin of the frame.
      const Vec3d p = isBounded(segments[id]) ? midpoint(segments[id]) : Vec3d{0, 0, 0};
      middles_.push_back({nearestFloat(p.x), nearestFloat(p.y), nearestFloat(p.z)});
    }
  }

  Topology<8> build() {
    const std::size_t count = fibers_.ids.size();
    if (count == 0) return {};
    builder_.reserve(count, count / 6 + 1);
    for (std::size_t f = 0; f + 1 < fibers_.begin.size(); ++f) {
      if (fibers_.begin[f] < fibers_.begin[f + 1]) {
        strands_.push_back(strand(fibers_.begin[f], fibers_.begin[f + 1]));
      }
    }
    addNode({0, static_cast<std::int32_t>(strands_.size()), static_cast<std::int32_t>(count)});
    return builder_.take();
  }

 private:
  static constexpr int kArity = 8;

  /// Points only decide where to split, for which floats are precise enough.
  using Point = std::array<float, 3>;

  /// A range of one fiber, as a range of Fibers::ids.
  struct Strand {
    std::int32_t begin, end;
    Point middle;  ///< midpoint of its middle segment
  };
  /// A range of strands_, with the number of segments in all of them.
  struct Block {
    std::int32_t begin, end;
    std::int32_t segments;

    std::int32_t strands() const { return end - begin; }
  };

  const Point& middleOf(std::int32_t i) const { return middles_[static_cast<std::size_t>(i)]; }
  Strand strand(std::int32_t begin, std::int32_t end) const {
    return {begin, end, middleOf(begin + (end - begin) / 2)};
  }
  Strand* at(std::int32_t i) { return strands_.data() + i; }

  std::int32_t addNode(const Block& block) {
    const std::int32_t node = builder_.openNode();
    if (block.segments <= kArity) {
      addLeaves(node, block);
    } else {
      addParts(node, block);
    }
    builder_.closeNode(node);
    return node;
  }

  /// The order does not matter, because a node tests all its children at once.
  void addLeaves(std::int32_t node, const Block& block) {
    for (std::int32_t i = block.begin; i < block.end; ++i) {
      for (std::int32_t s = at(i)->begin; s < at(i)->end; ++s) {
        builder_.addLeaf(node, fibers_.ids[static_cast<std::size_t>(s)]);
      }
    }
  }

  void addParts(std::int32_t node, const Block& block) {
    const std::size_t strands_before = strands_.size();

    // The parts of the block are kept in order. While there is room, the one with most segments is
    // split. A part that fits into a full subtree stays whole, so nodes with few children are near
    // the root, where nodes are few.
    std::int32_t full = kArity;
    while (full < block.segments / kArity) full *= kArity;
    std::array<Block, kArity> parts{block};
    int count = 1;
    while (count < kArity) {
      const auto largest =
          std::max_element(parts.begin(), parts.begin() + count,
                           [](const Block& p, const Block& q) { return p.segments < q.segments; });
      if (largest->segments <= full) break;
      std::copy_backward(largest + 1, parts.begin() + count, parts.begin() + count + 1);
      ++count;
      split(largest[0], largest[0], largest[1]);
    }
    for (int i = 0; i < count; ++i) {
      const Block& part = parts[static_cast<std::size_t>(i)];
      if (part.segments == 1) {
        addLeaves(node, part);
      } else {
        const std::int32_t child = addNode(part);
        builder_.addChild(node, Link::node(child));
      }
    }
    strands_.resize(strands_before);
  }

  /// @pre the block has two segments or more
  void split(Block block, Block& first, Block& second) {
    int axis = 0;
    const double across = extentAcross(block, axis);
    const bool can_split_along = block.segments > block.strands();
    if (block.strands() == 1 || (can_split_along && extentAlong(block) >= across)) {
      splitAlong(block, first, second);
    } else {
      splitAcross(block, axis, first, second);
    }
  }

  /// The length of the longest side of the box around the middles of the strands, and its axis.
  double extentAcross(const Block& block, int& axis) {
    Point low = at(block.begin)->middle, high = low;
    for (std::int32_t i = block.begin + 1; i < block.end; ++i) {
      const Point& p = at(i)->middle;
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], p[k]);
        high[k] = std::max(high[k], p[k]);
      }
    }
    double longest = -1;
    for (std::size_t k = 0; k < 3; ++k) {
      const double side = double{high[k]} - double{low[k]};
      if (side > longest) {
        longest = side;
        axis = static_cast<int>(k);
      }
    }
    return longest;
  }

  static double distance(const Point& p, const Point& q) {
    // No square of a float leaves the range of double.
    const double x = double{p[0]} - double{q[0]}, y = double{p[1]} - double{q[1]},
                 z = double{p[2]} - double{q[2]};
    return std::sqrt(x * x + y * y + z * z);
  }

  /// The mean length of the strands, estimated from a few of them and three points on each.
  double extentAlong(const Block& block) {
    constexpr std::int32_t kSamples = 8;
    const std::int32_t step = 1 + (block.strands() - 1) / kSamples;
    double sum = 0;
    int samples = 0;
    for (std::int32_t i = block.begin; i < block.end; i += step, ++samples) {
      const Strand& s = *at(i);
      const std::int32_t segments = s.end - s.begin;
      if (segments < 2) continue;
      const Point &first = middleOf(s.begin), &last = middleOf(s.end - 1);
      // The outer halves of the first and the last segment belong to it.
      sum += (distance(first, s.middle) + distance(s.middle, last)) * segments / (segments - 1);
    }
    return sum / samples;
  }

  /// About half of `count`, as a multiple of the largest power of two for which a node has room, so
  /// that sizes of blocks fill nodes. Half of one is one.
  static std::int32_t firstHalf(std::int32_t count) {
    std::int32_t unit = kArity;
    while (unit > 1 && 2 * unit > count) unit /= 2;
    return (count / unit + 1) / 2 * unit;
  }

  /// Splits each strand in half. A strand of one segment goes to the first half.
  void splitAlong(const Block& block, Block& first, Block& second) {
    const auto begin = static_cast<std::int32_t>(strands_.size());
    strands_.resize(strands_.size() + 2 * static_cast<std::size_t>(block.strands()));
    Strand* const halves = at(begin);
    std::int32_t seconds = 0;
    first = {begin, begin + block.strands(), 0};
    for (std::int32_t i = 0; i < block.strands(); ++i) {
      const Strand s = *at(block.begin + i);
      const std::int32_t middle = s.begin + firstHalf(s.end - s.begin);
      first.segments += middle - s.begin;
      halves[i] = strand(s.begin, middle);
      if (middle < s.end) halves[block.strands() + seconds++] = strand(middle, s.end);
    }
    second = {first.end, first.end + seconds, block.segments - first.segments};
    strands_.resize(static_cast<std::size_t>(second.end));
  }

  void splitAcross(const Block& block, int axis, Block& first, Block& second) {
    const std::int32_t middle = block.begin + firstHalf(block.strands());
    std::nth_element(at(block.begin), at(middle), at(block.end),
                     [k = static_cast<std::size_t>(axis)](const Strand& p, const Strand& q) {
                       // Ties are decided by position, so that the halves are the same everywhere.
                       return p.middle[k] != q.middle[k] ? p.middle[k] < q.middle[k]
                                                         : p.begin < q.begin;
                     });
    first = {block.begin, middle, 0};
    for (std::int32_t i = block.begin; i < middle; ++i) first.segments += at(i)->end - at(i)->begin;
    second = {middle, block.end, block.segments - first.segments};
  }

  const Fibers& fibers_;
  std::vector<Point> middles_;   ///< midpoints of the segments, in the order of Fibers::ids
  std::vector<Strand> strands_;  ///< a stack of the blocks on the path from the root
  Builder<kArity> builder_;
};

}  // namespace

Topology<2> superThread(const Fibers& fibers) {
  std::vector<SegmentId> chain(fibers.ids.size());
  auto out = chain.begin();
  for (std::size_t f = 0; f + 1 < fibers.begin.size(); ++f) {
    const auto root = fibers.ids.begin() + fibers.begin[f];
    const auto tip = fibers.ids.begin() + fibers.begin[f + 1];
    out = f % 2 == 0 ? std::copy(root, tip, out) : std::reverse_copy(root, tip, out);
  }
  Topology<2> topology = ChainBuilder(chain).build();
  topology.groups = groupsBySlot(topology, fibers);
  return topology;
}

Topology<8> bundle(const Fibers& fibers, const SegmentRange& segments) {
  Topology<8> topology = BundleBuilder(fibers, segments).build();
  topology.groups = groupsBySlot(topology, fibers);
  return topology;
}

}  // namespace fcl_fibers::tree
