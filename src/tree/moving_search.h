// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tree/mesh_search.h"
#include "tree/moving_tree.h"
#include "tree/search.h"

namespace fcl_fibers::tree {

/// A step of a tree of segments and a step of the tree of a mesh, in one frame.
template <int Arity>
struct MovingMeshPair {
  const MovingTree<Arity>& a;
  const MovingTree<MeshTree::kArity>& b;
  double growth;          ///< length by which the volumes of b grow
  Categories categories;  ///< of the mesh
};

/// The kernels for the instruction set in use, without `nearest`. In each pair a is a segment and b
/// a triangle.
///@{
const PairKernels<MovingMeshPair<2>>& pairKernels(const MovingMeshPair<2>& trees);
const PairKernels<MovingMeshPair<8>>& pairKernels(const MovingMeshPair<8>& trees);
///@}

}  // namespace fcl_fibers::tree
