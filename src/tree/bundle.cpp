// SPDX-License-Identifier: BSD-3-Clause
#include "tree/bundle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "tree/topology_builder.h"

namespace fcl_fibers::tree {
namespace {

/// Orders numbers as integers of 63 bits, and equal ones by position. None is NaN.
std::uint64_t keyOf(float number, std::int32_t position) {
  std::uint32_t bits;
  std::memcpy(&bits, &number, sizeof(bits));
  bits ^= (bits >> 31) != 0 ? ~std::uint32_t{0} : std::uint32_t{1} << 31;
  return std::uint64_t{bits} << 31 | static_cast<std::uint32_t>(position);
}

/// 1 if p < q, else 0. gcc turns a comparison into a branch, which is mispredicted half of the
/// time.
std::uint64_t isLess(std::uint64_t p, std::uint64_t q) { return (p - q) >> 63; }

/// Returns the key that would be at `rank` if all were sorted, and changes their order. All keys
/// differ.
///
/// This is Hoare's quickselect with Lomuto's partition, which moves every key without a branch that
/// could be mispredicted. That makes it faster than std::nth_element.
std::uint64_t keyAtRank(std::uint64_t* keys, std::size_t count, std::size_t rank) {
  for (int round = 0; count > 3; ++round) {
    if (round > 64) {  // only a sequence that is made to be slow
      std::nth_element(keys, keys + rank, keys + count);
      return keys[rank];
    }
    const std::uint64_t p = keys[0], q = keys[count / 2], r = keys[count - 1];
    const std::uint64_t pivot = std::max(std::min(p, q), std::min(std::max(p, q), r));
    std::size_t less = 0;  // at least one is, because the pivot is the median of three
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint64_t key = keys[i];
      keys[i] = keys[less];
      keys[less] = key;
      less += isLess(key, pivot);
    }
    if (rank < less) {
      count = less;
    } else {
      keys += less;
      count -= less;
      rank -= less;
    }
  }
  std::sort(keys, keys + count);
  return keys[rank];
}

}  // namespace

/// Turns a block into a subtree.
class BlockBuilder {
  using Strand = BundleBuild::Strand;
  using Part = BundleBuild::Part;

 public:
  /// @param strands  the strands of the block, which have `segments` segments in all
  BlockBuilder(const Fibers& fibers, const std::vector<Middle>& middles,
               std::vector<Strand> strands, std::int32_t segments)
      : fibers_(fibers), middles_(middles), strands_(std::move(strands)), segments_(segments) {}

  Topology<8> build() {
    builder_.reserve(static_cast<std::size_t>(segments_),
                     static_cast<std::size_t>(segments_) / 6 + 1);
    addNode(all());
    return builder_.take();
  }

  /// Builds the nodes above blocks of at most kPart segments, which become parts.
  Topology<8> buildTop(std::vector<Part>& parts) {
    parts_ = &parts;
    if (segments_ > kPart) {
      addNode(all());
    } else {
      addPart(all(), -1, 0);
    }
    return builder_.take();
  }

 private:
  static constexpr int kArity = 8;
  /// A part is small enough for several threads to share a scene, and about as large as a cache
  /// holds.
  static constexpr std::int32_t kPart = 1 << 15;

  /// A range of strands_, with the number of segments in all of them.
  struct Block {
    std::int32_t begin, end;
    std::int32_t segments;

    std::int32_t strands() const { return end - begin; }
  };

  Block all() const { return {0, static_cast<std::int32_t>(strands_.size()), segments_}; }
  const Middle& middleAt(std::int32_t i) const { return middles_[static_cast<std::size_t>(i)]; }
  Strand strand(std::int32_t begin, std::int32_t end) const {
    return {begin, end, middleAt(begin + (end - begin) / 2)};
  }
  Strand* at(std::int32_t i) { return strands_.data() + i; }

