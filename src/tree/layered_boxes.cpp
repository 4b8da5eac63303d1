// SPDX-License-Identifier: BSD-3-Clause
#include "tree/layered_boxes.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tree/layered_boxes.cpp"
#include <hwy/foreach_target.h>

#include "geometry/volume-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

using geometry::Box;
using geometry::BoxRows;
using geometry::HWY_NAMESPACE::replaceAll;
using geometry::HWY_NAMESPACE::unite;

template <int A>
using BoxNode = BvhNode<Box::Pack<A>, A>;

template <int A>
FCL_FIBERS_ALWAYS_INLINE void fitInner(BoxNode<A>* nodes, BoxNode<A>& node) {
  for (int lane = 0; lane < node.child_count; ++lane) {
    const Link child = node.children[static_cast<std::size_t>(lane)];
    if (!child.isLeaf()) node.pack.set(lane, unite(nodes[child.node()].pack));
  }
}

template <int A>
bool fitChunk(BoxNode<A>* nodes, std::int32_t begin, std::int32_t end, const BoxRows& leaves) {
  const std::int32_t first_leaf = nodes[begin].leaf_begin;
  bool changed = false;
  for (std::int32_t i = end; i-- > begin;) {
    BoxNode<A>& node = nodes[i];
    if (node.hasOnlyLeaves()) {
      changed |= replaceAll(node.pack, leaves, node.leaf_begin - first_leaf, node.child_count);
      continue;
    }
    forEachLeafOf(nodes, node, [&](int lane, std::int32_t leaf) HWY_ATTR {
      changed |= node.pack.replace(lane, leaves[leaf - first_leaf]);
    });
    if (changed) fitInner<A>(nodes, node);
  }
  return changed;
}

template <int A>
void fitChunkAbove(BoxNode<A>* nodes, std::int32_t begin, std::int32_t end) {
  for (std::int32_t i = end; i-- > begin;) {
    if (!nodes[i].hasOnlyLeaves()) fitInner<A>(nodes, nodes[i]);
  }
}

void fitChunkAbove2(BoxNode<2>* nodes, std::int32_t begin, std::int32_t end) {
  fitChunkAbove<2>(nodes, begin, end);
}
void fitChunkAbove8(BoxNode<8>* nodes, std::int32_t begin, std::int32_t end) {
  fitChunkAbove<8>(nodes, begin, end);
}
bool fitChunk2(BoxNode<2>* nodes, std::int32_t begin, std::int32_t end, const BoxRows& leaves) {
  return fitChunk<2>(nodes, begin, end, leaves);
}
bool fitChunk8(BoxNode<8>* nodes, std::int32_t begin, std::int32_t end, const BoxRows& leaves) {
  return fitChunk<8>(nodes, begin, end, leaves);
}

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dispatch.h"

namespace fcl_fibers::tree {

HWY_EXPORT(fitChunk2);
HWY_EXPORT(fitChunk8);
HWY_EXPORT(fitChunkAbove2);
HWY_EXPORT(fitChunkAbove8);

template <int A>
bool LayeredBoxes<A>::fitChunk(Nodes& nodes, std::int32_t begin, std::int32_t end,
                               const Leaves& leaves) {
  simd::readEnvironment();
  if constexpr (A == 2) {
    return HWY_DYNAMIC_DISPATCH(fitChunk2)(nodes.data(), begin, end, leaves);
  } else {
    return HWY_DYNAMIC_DISPATCH(fitChunk8)(nodes.data(), begin, end, leaves);
  }
}

template <int A>
void LayeredBoxes<A>::fitChunkAbove(Nodes& nodes, std::int32_t begin, std::int32_t end) {
  simd::readEnvironment();
  if constexpr (A == 2) {
    HWY_DYNAMIC_DISPATCH(fitChunkAbove2)(nodes.data(), begin, end);
  } else {
    HWY_DYNAMIC_DISPATCH(fitChunkAbove8)(nodes.data(), begin, end);
  }
}

template <int A>
void LayeredBoxes<A>::fitNode(Nodes& nodes, std::size_t index) {
  fitChunkAbove(nodes, static_cast<std::int32_t>(index), static_cast<std::int32_t>(index) + 1);
}

template <int A>
geometry::Box LayeredBoxes<A>::nodeVolume(const Nodes& nodes, std::size_t index) {
  Volume united = Volume::empty();
  for (int lane = 0; lane < nodes[index].child_count; ++lane) {
    const Volume box = nodes[index].pack.get(lane);
    for (int axis = 0; axis < 3; ++axis) {
      // In this order NaN loses.
      united.low[axis] = box.low[axis] < united.low[axis] ? box.low[axis] : united.low[axis];
      united.high[axis] = box.high[axis] > united.high[axis] ? box.high[axis] : united.high[axis];
    }
  }
  return united;
}

template class LayeredBoxes<2>;
template class LayeredBoxes<8>;

}  // namespace fcl_fibers::tree
#endif
