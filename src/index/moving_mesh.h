// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <optional>

#include <fcl_fibers/tree_export.h>

#include "geometry/frame.h"
#include "geometry/impact.h"
#include "geometry/moving_segment.h"
#include "geometry/triangle_impact.h"
#include "index/posed_triangles.h"
#include "parallel/executor.h"
#include "tree/moving_tree.h"

namespace fcl_fibers::index {

/// A mesh during a step, in the frame of an index. Each corner moves linearly from its place at the
/// start to that at the end. Searches are const and may run at the same time.
class MovingMesh {
 public:
  using Tree = tree::MovingTree<MeshTree::kArity>;

  /// @param start, end  the same triangles; their indexes are borrowed
  /// @param executor    null for one thread
  FCL_FIBERS_TREE_EXPORT MovingMesh(const PosedMesh& start, const PosedMesh& end,
                                    const geometry::Frame& frame, parallel::Executor* executor);

  bool empty() const { return end_.mesh.tree().empty(); }
  const PosedMesh& start() const { return start_; }
  const PosedMesh& end() const { return end_; }
  const geometry::Frame& frame() const { return frame_; }
  /// In the world's unit. A margin that is less at the start or at the end counts as the larger.
  double margin() const { return std::max(start_.margin, end_.margin); }

  const PosedTriangles& trianglesAtStart() const { return at_start_; }
  geometry::MovingTriangle operator[](TriangleId id) const { return {at_start_[id], at_end_[id]}; }
  /// Bounds the error of a corner at any time.
  double error() const { return std::max(at_start_.error, at_end_.error); }

  /// @param until  see MovingTree
  Tree tree(const std::atomic<float>& until = tree::kWholeStep) const {
    return {start_tree_, end_tree_ ? *end_tree_ : start_tree_, until};
  }

  FCL_FIBERS_TREE_EXPORT std::size_t memoryUsage() const;

 private:
  const PosedMesh start_, end_;
  const geometry::Frame frame_;
  const PosedTriangles at_start_, at_end_;
  const MeshTree start_tree_;
  const std::optional<MeshTree> end_tree_;  ///< if it moves
};

/// Finds when a segment first touches a triangle, or its box if the segment is one. See touches()
/// for margin and error.
bool findImpact(const geometry::MovingSegment& segment, const geometry::MovingTriangle& triangle,
                double margin, double error, geometry::Impact& impact);

/// The first touch of a segment and a mesh in a step.
struct MeshImpact {
  double time;
  TriangleId triangle;
};

/// Finds when a segment, in the frame of the mesh, first touches it. See touches() for margin and
/// error.
FCL_FIBERS_TREE_EXPORT bool findImpact(const MovingMesh& mesh,
                                       const geometry::MovingSegment& segment, double margin,
                                       double error, MeshImpact& impact);

}  // namespace fcl_fibers::index
