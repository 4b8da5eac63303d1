// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/triangle_mesh.h>

#include "index/posed_mesh.h"

namespace fcl_fibers {

/// Gives the searches what they need of a mesh.
struct MeshReader {
  /// The result borrows the triangles from the mesh until that is updated or destroyed.
  static index::PlacedMesh placed(const TriangleMesh& mesh);
};

/// Throws std::invalid_argument if the mesh has no such triangle.
void requireTriangle(const char* call, const TriangleMesh& mesh, std::int32_t triangle);

}  // namespace fcl_fibers
