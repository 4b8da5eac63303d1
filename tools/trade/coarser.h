// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

#include "tools/mesh_file.h"

namespace fcl_fibers::tools::trade {

/// Fibers of fewer segments.
struct CoarserFibers {
  FiberPolylines fibers;
  std::vector<std::int32_t> segment_of;  ///< by first point of the finer segment, which is in it
  double error;  ///< how far a finer segment is at most from its segment's axis, or, if radii are
                 ///< those of points, sticks out of that segment
};

/// Every n-th point of each fiber, its last, and those at which others start or end. A segment has
/// the largest radius of those that it replaces, unless radii are those of points.
CoarserFibers everyNth(const FiberPolylines& fibers, std::size_t n);

/// A mesh of fewer triangles.
struct CoarserMesh {
  MeshFile mesh;
  double error;  ///< how far a point of the finer mesh is at most from it
};

/// Unites points that are in one cell of a grid, whose edge is `edges` times the mean one of a
/// triangle, in their mean (Rossignac and Borrel, Multi-resolution 3D approximations for rendering
/// complex scenes, 1993). Triangles that become edges or points are kept as such where no other
/// triangle has them, so that nothing of the mesh is farther away than its corners have moved.
CoarserMesh clusterPoints(const MeshFile& mesh, double edges);

}  // namespace fcl_fibers::tools::trade
