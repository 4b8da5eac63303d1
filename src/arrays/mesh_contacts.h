// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/contact.h>

#include "arrays/located_segment.h"
#include "index/mesh_query.h"
#include "index/posed_triangles.h"

namespace fcl_fibers::arrays {

/// Computes the contacts of capsules with a mesh, which it borrows. Several threads may ask it.
class MeshContacts {
 public:
  explicit MeshContacts(const index::PosedMesh& mesh);
  MeshContacts(const MeshContacts&) = delete;

  /// @pre the mesh has this triangle
  MeshContact operator()(const LocatedSegment& capsule, index::TriangleId triangle) const;

 private:
  const bool is_solid_;
  /// Relative to the mesh's position, so that no digits are lost far from the origin.
  const geometry::Frame frame_;
  const index::PosedTriangles triangles_;
  const index::MeshQuery query_;
};

}  // namespace fcl_fibers::arrays
