// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/affine_map.h"
#include "geometry/frame.h"
#include "geometry/triangle.h"
#include "index/mesh_index.h"

namespace fcl_fibers::index {

/// Whether no coordinate of a mesh overflows in a frame, with room for sums of several.
inline bool fitsIn(const geometry::Frame& frame, const PosedMesh& posed) {
  const double most = posed.mesh.reach() + maxNorm(posed.pose.shift) + maxNorm(frame.origin);
  return std::isfinite(frame.scale * (16 * most));
}

/// The triangles of a mesh in the frame of an index.
struct PosedTriangles {
  PosedTriangles(const PosedMesh& posed, const geometry::Frame& frame)
      : mesh(posed.mesh), posing(posed.pose) {
    for (geometry::Vec3d& column : posing.column) column = frame.scale * column;
    posing.shift = frame.fromWorld(posed.pose.shift);
    // A point carries three products, their sums and the shift, which is rounded twice.
    constexpr double kError = 16 * std::numeric_limits<double>::epsilon();
    error = kError * (frame.scale * mesh.reach() + maxNorm(posing.shift));
    from_tree = posing;
    const double unit = 1 / mesh.frame().scale;
    for (geometry::Vec3d& column : from_tree.column) column = unit * column;
    from_tree.shift = posing(mesh.frame().origin);
  }

  /// Whether no product or sum on the way to a posed point overflows.
  bool isFarFromOverflow() const { return std::isfinite(error * 0x1p60); }

  geometry::Triangle operator[](TriangleId id) const {
    const geometry::Triangle t = mesh.triangle(id);
    return {posing(t.a), posing(t.b), posing(t.c)};
  }

  const MeshIndex& mesh;
  geometry::AffineMap posing;     ///< from the mesh's coordinates to the index's frame
  geometry::AffineMap from_tree;  ///< from the frame of the mesh's tree to the index's frame
  double error;                   ///< bounds the error of a posed point in the index's frame
};

}  // namespace fcl_fibers::index
