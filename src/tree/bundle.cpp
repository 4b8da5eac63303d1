// SPDX-License-Identifier: BSD-3-Clause
#include "tree/bundle.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "tree/bvh_node.h"
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

/// A range of one fiber, as a range of Fibers::ids.
struct Strand {
  std::int32_t begin, end;
  Middle middle;  ///< the midpoint of its middle segment
};
using Strands = parallel::UnwrittenVector<Strand>;

/// A block that becomes a subtree, and where that hangs.
struct Branch {
  Strands strands;
  std::int32_t segments;
  std::int32_t leaf_begin = 0;
  std::int32_t parent = -1;  ///< among the nodes near the root; -1 for the root
  std::size_t lane = 0;
};

/// Turns a block into a subtree.
class BlockBuilder {
 public:
  /// @param strands   the strands of the block, which have `segments` segments in all
  /// @param executor  shares the work of a split among threads; null for one thread
  BlockBuilder(const Fibers& fibers, const Middle* middles, Strands strands, std::int32_t segments,
               parallel::Executor* executor = nullptr)
      : fibers_(fibers),
        middles_(middles),
        executor_(executor),
        strands_(std::move(strands)),
        segments_(segments) {}

  Topology<8> build() {
    builder_.reserve(static_cast<std::size_t>(segments_),
                     static_cast<std::size_t>(segments_) / 6 + 1);
    addNode(all());
    return builder_.take();
  }

  /// The blocks of the root's children.
  std::vector<Branch> branches() {
    std::vector<Branch> below;
    for (const Block& child : childrenOf(all())) {
      below.push_back({Strands(at(child.begin), at(child.end)), child.segments});
    }
    return below;
  }

 private:
  static constexpr int kArity = 8;
  /// Strands that a thread takes of a split. It takes some hundredths of a millisecond.
  static constexpr std::int32_t kStrandsAtOnce = 512;

  /// A range of strands_, with the number of segments in all of them.
  struct Block {
    std::int32_t begin, end;
    std::int32_t segments;

    std::int32_t strands() const { return end - begin; }
  };
  struct Children {
    std::array<Block, kArity> blocks;
    std::ptrdiff_t count;

    const Block* begin() const { return blocks.data(); }
    const Block* end() const { return blocks.data() + count; }
  };
  struct Bounds {
    Middle low, high;
  };