  std::int32_t addNode(const Block& block) {
    const std::int32_t node = builder_.openNode();
    if (block.segments <= kArity) {
      addLeaves(node, block);
    } else {
      addChildren(node, block);
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

  void addChildren(std::int32_t node, const Block& block) {
    const std::size_t strands_before = strands_.size();

    // The children are kept in order. While there is room, the one with most segments is split. A
    // child that fits into a full subtree stays whole, so nodes with few children are near the
    // root, where nodes are few.
    std::int32_t full = kArity;
    while (full < block.segments / kArity) full *= kArity;
    std::array<Block, kArity> children{block};
    int count = 1;
    while (count < kArity) {
      const auto largest =
          std::max_element(children.begin(), children.begin() + count,
                           [](const Block& p, const Block& q) { return p.segments < q.segments; });
      if (largest->segments <= full) break;
      std::copy_backward(largest + 1, children.begin() + count, children.begin() + count + 1);
      ++count;
      split(largest[0], largest[0], largest[1]);
    }
    for (int i = 0; i < count; ++i) {
      const Block& child = children[static_cast<std::size_t>(i)];
      if (child.segments == 1) {
        addLeaves(node, child);
      } else if (parts_ != nullptr && child.segments <= kPart) {
        addPart(child, node, i);
        builder_.addChild(node, Link::node(0));  // until the part is built
      } else {
        const std::int32_t below = addNode(child);
        builder_.addChild(node, Link::node(below));
      }
    }
    strands_.resize(strands_before);
  }

  void addPart(const Block& block, std::int32_t parent, int lane) {
    parts_->push_back({{at(block.begin), at(block.end)},
                       block.segments,
                       builder_.skipLeaves(block.segments),
                       parent,
                       lane,
                       {}});
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
    Middle low = at(block.begin)->middle, high = low;
    for (std::int32_t i = block.begin + 1; i < block.end; ++i) {
      const Middle& p = at(i)->middle;
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

  static double distance(const Middle& p, const Middle& q) {
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
      const Middle &first = middleAt(s.begin), &last = middleAt(s.end - 1);
      // The outer halves of the first and the last segment belong to it.
      sum += (distance(first, s.middle) + distance(s.middle, last)) * segments / (segments - 1);
    }
    return sum / samples;
  }

  /// About half of `count`: a multiple of the largest power of two for which a node has room, so
  /// that blocks fill nodes. Half of one is one.
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

  /// Splits at the strand that is at firstHalf() along an axis. Both halves keep their order, so
  /// that they are the same with every standard library.
  void splitAcross(const Block& block, int axis, Block& first, Block& second) {
    const std::int32_t count = block.strands(), half = firstHalf(count);
    keys_.resize(static_cast<std::size_t>(count));
    const auto keyAt = [&, k = static_cast<std::size_t>(axis)](std::int32_t i) {
      return keyOf(at(block.begin + i)->middle[k], i);
    };
    for (std::int32_t i = 0; i < count; ++i) keys_[static_cast<std::size_t>(i)] = keyAt(i);
    const std::uint64_t bound =
        keyAtRank(keys_.data(), keys_.size(), static_cast<std::size_t>(half));
    behind_.resize(static_cast<std::size_t>(count));
    Strand* next_first = at(block.begin);
    Strand* next_second = behind_.data();
    first = {block.begin, block.begin + half, 0};
    for (std::int32_t i = 0; i < count; ++i) {
      const Strand s = *at(block.begin + i);
      const auto is_first = static_cast<std::int32_t>(isLess(keyAt(i), bound));
      *next_first = s;
      *next_second = s;
      next_first += is_first;
      next_second += 1 - is_first;
      first.segments += is_first * (s.end - s.begin);
    }
    std::copy(behind_.data(), next_second, next_first);
    second = {first.end, block.end, block.segments - first.segments};
  }

  const Fibers& fibers_;
  const std::vector<Middle>& middles_;
  std::vector<Strand> strands_;  ///< a stack of the blocks on the path from the root
  std::int32_t segments_;
  TopologyBuilder<kArity> builder_;
  std::vector<Part>* parts_ = nullptr;  ///< not null if the blocks below are built elsewhere
  // For splitAcross().
  std::vector<std::uint64_t> keys_;
  std::vector<Strand> behind_;
};

BundleBuild::BundleBuild(const Fibers& fibers, const std::vector<Middle>& middles)
    : fibers_(fibers), middles_(middles) {
  std::vector<Strand> strands;
  strands.reserve(fibers.begin.size());
  for (std::size_t f = 0; f + 1 < fibers.begin.size(); ++f) {
    const std::int32_t begin = fibers.begin[f], end = fibers.begin[f + 1];
    if (begin == end) continue;
    strands.push_back({begin, end, middles[static_cast<std::size_t>(begin + (end - begin) / 2)]});
  }
  if (strands.empty()) return;
  const auto segments = static_cast<std::int32_t>(fibers.ids.size());
  top_ = BlockBuilder(fibers, middles, std::move(strands), segments).buildTop(parts_);
}

void BundleBuild::buildPart(std::size_t part) {
  Part& p = parts_[part];
  p.subtree = BlockBuilder(fibers_, middles_, std::move(p.strands), p.segments).build();
}

Topology<8> BundleBuild::finish() {
  if (top_.nodes.empty() && !parts_.empty()) {
    top_ = std::move(parts_.front().subtree);
    parts_.clear();
  }
  std::size_t nodes = top_.nodes.size();
  for (const Part& part : parts_) nodes += part.subtree.nodes.size();
  top_.nodes.reserve(nodes);
  for (Part& part : parts_) {
    const auto first = static_cast<std::int32_t>(top_.nodes.size());
    top_.nodes[static_cast<std::size_t>(part.parent)]
        .children[static_cast<std::size_t>(part.lane)] = Link::node(first);
    for (Topology<8>::Node node : part.subtree.nodes) {
      for (int lane = 0; lane < node.child_count; ++lane) {
        Link& child = node.children[static_cast<std::size_t>(lane)];
        if (!child.isLeaf()) child = Link::node(child.node() + first);
      }
      node.leaf_begin += part.leaf_begin;
      node.leaf_end += part.leaf_begin;
      top_.nodes.push_back(node);
    }
    std::copy(part.subtree.leaves.begin(), part.subtree.leaves.end(),
              top_.leaves.begin() + part.leaf_begin);
    part.subtree = {};
  }
  parts_.clear();
  addRules(fibers_, top_);
  return std::move(top_);
}

Topology<8> bundle(const Fibers& fibers, const std::vector<Middle>& middles) {
  BundleBuild build(fibers, middles);
  for (std::size_t part = 0; part < build.partCount(); ++part) build.buildPart(part);
  return build.finish();
}

}  // namespace fcl_fibers::tree
