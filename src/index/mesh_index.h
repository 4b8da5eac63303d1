// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <fcl_fibers/tree_export.h>

#include "geometry/affine_map.h"
#include "geometry/frame.h"
#include "geometry/triangle.h"
#include "parallel/executor.h"
#include "tree/tree_pair.h"

namespace fcl_fibers::index {

using TriangleId = std::int32_t;
using tree::MeshTree;

/// The triangles of a mesh and a tree of boxes over them, both in the mesh's own coordinates. So a
/// rigid motion changes nothing here, and objects of one geometry share one index. Searches are
/// const and may run at the same time.
class FCL_FIBERS_TREE_EXPORT MeshIndex {
 public:
  /// Takes the points and triangles and builds the tree.
  /// @pre all indices are points, and all coordinates are finite
  MeshIndex(std::vector<geometry::MeshPoint> points,
            std::vector<geometry::TriangleIndices> triangles);

  /// Takes other points for the same triangles and refits the tree.
  /// @pre as many points as before, with finite coordinates
  void refit(const std::vector<geometry::MeshPoint>& points) {
    refitAfter([&](std::vector<geometry::MeshPoint>& own) { own = points; });
  }
  /// Calls write(points), which changes the coordinates of the points in place, and refits the
  /// tree.
  template <class Write>
  void refitAfter(Write&& write) {
    write(points_);
    chooseFrame();
    fit(tree_, points_, frame_, nullptr);
  }

  const std::vector<geometry::MeshPoint>& points() const { return points_; }
  const std::vector<geometry::TriangleIndices>& triangles() const { return triangles_; }
  geometry::Triangle triangle(TriangleId id) const;

  const MeshTree& tree() const { return tree_; }
  /// The tree of the triangles of other points after a map, in the frame that the map leads to. It
  /// is worth its time for many segments, because the boxes of tree() grow when they are turned.
  /// @param points    as many as points()
  /// @param executor  null for one thread
  MeshTree posedTree(const std::vector<geometry::MeshPoint>& points,
                     const geometry::AffineMap& posing, parallel::Executor* executor) const;
  /// The frame of the tree: q = scale (p - origin) for a point p.
  const geometry::Frame& frame() const { return frame_; }
  /// Whether the triangles have the same numbers of points as those of another mesh.
  bool hasTrianglesOf(const MeshIndex& other) const;
  /// The largest magnitude of a coordinate.
  double reach() const { return reach_; }

  std::size_t memoryUsage() const;

 private:
  geometry::Segment boxOf(TriangleId id, const std::vector<geometry::MeshPoint>& points,
                          const geometry::Frame& frame) const;
  void chooseFrame();
  void fit(MeshTree& tree, const std::vector<geometry::MeshPoint>& points,
           const geometry::Frame& frame, parallel::Executor* executor) const;

  std::vector<geometry::MeshPoint> points_;
  std::vector<geometry::TriangleIndices> triangles_;
  MeshTree tree_;
  geometry::Frame frame_;
  double reach_ = 0;
};

/// Whether the triangles of a watertight mesh face inward, so that they enclose a negative volume.
/// pointOf(i) is a point, in a frame that suits the mesh.
template <class PointOf>
bool faceInward(const std::vector<geometry::TriangleIndices>& triangles, PointOf&& pointOf) {
  double volume = 0, size = 0;
  for (const geometry::TriangleIndices& t : triangles) {
    const double part = dot(pointOf(t.a), cross(pointOf(t.b), pointOf(t.c)));
    volume += part;
    size += std::fabs(part);
  }
  // The volume of a flat mesh is nothing but rounding.
  return volume < -0x1p-40 * size;
}
FCL_FIBERS_TREE_EXPORT bool isInsideOut(const MeshIndex& mesh);

/// Whether each edge of a triangle is that of exactly one other one, in the opposite direction.
/// Returns the first triangle for which that does not hold, or -1.
FCL_FIBERS_TREE_EXPORT TriangleId
firstLeak(const std::vector<geometry::TriangleIndices>& triangles);
/// Tells where a mesh with a leak is not watertight, and what to do about it: "...; remedy".
FCL_FIBERS_TREE_EXPORT std::string leakProblem(
    const std::vector<geometry::MeshPoint>& points,
    const std::vector<geometry::TriangleIndices>& triangles);

}  // namespace fcl_fibers::index