  Block all() const { return {0, static_cast<std::int32_t>(strands_.size()), segments_}; }
  const Middle& middleAt(std::int32_t i) const { return middles_[i]; }
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
    for (const Block& child : childrenOf(block)) {
      if (child.segments == 1) {
        addLeaves(node, child);
      } else {
        const std::int32_t below = addNode(child);
        builder_.addChild(node, Link::node(below));
      }
    }
    strands_.resize(strands_before);
  }

  /// Splits a block of more than kArity segments into the blocks of a node's children. They change
  /// the order of its strands and stay behind all other strands.
  Children childrenOf(const Block& block) {
    // The children are kept in order. While there is room, the one with most segments is split. A
    // child that fits into a full subtree stays whole, so nodes with few children are near the
    // root, where nodes are few.
    std::int32_t full = kArity;
    while (full < block.segments / kArity) full *= kArity;
    Children children{{block}, 1};
    Block* const first = children.blocks.data();
    while (children.count < kArity) {
      Block* const end = first + children.count;
      Block* const largest = std::max_element(
          first, end, [](const Block& p, const Block& q) { return p.segments < q.segments; });
      if (largest->segments <= full) break;
      std::copy_backward(largest + 1, end, end + 1);
      ++children.count;
      split(largest[0], largest[0], largest[1]);
    }
    return children;
  }

  /// @pre the block has two segments or more
  void split(Block block, Block& first, Block& second) {
    int axis = 0;
    const double across = extentAcross(block, axis);
    if (splitOffStray(block, axis, across, first, second)) return;
    const bool can_split_along = block.segments > block.strands();
    if (block.strands() == 1 || (can_split_along && extentAlong(block) >= across)) {
      splitAlong(block, first, second);
    } else if (isShared(block.strands())) {
      splitAcrossTogether(block, axis, first, second);
    } else {
      splitAcross(block, axis, first, second);
    }
  }

  /// Whether several threads work on a split of so many strands.
  bool isShared(std::int32_t count) const {
    return executor_ != nullptr && count > 4 * kStrandsAtOnce;
  }
  /// Calls visit(number of the range, begin, end) for ranges of [0, count).
  template <class F>
  void forStrands(std::int32_t count, F&& visit) {
    const auto grain = static_cast<std::size_t>(kStrandsAtOnce);
    parallel::forRanges(
        executor_, static_cast<std::size_t>(count), grain, [&](std::size_t begin, std::size_t end) {
          visit(begin / grain, static_cast<std::int32_t>(begin), static_cast<std::int32_t>(end));
        });
  }
  static std::size_t rangeCount(std::int32_t count) {
    return static_cast<std::size_t>((count + kStrandsAtOnce - 1) / kStrandsAtOnce);
  }
  /// Returns for each range of [0, count) the sum of countIn(begin, end) over the ranges before it,
  /// and then the sum over all.
  template <class CountIn>
  std::vector<std::int32_t> sumsBefore(std::int32_t count, CountIn&& countIn) {
    std::vector<std::int32_t> sums(rangeCount(count) + 1);
    forStrands(count, [&](std::size_t range, std::int32_t begin, std::int32_t end) {
      sums[range + 1] = countIn(begin, end);
    });
    for (std::size_t i = 1; i < sums.size(); ++i) sums[i] += sums[i - 1];
    return sums;
  }

  /// The length of the longest side of the box around the middles of the strands, and its axis.
  double extentAcross(const Block& block, int& axis) {
    const Bounds bounds = boundsOf(block);
    double longest = -1;
    for (std::size_t k = 0; k < 3; ++k) {
      const double side = double{bounds.high[k]} - double{bounds.low[k]};
      if (side > longest) {
        longest = side;
        axis = static_cast<int>(k);
      }
    }
    return longest;
  }
  Bounds boundsOf(const Block& block) {
    if (!isShared(block.strands())) return boundsOf(at(block.begin), at(block.end));
    std::vector<Bounds> ranges(rangeCount(block.strands()));
    forStrands(block.strands(), [&](std::size_t range, std::int32_t begin, std::int32_t end) {
      ranges[range] = boundsOf(at(block.begin + begin), at(block.begin + end));
    });
    Bounds all = ranges.front();
    for (const Bounds& range : ranges) {
      take(range.low, all);
      take(range.high, all);
    }
    return all;
  }
  static Bounds boundsOf(const Strand* begin, const Strand* end) {
    Bounds bounds{begin->middle, begin->middle};
    for (const Strand* s = begin + 1; s < end; ++s) take(s->middle, bounds);
    return bounds;
  }
  static void take(const Middle& p, Bounds& bounds) {
    for (std::size_t k = 0; k < 3; ++k) {
      bounds.low[k] = std::min(bounds.low[k], p[k]);
      bounds.high[k] = std::max(bounds.high[k], p[k]);
    }
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

  /// Parts the strands that are far from all others along an axis from these, if there are few.
  /// Otherwise a single one would stretch every block that it is in, so that the blocks beside it
  /// would be slabs across its direction.
  bool splitOffStray(const Block& block, int axis, double extent, Block& first, Block& second) {
    constexpr std::int32_t kLeast = 64, kMostPart = 8;
    constexpr std::size_t kSamples = 16;
    const std::int32_t count = block.strands();
    if (count < kLeast) return false;
    const auto place = [k = static_cast<std::size_t>(axis)](const Strand& s) {
      return double{s.middle[k]};
    };
    std::array<double, kSamples> sample;
    const Strand* next = at(block.begin);
    for (double& x : sample) {
      x = place(*next);
      next += count / static_cast<std::int32_t>(kSamples);
    }
    // The sample may have a stray itself, as a ground that is registered first.
    std::sort(sample.begin(), sample.end());
    const double low = sample[1], high = sample[kSamples - 2], width = high - low;
    if (extent <= 8 * width) return false;
    // At most 5/8 of the extent are left, so a tree gets no deeper than there are scales.
    const double room = 2 * width;
    const auto isNear = [&](const Strand& s) {
      return place(s) >= low - room && place(s) <= high + room;
    };
    Strand *const begin = at(block.begin), *const end = at(block.end);
    const std::ptrdiff_t strays = (end - begin) - std::count_if(begin, end, isNear);
    if (strays == 0 || strays > count / kMostPart) return false;
    const Strand* const middle = std::stable_partition(begin, end, isNear);
    std::int32_t segments = 0;
    for (const Strand* s = middle; s < end; ++s) segments += s->end - s->begin;
    const auto half = static_cast<std::int32_t>(block.end - strays);
    first = {block.begin, half, block.segments - segments};
    second = {half, block.end, segments};
    return true;
  }

  /// Splits each strand in half. A strand of one segment goes to the first half.
  void splitAlong(const Block& block, Block& first, Block& second) {
    const std::int32_t count = block.strands();
    const auto begin = static_cast<std::int32_t>(strands_.size());
    strands_.resize(strands_.size() + 2 * static_cast<std::size_t>(count));
    Strand* const halves = at(begin);
    // Returns the number of segments in the first halves, and raises that of second halves.
    const auto halve = [&](std::int32_t from, std::int32_t to, std::int32_t& seconds) {
      std::int32_t segments = 0;
      for (std::int32_t i = from; i < to; ++i) {
        const Strand s = *at(block.begin + i);
        const std::int32_t middle = s.begin + firstHalf(s.end - s.begin);
        segments += middle - s.begin;
        halves[i] = strand(s.begin, middle);
        if (middle < s.end) halves[count + seconds++] = strand(middle, s.end);
      }
      return segments;
    };
    std::int32_t segments = 0, seconds = 0;
    if (!isShared(count)) {
      segments = halve(0, count, seconds);
    } else {
      const auto before = sumsBefore(count, [&](std::int32_t from, std::int32_t to) {
        return static_cast<std::int32_t>(
            std::count_if(at(block.begin + from), at(block.begin + to),
                          [](const Strand& s) { return s.end - s.begin > 1; }));
      });
      std::atomic<std::int32_t> sum{0};
      forStrands(count, [&](std::size_t range, std::int32_t from, std::int32_t to) {
        std::int32_t next = before[range];
        sum += halve(from, to, next);
      });
      segments = sum;
      seconds = before.back();
    }
    first = {begin, begin + count, segments};
    second = {first.end, first.end + seconds, block.segments - segments};
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

  /// What splitAcross() does, on all threads.
  void splitAcrossTogether(const Block& block, int axis, Block& first, Block& second) {
    const std::int32_t count = block.strands(), half = firstHalf(count);
    Strand* const strands = at(block.begin);
    const auto keyAt = [&, k = static_cast<std::size_t>(axis)](std::int32_t i) {
      return keyOf(strands[i].middle[k], i);
    };
    keys_.resize(static_cast<std::size_t>(count));
    forStrands(count, [&](std::size_t, std::int32_t from, std::int32_t to) {
      for (std::int32_t i = from; i < to; ++i) keys_[static_cast<std::size_t>(i)] = keyAt(i);
    });
    const std::uint64_t bound = sharedKeyAtRank(half);
    const auto firsts = sumsBefore(count, [&](std::int32_t from, std::int32_t to) {
      std::uint64_t less = 0;
      for (std::int32_t i = from; i < to; ++i) less += isLess(keyAt(i), bound);
      return static_cast<std::int32_t>(less);
    });
    behind_.resize(static_cast<std::size_t>(count));
    std::atomic<std::int32_t> segments{0};
    forStrands(count, [&](std::size_t range, std::int32_t from, std::int32_t to) {
      Strand* next_first = behind_.data() + firsts[range];
      Strand* next_second = behind_.data() + half + from - firsts[range];
      std::int32_t sum = 0;
      for (std::int32_t i = from; i < to; ++i) {
        const bool is_first = isLess(keyAt(i), bound) != 0;
        *(is_first ? next_first : next_second)++ = strands[i];
        if (is_first) sum += strands[i].end - strands[i].begin;
      }
      segments += sum;
    });
    forStrands(count, [&](std::size_t, std::int32_t from, std::int32_t to) {
      std::copy(behind_.data() + from, behind_.data() + to, strands + from);
    });
    first = {block.begin, block.begin + half, segments};
    second = {first.end, block.end, block.segments - first.segments};
  }

  /// Returns keyAtRank() of keys_. A sample brackets the key, so that few keys are left for one
  /// thread.
  std::uint64_t sharedKeyAtRank(std::int32_t rank) {
    constexpr std::size_t kSamples = 1024, kSlack = 64;  // four standard deviations
    const std::size_t count = keys_.size();
    std::array<std::uint64_t, kSamples> samples;
    for (std::size_t i = 0; i < kSamples; ++i) samples[i] = keys_[i * count / kSamples];
    const std::size_t near = static_cast<std::size_t>(rank) * kSamples / count;
    const auto sampleAt = [&](std::size_t i) {
      std::nth_element(samples.begin(), samples.begin() + i, samples.end());
      return samples[i];
    };
    const std::uint64_t low = near < kSlack ? 0 : sampleAt(near - kSlack);
    const std::uint64_t high = near + kSlack < kSamples ? sampleAt(near + kSlack) : kNoKey;
    std::vector<std::vector<std::uint64_t>> kept(rangeCount(static_cast<std::int32_t>(count)));
    std::atomic<std::int32_t> below{0};
    forStrands(static_cast<std::int32_t>(count), [&](std::size_t range, std::int32_t from,
                                                     std::int32_t to) {
      std::uint64_t less = 0;
      for (auto i = static_cast<std::size_t>(from); i < static_cast<std::size_t>(to); ++i) {
        less += isLess(keys_[i], low);
        if (keys_[i] >= low && keys_[i] < high) kept[range].push_back(keys_[i]);
      }
      below += static_cast<std::int32_t>(less);
    });
    std::vector<std::uint64_t> between;
    for (const auto& range : kept) between.insert(between.end(), range.begin(), range.end());
    const std::int32_t left = rank - below;
    if (left < 0 || static_cast<std::size_t>(left) >= between.size()) {
      return keyAtRank(keys_.data(), count, static_cast<std::size_t>(rank));
    }
    return keyAtRank(between.data(), between.size(), static_cast<std::size_t>(left));
  }

  static constexpr std::uint64_t kNoKey = std::uint64_t{1} << 63;  ///< after all keys

  const Fibers& fibers_;
  const Middle* middles_;
  parallel::Executor* executor_;
  Strands strands_;  ///< a stack of the blocks on the path from the root
  std::int32_t segments_;
  TopologyBuilder<kArity> builder_;
  // For splits across.
  parallel::UnwrittenVector<std::uint64_t> keys_;
  Strands behind_;
};

/// A block that is split near the root has more segments than a part. A part is small enough for
/// many threads to share a scene.
constexpr std::int32_t kPart = 1 << 12;
/// A block is split by all threads together if it has more strands than kWide, and more than one in
/// kFew of its level's. Blocks that have fewer are split at the same time.
constexpr std::size_t kWide = 1 << 12, kFew = 16;

/// All fibers as one block.
Branch rootOf(const Fibers& fibers, const Middle* middles, parallel::Executor* executor) {
  constexpr std::size_t kRange = 512;
  Branch root{{}, static_cast<std::int32_t>(fibers.ids.size())};
  root.strands.reserve(fibers.begin.size());
  for (std::size_t f = 0; f + 1 < fibers.begin.size(); ++f) {
    const std::int32_t begin = fibers.begin[f], end = fibers.begin[f + 1];
    if (begin < end) root.strands.push_back({begin, end, {}});
  }
  parallel::forRanges(executor, root.strands.size(), kRange, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      Strand& s = root.strands[i];
      s.middle = middles[s.begin + (s.end - s.begin) / 2];
    }
  });
  return root;
}

