// SPDX-License-Identifier: BSD-3-Clause
#include "tree/topology.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "geometry/rounding.h"
#include "tree/topology_builder.h"

namespace fcl_fibers::tree {
namespace {

using geometry::nearestFloat;
using geometry::Vec3d;

/// A balanced binary tree over a sequence.
class ChainBuilder {
 public:
  explicit ChainBuilder(const SegmentIds& chain) : chain_(chain) {
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

  const SegmentIds& chain_;
  TopologyBuilder<2> builder_;
};

}  // namespace

Middle middleOf(const geometry::Segment& segment) {
  const Vec3d p = isBounded(segment) ? midpoint(segment) : Vec3d{0, 0, 0};
  return {nearestFloat(p.x), nearestFloat(p.y), nearestFloat(p.z)};
}

void middlesOf(const geometry::SegmentBlock& segments, int count, Middle* out) {
  constexpr std::size_t kCapacity = geometry::SegmentBlock::kCapacity;
  const auto size = static_cast<std::size_t>(count);
  // Loops without branches, which compilers turn into vectors.
  float middle[3][kCapacity];
  double sum[kCapacity] = {};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double *const a = segments.a[axis], *const b = segments.b[axis];
    for (std::size_t i = 0; i < size; ++i) {
      middle[axis][i] = nearestFloat(0.5 * a[i] + 0.5 * b[i]);
      sum[i] += std::fabs(a[i]) + std::fabs(b[i]);
    }
  }
  for (std::size_t i = 0; i < size; ++i) {
    out[i] = std::isfinite(sum[i]) ? Middle{middle[0][i], middle[1][i], middle[2][i]}
                                   : middleOf(segments[static_cast<int>(i)]);
  }
}

Topology<2> superThread(const Fibers& fibers) {
  SegmentIds chain(fibers.ids.size());
  auto out = chain.begin();
  for (std::size_t f = 0; f + 1 < fibers.begin.size(); ++f) {
    const auto root = fibers.ids.begin() + fibers.begin[f];
    const auto tip = fibers.ids.begin() + fibers.begin[f + 1];
    out = f % 2 == 0 ? std::copy(root, tip, out) : std::reverse_copy(root, tip, out);
  }
  Topology<2> topology = ChainBuilder(chain).build();
  addRules(fibers, topology);
  return topology;
}

}  // namespace fcl_fibers::tree
