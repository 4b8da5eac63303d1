// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/affine_map.h"
#include "geometry/capsule_test.h"
#include "geometry/triangle.h"

namespace fcl_fibers::geometry {

/// The corners of a triangle of a mesh.
struct MeshCorners {
  const MeshPoint *a, *b, *c;
};

/// A block of pairs of a capsule or rounded cone and a triangle of a mesh.
class TrianglePairs : public PairsOf<const CapsuleEnd*, MeshCorners> {
 public:
  /// @param posing  takes the points of the mesh to the frame of the capsules
  TrianglePairs(const AffineMap& posing, double unit);
  Verdict decide();
  /// The columns of the map and its shift, with a fourth number of 0.
  const MeshPoint (&posing() const)[4] { return posing_; }

 private:
  MeshPoint posing_[4];
};

}  // namespace fcl_fibers::geometry
