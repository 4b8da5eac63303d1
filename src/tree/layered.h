// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "tree/topology.h"

namespace fcl_fibers::tree {

/// A hierarchy whose nodes bound the volumes of their children. For boxes this is the same as
/// bounding all segments below (Sobottka, Varnik and Weber, 2005, section 2.3, the lemma).
///
/// A Bvh fits its volumes by a hierarchy: first the leaves in any order, each in its slot, then the
/// nodes, children before parents.
template <class V, int A>
class Layered {
 public:
  using Volume = V;
  static constexpr int kArity = A;
  using Pack = typename Volume::template Pack<kArity>;

  /// The place where the volume of a leaf is kept.
  static std::int32_t slot(std::int32_t node, int lane, std::int32_t /*leaf*/) {
    return node * kArity + lane;
  }
  void reserve(const Topology<kArity>&) {}

  /// Fits the volume of a leaf and returns whether it has changed.
  static bool fitLeaf(std::int32_t slot, const geometry::Segment& segment, double padding,
                      std::vector<Pack>& packs) {
    return packs[static_cast<std::size_t>(slot / kArity)].replace(slot % kArity,
                                                                  Volume::around(segment, padding));
  }

  /// Whether fitLeaf() would change nothing.
  static bool isFitted(std::int32_t slot, const geometry::Segment& segment, double padding,
                       const std::vector<Pack>& packs) {
    return packs[static_cast<std::size_t>(slot / kArity)].holds(slot % kArity,
                                                                Volume::around(segment, padding));
  }

  /// It is inlined because gcc otherwise takes it for a function that does nothing.
  FCL_FIBERS_ALWAYS_INLINE static void prefetchLeaf(std::int32_t slot,
                                                    const std::vector<Pack>& packs) {
    const auto* pack =
        reinterpret_cast<const char*>(&packs[static_cast<std::size_t>(slot / kArity)]);
    for (std::size_t line = 0; line < sizeof(Pack); line += 64) __builtin_prefetch(pack + line, 1);
  }

  void startRefit() {}

  /// Fits a node's pack: the volumes of its children.
  static void fitNode(const Topology<kArity>& topology, std::size_t index,
                      std::vector<Pack>& packs) {
    const auto& node = topology.nodes[index];
    for (int lane = 0; lane < node.child_count; ++lane) {
      const Link child = node.children[static_cast<std::size_t>(lane)];
      if (child.isLeaf()) continue;
      packs[index].set(lane, packs[static_cast<std::size_t>(child.node())].unite());
    }
  }

  static Volume nodeVolume(std::size_t index, const std::vector<Pack>& packs) {
    return packs[index].unite();
  }

  std::size_t memoryUsage() const { return 0; }
};

}  // namespace fcl_fibers::tree
