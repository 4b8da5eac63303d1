// SPDX-License-Identifier: BSD-3-Clause
#include "live/block_tree.h"

#include <algorithm>

namespace fcl_fibers::live {

using geometry::Box;

void BlockTree::resize(std::size_t leaf_count) {
  leaf_count_ = static_cast<Leaf>(leaf_count);
  levels_.clear();
  std::size_t packs = 0;
  for (std::int32_t below = leaf_count_; below > 0 && (levels_.empty() || below > 1);) {
    const std::int32_t each = levels_.empty() ? kBlock : kArity;
    below = (below + each - 1) / each;
    levels_.push_back({packs, below});
    packs += static_cast<std::size_t>((below + kArity - 1) / kArity);
  }
  packs_.resize(packs);
}

void BlockTree::joinAbove() {
  for (int level = 1; level < levelCount(); ++level) {
    for (std::int32_t i = 0; i < nodeCount(level); ++i) {
      const NodePack& below = pack(level - 1, i);
      const int count = std::min(nodeCount(level - 1) - i * kArity, kArity);
      const auto joined = [count](const Box::Pack<kArity>& boxes) {
        Box box;
        for (int axis = 0; axis < 3; ++axis) {
          box.low[axis] = *std::min_element(boxes.low(axis), boxes.low(axis) + count);
          box.high[axis] = *std::max_element(boxes.high(axis), boxes.high(axis) + count);
        }
        return box;
      };
      setNode(level, i,
              {joined(below.where), joined(below.moved),
               *std::max_element(below.growth, below.growth + count)});
    }
  }
}

}  // namespace fcl_fibers::live
