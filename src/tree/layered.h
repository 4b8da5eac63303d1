// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "tree/topology.h"

namespace fcl_fibers::tree {

/// A hierarchy whose nodes bound the volumes of their children. For boxes that is the same as
/// bounding all segments below (Sobottka, Varnik and Weber, section 2.3, the lemma).
///
/// A hierarchy is what a FiberTree fits its volumes with, node by node, children before parents.
template <class V, int A>
class Layered {
 public:
  using Volume = V;
  static constexpr int kArity = A;
  using Pack = typename Volume::template Pack<kArity>;

  void startRefit(const Topology<kArity>&) {}

  /// Fits the volumes of a node's children, which are its pack.
  void refitNode(const Topology<kArity>& topology, std::size_t index,
                 const std::vector<geometry::Segment>& segments, double padding,
                 std::vector<Pack>& packs) {
    const auto& node = topology.nodes[index];
    Pack& pack = packs[index];
    for (int lane = 0; lane < node.child_count; ++lane) {
      const Link child = node.children[static_cast<std::size_t>(lane)];
      pack.set(lane,
               child.isLeaf()
                   ? Volume::around(segments[static_cast<std::size_t>(child.segment())], padding)
                   : packs[static_cast<std::size_t>(child.node())].unite());
    }
  }

  std::size_t memoryUsage() const { return 0; }
};

}  // namespace fcl_fibers::tree
