// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/affine_map.h"
#include "tree/bvh.h"
#include "tree/search.h"
#include "tree/segment_range.h"

namespace fcl_fibers::tree {

/// The boxes of a mesh's triangles. Its leaves are numbers of triangles.
using MeshTree = LayeredBoxTree<8>;

/// A tree of segments and the tree of a mesh at a place.
template <class Tree>
struct MeshPair {
  const Tree& a;
  const MeshTree& b;
  const geometry::AffineMap& b_to_a;
  double error;           ///< bound on the error of the map's shift, in a's frame
  double growth;          ///< length by which the volumes of b grow, in a's frame
  SegmentRange segments;  ///< of the leaves of a; a box among them counts by its volume
  Categories categories;  ///< of the mesh
};

/// The kernels for the instruction set in use. In each pair a is a segment and b a triangle.
template <class Tree>
const PairKernels<MeshPair<Tree>>& pairKernels(const MeshPair<Tree>& trees);

}  // namespace fcl_fibers::tree