/// Splits all blocks of a level into the blocks of their children.
std::vector<std::vector<Branch>> splitLevel(const Fibers& fibers, const Middle* middles,
                                            std::vector<Branch>& level,
                                            parallel::Executor* executor) {
  std::vector<std::vector<Branch>> below(level.size());
  std::vector<std::size_t> narrow;
  std::size_t strands = 0;
  for (const Branch& branch : level) strands += branch.strands.size();
  const auto split = [&](std::size_t i, parallel::Executor* threads) {
    BlockBuilder builder(fibers, middles, std::move(level[i].strands), level[i].segments, threads);
    below[i] = builder.branches();
  };
  for (std::size_t i = 0; i < level.size(); ++i) {
    const std::size_t count = level[i].strands.size();
    if (count > kWide && count > strands / kFew) {
      split(i, executor);
    } else {
      narrow.push_back(i);
    }
  }
  parallel::forRanges(executor, narrow.size(), 1, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) split(narrow[i], nullptr);
  });
  return below;
}

}  // namespace

TopologyParts<8> bundleInParts(const Fibers& fibers, const Middle* middles,
                               parallel::Executor* executor) {
  TopologyParts<8> whole;
  if (fibers.ids.empty()) return whole;
  std::vector<Branch> level, branches;  // the branches become parts
  Branch root = rootOf(fibers, middles, executor);
  (root.segments > kPart ? level : branches).push_back(std::move(root));
  while (!level.empty()) {
    std::vector<std::vector<Branch>> below = splitLevel(fibers, middles, level, executor);
    std::vector<Branch> next;
    for (std::size_t i = 0; i < level.size(); ++i) {
      const Branch& above = level[i];
      const auto index = static_cast<std::int32_t>(whole.top.size());
      if (above.parent >= 0) whole.link(above.parent, above.lane, Link::node(index));
      whole.top.push_back(Topology<8>::Node::of(above.leaf_begin, above.segments));
      auto& node = whole.top.back();
      std::int32_t leaf = above.leaf_begin;
      for (Branch& branch : below[i]) {
        branch.leaf_begin = leaf;
        branch.parent = index;
        branch.lane = static_cast<std::size_t>(node.child_count++);
        leaf += branch.segments;
        if (branch.segments == 1) {
          const auto only = static_cast<std::size_t>(branch.strands.front().begin);
          node.children[branch.lane] = Link::leaf(fibers.ids[only]);
        } else {
          (branch.segments > kPart ? next : branches).push_back(std::move(branch));
        }
      }
    }
    level = std::move(next);
  }
  std::sort(branches.begin(), branches.end(),
            [](const Branch& p, const Branch& q) { return p.leaf_begin < q.leaf_begin; });
  whole.parts.resize(branches.size());
  parallel::forRanges(executor, branches.size(), 1, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      Branch& branch = branches[i];
      BlockBuilder builder(fibers, middles, std::move(branch.strands), branch.segments);
      whole.parts[i].subtree = builder.build();
    }
  });
  auto next_node = static_cast<std::int32_t>(whole.top.size());
  for (std::size_t i = 0; i < branches.size(); ++i) {
    whole.parts[i].node_begin = next_node;
    whole.parts[i].leaf_begin = branches[i].leaf_begin;
    if (branches[i].parent >= 0) {
      whole.link(branches[i].parent, branches[i].lane, Link::node(next_node));
    }
    next_node += static_cast<std::int32_t>(whole.parts[i].subtree.nodes.size());
  }
  return whole;
}

Topology<8> bundle(const Fibers& fibers, const Middle* middles, parallel::Executor* executor) {
  const TopologyParts<8> whole = bundleInParts(fibers, middles, executor);
  Topology<8> topology;
  topology.nodes = whole.top;
  topology.nodes.reserve(whole.nodeCount());
  topology.leaves.resize(whole.leafCount());
  for (const auto& part : whole.parts) {
    for (std::size_t i = 0; i < part.subtree.nodes.size(); ++i) {
      topology.nodes.push_back(part.nodeOfWhole(i));
    }
    std::copy(part.subtree.leaves.begin(), part.subtree.leaves.end(),
              topology.leaves.begin() + part.leaf_begin);
  }
  for (const auto& node : whole.top) {
    forEachLeafOf(topology.nodes.data(), node, [&](int lane, std::int32_t leaf) {
      const Link child = node.children[static_cast<std::size_t>(lane)];
      topology.leaves[static_cast<std::size_t>(leaf)] = child.segment();
    });
  }
  addRules(fibers, topology);
  return topology;
}

}  // namespace fcl_fibers::tree
