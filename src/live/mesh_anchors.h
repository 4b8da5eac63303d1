// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/affine_map.h"
#include "geometry/rigid_fit.h"
#include "geometry/triangle.h"
#include "index/posed_mesh.h"
#include "live/block_tree.h"
#include "live/displacements.h"
#include "parallel/executor.h"
#include "parallel/unwritten.h"

namespace fcl_fibers::live {

/// The triangles of a mesh as they are now, in the frame of the anchors.
struct TrianglesNow {
  const index::PosedTriangles* triangles;
  std::uint64_t version;  ///< not 0; another one if the mesh's own points are others

  const tree::SegmentIds& order() const { return triangles->mesh().tree().leaves(); }
};

/// Where the points of a mesh were when pairs were listed. They are one closed surface if the mesh
/// is one, because all are anchored at once.
class MeshAnchors : public BlockTree {
 public:
  /// Anchors all points where they are.
  /// @param executor  null for one thread
  void set(const TrianglesNow& now, parallel::Executor* executor);

  /// Bounds the displacements of all points. A mesh that rests, or has moved as a whole, costs time
  /// for its blocks and not for its points.
  void measure(const TrianglesNow& now, const geometry::AffineMap& motion,
               parallel::Executor* executor);

  /// Writes the nodes of the triangles of a block, by the last motion.
  void writeNodes(const TrianglesNow& now, std::int32_t block, BlockNodes& nodes) const;

  /// Adds a sample of points to `points`.
  void sample(const TrianglesNow& now, std::vector<geometry::MovedPoint>& points) const;

  /// A triangle as it was anchored.
  geometry::Triangle triangle(const TrianglesNow& now, Leaf leaf) const;

  std::size_t memoryUsage() const { return anchors_.capacity() * sizeof(Anchor) + nodesMemory(); }

 private:
  geometry::Vec3d at(std::size_t point) const {
    const float* const numbers = anchors_[point].numbers;
    return {numbers[0], numbers[1], numbers[2]};
  }
  geometry::Vec3d displacementOf(const TrianglesNow& now, std::size_t point) const;
  double errorOf(const TrianglesNow& now) const;
  void measurePoints(const TrianglesNow& now, parallel::Executor* executor);
  void measureWhole(const TrianglesNow& now);

  parallel::UnwrittenVector<Anchor> anchors_;  ///< by point of the mesh; the last number is 0
  geometry::AffineMap motion_;
  // What was anchored.
  std::uint64_t version_ = 0;
  geometry::AffineMap posing_;
  double error_ = 0;
  double rounding_ = 0;  ///< bounds the distance of a point from its anchor
};

}  // namespace fcl_fibers::live
