// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "geometry/box.h"
#include "parallel/executor.h"
#include "tree/bvh_node.h"

namespace fcl_fibers::tree {

/// The hierarchy whose nodes bound the boxes of their children. For boxes this is the same as
/// bounding all segments below (Sobottka, Varnik and Weber, 2005, section 2.3, the lemma).
///
/// A Bvh fits its volumes by a hierarchy, chunk after chunk: the leaves of a chunk in their order,
/// then its nodes, children before parents.
template <int A>
class LayeredBoxes {
 public:
  using Volume = geometry::Box;
  static constexpr int kArity = A;
  using Pack = Volume::Pack<kArity>;
  using Nodes = parallel::UnwrittenVector<BvhNode<Pack, kArity>>;

  /// The boxes of a chunk's leaves until their nodes have them.
  using Leaves = geometry::BoxRows;

  void reserve(std::size_t /*leaves*/, std::size_t /*nodes*/, parallel::Executor* /*executor*/) {}
  void startRefit() {}

  /// Fits a block of leaves; the first is the chunk's leaf `first`. Segments that are not present
  /// have no volume.
  void fitLeaves(const geometry::SegmentBlock& segments, geometry::BlockMask present, int count,
                 double padding, std::int32_t /*leaf*/, Leaves& leaves, int first) const {
    boxesAround(segments, count, padding, leaves, first);
    for (auto absent = ~present & geometry::firstOfBlock(count); absent != 0;
         absent &= absent - 1) {
      leaves.clear(first + __builtin_ctzll(absent));
    }
  }

  /// Fits the nodes [begin, end) of a chunk after its leaves. Returns whether any volume has
  /// changed.
  static bool fitChunk(Nodes& nodes, std::int32_t begin, std::int32_t end, const Leaves& leaves);

  /// Fits the nodes [begin, end) of a chunk whose leaves were placed before.
  static void fitChunkAbove(Nodes& nodes, std::int32_t begin, std::int32_t end);

  /// Fits leaves that may be anywhere in the tree. slots[i] is the place of segment i, negative if
  /// it has none. Returns whether any has changed.
  static bool placeLeaves(Nodes& nodes, const std::int32_t* slots,
                          const geometry::SegmentBlock& segments, int count, double padding) {
    Leaves boxes;
    boxesAround(segments, count, padding, boxes, 0);
    bool changed = false;
    for (int i = 0; i < count; ++i) {
      if (i + kAhead < count) prefetchPack(nodes, slots[i + kAhead]);
      if (slots[i] < 0) continue;
      const auto node = static_cast<std::size_t>(slots[i] / kArity);
      changed |= nodes[node].pack.replace(slots[i] % kArity, boxes[i]);
    }
    return changed;
  }

  /// Fits one leaf and returns whether it has changed.
  bool fitLeaf(Nodes& nodes, std::int32_t node, int lane, std::int32_t /*leaf*/,
               const geometry::Segment& segment, double padding) {
    return nodes[static_cast<std::size_t>(node)].pack.replace(lane,
                                                              Volume::around(segment, padding));
  }

  /// Whether fitting this segment would change nothing.
  static bool holds(const typename Nodes::value_type& node, int lane, std::int32_t /*leaf*/,
                    const geometry::Segment& segment, double padding) {
    Pack pack = node.pack;
    return !pack.replace(lane, Volume::around(segment, padding));
  }

  /// Fits a node's volumes to the volumes below, except those of its leaves.
  static void fitNode(Nodes& nodes, std::size_t index);

  static Volume nodeVolume(const Nodes& nodes, std::size_t index);

  std::size_t memoryUsage() const { return 0; }

 private:
  static constexpr int kAhead = 8;

  /// It is inlined because gcc otherwise takes it for a function that does nothing.
  FCL_FIBERS_ALWAYS_INLINE static void prefetchPack(const Nodes& nodes, std::int32_t slot) {
    if (slot < 0) return;
    const auto* pack =
        reinterpret_cast<const char*>(&nodes[static_cast<std::size_t>(slot / kArity)].pack);
    for (std::size_t line = 0; line < sizeof(Pack); line += 64) __builtin_prefetch(pack + line, 1);
  }
};

extern template class LayeredBoxes<2>;
extern template class LayeredBoxes<8>;

}  // namespace fcl_fibers::tree
