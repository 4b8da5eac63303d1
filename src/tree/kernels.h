// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <type_traits>

#include "simd/lanes.h"
#include "tree/bvh.h"
#include "tree/moving_tree.h"
#include "tree/search.h"
#include "tree/tree_pair.h"

namespace fcl_fibers::tree {

/// What is compiled for each instruction set: tests of all children of a node, and the searches
/// that consist of little else.
template <class Tree>
struct Kernels {
  using Pack = typename Tree::Pack;
  using Volume = typename Tree::Volume;
  static constexpr bool kMoves = std::is_same_v<Volume, geometry::MovingBox>;
  using Mesh = std::conditional_t<kMoves, MovingTree<MeshTree::kArity>, MeshTree>;

  /// overlaps() and nearer() of overlap-inl.h; a tree that moves has no nearer().
  ///@{
  simd::LaneMask (*overlaps)(const Pack& pack, const Volume& volume);
  simd::LaneMask (*nearer)(const Pack& pack, const Volume& volume, float limit,
                           float (&distances)[Tree::kArity]);
  ///@}

  /// visitOverlaps() of search.h
  ///@{
  Visit (*within)(const Tree& tree, const TraversalTask& task, PairBuffer& out);
  Visit (*between)(const TreePair<Tree>& trees, const TraversalTask& task, PairBuffer& out);
  Visit (*with_mesh)(const TreePair<Tree, Mesh>& trees, const TraversalTask& task, PairBuffer& out);
  Visit (*with_volume)(const Tree& tree, const Volume& volume, SegmentId second, Group group,
                       PairBuffer& out);
  ///@}
};

/// The kernels for the instruction set in use (simd/dispatch.h).
template <class Tree>
const Kernels<Tree>& kernels();
template <>
const Kernels<LayeredBoxTree<2>>& kernels();
template <>
const Kernels<LayeredBoxTree<8>>& kernels();
template <>
const Kernels<WrappedSphereTree<2>>& kernels();
template <>
const Kernels<WrappedSphereTree<8>>& kernels();
template <>
const Kernels<MovingTree<2>>& kernels();
template <>
const Kernels<MovingTree<8>>& kernels();

/// Visits the pairs between two slots one by one, in place of a kernel that has no room for more.
template <class Trees>
Visit visitOneByOne(const Trees& trees, std::int32_t a_slot, std::int32_t b_slot, PairBuffer& out);

}  // namespace fcl_fibers::tree
