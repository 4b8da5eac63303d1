// SPDX-License-Identifier: BSD-3-Clause
#include "live/block_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tree/extent.h"

namespace fcl_fibers::live {

using geometry::Box;
using geometry::Vec3d;

void BlockTree::resize(std::size_t leaf_count) {
  leaf_count_ = static_cast<Leaf>(leaf_count);
  levels_.assign(1, 0);
  for (std::int32_t count = leaf_count_, last = 0; count > 0 && last != 1; last = count) {
    count = levels_.size() == 1 ? (count + kBlock - 1) / kBlock : (count + kArity - 1) / kArity;
    levels_.push_back(levels_.back() + count);
  }
  nodes_.resize(static_cast<std::size_t>(levels_.back()));
}

Box BlockTree::join(const Box& p, const Box& q) {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = std::min(p.low[axis], q.low[axis]);
    box.high[axis] = std::max(p.high[axis], q.high[axis]);
  }
  return box;
}

void BlockTree::joinAbove() {
  for (int level = 1; level < levelCount(); ++level) {
    for (std::int32_t i = 0; i < nodeCount(level); ++i) {
      const std::int32_t first = i * kArity;
      const std::int32_t end = std::min(first + kArity, nodeCount(level - 1));
      Node above = node(level - 1, first);
      for (std::int32_t child = first + 1; child < end; ++child) {
        const Node& below = node(level - 1, child);
        above.where = join(above.where, below.where);
        above.moved = join(above.moved, below.moved);
        above.growth = std::max(above.growth, below.growth);
      }
      nodes_[static_cast<std::size_t>(levelBegin(level) + i)] = above;
    }
  }
}

/// The median of the displacements of the blocks around one, by axis.
Vec3d BlockTree::usualAround(std::int32_t block) const {
  // They are below the same node, three levels above.
  constexpr std::int32_t kAround = kArity * kArity * kArity;
  const std::int32_t begin = block / kAround * kAround;
  const std::int32_t end = std::min(begin + kAround, blockCount());
  std::array<double, kAround> numbers;
  Vec3d usual{0, 0, 0};
  for (int axis = 0; axis < 3; ++axis) {
    const auto last = std::transform(nodes_.begin() + begin, nodes_.begin() + end, numbers.begin(),
                                     [axis](const Node& node) {
                                       const Vec3d middle = tree::centerOfVolume(node.moved);
                                       return middle.*geometry::kAxes[axis];
                                     });
    const auto middle = numbers.begin() + (last - numbers.begin()) / 2;
    std::nth_element(numbers.begin(), middle, last);
    if (std::isfinite(*middle)) usual.*geometry::kAxes[axis] = *middle;
  }
  return usual;
}

double BlockTree::deviationOf(const Node& node, std::int32_t block) const {
  const double deviation = norm(tree::centerOfVolume(node.moved) - usualAround(block));
  return deviation >= 0 ? deviation : std::numeric_limits<double>::infinity();
}

}  // namespace fcl_fibers::live
