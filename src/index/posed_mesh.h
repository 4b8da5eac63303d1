// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <fcl_fibers/tree_export.h>

#include "geometry/affine_map.h"
#include "geometry/frame.h"
#include "geometry/moving_segment.h"
#include "geometry/posed_change.h"
#include "index/mesh_index.h"
#include "parallel/executor.h"
#include "tree/moving_tree.h"

namespace fcl_fibers::index {

/// A mesh at a place in the world.
struct PlacedMesh {
  const MeshIndex& mesh;
  geometry::AffineMap pose;                            ///< from the mesh's coordinates to the world
  tree::Categories categories = tree::kAllCategories;  ///< which segments meet it
  bool is_solid = false;                               ///< whether its inside counts
  /// Its own margin, in the world's unit: it is touched from this much further away than a search's
  /// margin says, and it is this much nearer than its triangles. Not negative.
  double margin = 0;
};

/// Whether no coordinate of a mesh overflows in a frame, with room for sums of several.
bool FCL_FIBERS_TREE_EXPORT fitsIn(const geometry::Frame& frame, const PlacedMesh& mesh);

/// The triangles of a mesh in the frame of an index, and their tree for one segment after another
/// of that frame.
class PosedTriangles {
 public:
  FCL_FIBERS_TREE_EXPORT PosedTriangles(const PlacedMesh& placed, const geometry::Frame& frame);

  const PlacedMesh& placed() const { return placed_; }
  const MeshIndex& mesh() const { return placed_.mesh; }
  /// From the mesh's coordinates to the frame.
  const geometry::AffineMap& posing() const { return posing_; }
  /// From the frame of the mesh's tree to the frame.
  const geometry::AffineMap& fromTree() const { return from_tree_; }
  /// Bounds the error of a posed point in the frame.
  double error() const { return error_; }
  /// Whether no product or sum on the way to a posed point overflows.
  bool isFarFromOverflow() const;

  geometry::Triangle operator[](TriangleId id) const {
    const geometry::Triangle t = mesh().triangle(id);
    return {posing_(t.a), posing_(t.b), posing_(t.c)};
  }

  /// Whether a segment is at most `margin` from a triangle or, if it is a box, from that around the
  /// triangle.
  /// @param its_error  bounds the error of the segment's end points, if it is larger than their
  ///                   coordinates imply
  bool touches(const geometry::Segment& segment, double its_error, TriangleId id,
               double margin) const;

  /// The triangle that is nearest to the axis of a capsule, and their distance. Of a cone it is the
  /// one nearest to the surface, and the distance is that of the surface and the larger radius
  /// together. The triangle is -1 if none is as near as the limit.
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
  /// The same for a segment that touches no triangle. The middle of a box stands for the box.
  bool isInside(const geometry::Segment& segment) const {
    return isInside(segment.isBox() ? midpoint(segment) : segment.a);
  }

  /// The box of a segment, thickened by `padding`, in the frame of the mesh's tree.
  geometry::Box boxOf(const geometry::Segment& segment, double padding) const;
  /// The box of a volume there.
  template <class Volume>
  geometry::Box inTree(const Volume& volume) const {
    return to_tree_(volume);
  }

 private:
  PlacedMesh placed_;
  geometry::AffineMap posing_, from_tree_, to_mesh_;
  double error_;
  geometry::PosedChange<geometry::Box> to_tree_;
};

/// A mesh in the frame of an index, at both ends of a step. In between, each corner moves linearly.
/// At rest both ends are the same, and it has no trees of its own. Searches are const and may run
/// at the same time.
class PosedMesh {
 public:
  using Tree = tree::MovingTree<MeshTree::kArity>;

  /// A mesh at rest.
  PosedMesh(const PlacedMesh& mesh, const geometry::Frame& frame)
      : frame_(frame), start_(mesh, frame), end_(start_) {}
  /// A step.
  /// @param start, end  the same triangles; their indexes are borrowed
  /// @param executor    null for one thread
  FCL_FIBERS_TREE_EXPORT PosedMesh(const PlacedMesh& start, const PlacedMesh& end,
                                   const geometry::Frame& frame, parallel::Executor* executor);

  bool empty() const { return end_.mesh().tree().empty(); }
  bool hasStep() const { return start_tree_.has_value(); }
  const geometry::Frame& frame() const { return frame_; }
  const PosedTriangles& start() const { return start_; }
  const PosedTriangles& end() const { return end_; }
  bool isSolid() const { return end_.placed().is_solid; }
  const tree::Categories& categories() const { return end_.placed().categories; }
  /// In the world's unit. A margin that is less at the start or at the end counts as the larger.
  double margin() const { return std::max(start_.placed().margin, end_.placed().margin); }

  geometry::MovingTriangle operator[](TriangleId id) const { return {start_[id], end_[id]}; }
  /// Bounds the error of a corner at any time.
  double error() const { return std::max(start_.error(), end_.error()); }

  /// @param until  see MovingTree
  /// @pre hasStep()
  Tree tree(const std::atomic<float>& until = tree::kWholeStep) const {
    return {*start_tree_, end_tree_ ? *end_tree_ : *start_tree_, until};
  }

  FCL_FIBERS_TREE_EXPORT std::size_t memoryUsage() const;

 private:
  const geometry::Frame frame_;
  const PosedTriangles start_, end_;
  std::optional<MeshTree> start_tree_;  ///< of a step
  std::optional<MeshTree> end_tree_;    ///< if it moves
};

/// Whether a segment of a mesh's frame touches it at the end of the step, as SegmentIndex::search()
/// decides it.
/// @param margin  in the unit of the frame, in addition to the mesh's own
/// @param error   bounds that of the segment's end points, if it is larger than their coordinates
///                imply
FCL_FIBERS_TREE_EXPORT bool touches(const PosedMesh& mesh, const geometry::Segment& segment,
                                    double margin, double error);

/// The first touch of a segment and a mesh in a step.
struct MeshImpact {
  double time;
  TriangleId triangle;
};

/// Finds when a segment of a mesh's frame first touches it in a step. See touches() for margin and
/// error.
FCL_FIBERS_TREE_EXPORT bool findImpact(const PosedMesh& mesh,
                                       const geometry::MovingSegment& segment, double margin,
                                       double error, MeshImpact& impact);

}  // namespace fcl_fibers::index
