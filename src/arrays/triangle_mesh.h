// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <fcl_fibers/triangle_mesh.h>

#include "geometry/affine_map.h"
#include "index/posed_mesh.h"

namespace fcl_fibers {

/// Gives the searches what they need of a mesh.
struct MeshReader {
  /// The result borrows the triangles from the mesh until that is updated or destroyed.
  static index::PlacedMesh placed(const TriangleMesh& mesh);

  /// Tells meshes apart. Copies are equal until one of them is updated.
  struct Version {
    std::uint64_t triangles = 0;  ///< of all that come from one construction
    std::uint64_t points = 0;     ///< another one after each update
  };
  static Version version(const TriangleMesh& mesh);
};

geometry::AffineMap toAffineMap(const MeshPose& pose);

/// Why a pose is refused and what to do, or nullptr if it is valid.
const char* poseProblem(const MeshPose& pose);

/// Throws std::invalid_argument if the mesh has no such triangle.
void requireTriangle(const char* call, const TriangleMesh& mesh, std::int32_t triangle);

}  // namespace fcl_fibers
