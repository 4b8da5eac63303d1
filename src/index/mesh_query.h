// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/posed_change.h"
#include "geometry/segment.h"
#include "index/posed_triangles.h"

namespace fcl_fibers::index {

/// Asks the tree of a mesh about one capsule after another, given in the frame for which the
/// triangles are posed.
class MeshQuery {
 public:
  /// @param triangles  borrowed
  explicit MeshQuery(const PosedTriangles& triangles)
      : triangles_(triangles),
        to_mesh_(triangles.posing.inverse()),
        to_tree_(triangles.from_tree.inverse()),
        // The inverse stretches nothing by twice as much as it stretches the first axis.
        change_(to_tree_, triangles.error * 2 * safeNorm(to_tree_.column[0])) {}

  /// The triangle that is nearest to the axis of a capsule, and their distance. The triangle is -1
  /// if none is as near as the limit.
  struct Nearest {
    TriangleId triangle;
    double distance;
  };
  Nearest nearest(const geometry::Segment& capsule, double limit) const;

  /// Whether a point is inside a watertight mesh: a ray from the point crosses an odd number of
  /// triangles. Edges and corners on the ray are decided as if the ray were moved by an
  /// infinitesimal distance (Edelsbrunner and Muecke, 1990).
  /// @pre the point is not within rounding of a triangle
  bool isInside(const geometry::Vec3d& point) const;

  /// The box of a segment, thickened by `padding`, in the frame of the mesh's tree.
  geometry::Box boxOf(const geometry::Segment& segment, double padding) const {
    if (segment.isBox() || !isBounded(segment)) {
      return change_(isBounded(segment) || segment.isBox() ? geometry::Box::around(segment, padding)
                                                           : geometry::Box::unbounded());
    }
    return change_.ofCapsule(segment, padding);
  }

  /// The box of a volume in the frame of the mesh's tree.
  template <class Volume>
  geometry::Box inTree(const Volume& volume) const {
    return change_(volume);
  }

 private:
  const PosedTriangles& triangles_;
  geometry::AffineMap to_mesh_, to_tree_;
  geometry::PosedChange<geometry::Box> change_;
};

}  // namespace fcl_fibers::index
