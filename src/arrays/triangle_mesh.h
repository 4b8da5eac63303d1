// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/triangle_mesh.h>

#include "index/mesh_index.h"

namespace fcl_fibers {

/// Gives the searches what they need of a mesh.
struct MeshReader {
  /// The result borrows the triangles from the mesh until that is updated or destroyed.
  static index::PosedMesh posed(const TriangleMesh& mesh);
};

}  // namespace fcl_fibers
