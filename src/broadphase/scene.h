// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>

#include "broadphase/manager_state.h"
#include "geometry/frame.h"

namespace fcl_fibers::broadphase {

/// A shape during a step, in a frame.
struct MovingShape {
  geometry::Obstacle end;        ///< of Kind::kNone if only the box counts
  geometry::Vec3d way{0, 0, 0};  ///< from the start to the end
  double way_error = 0;
  bool is_moved_only = true;  ///< whether it neither turns nor changes
};

/// An object of a query, in the frame of the manager that is asked.
template <typename S>
struct Partner {
  using BesideEntry = typename Obstacles<S>::BesideEntry;

  SegmentId id = ObjectRegistry<S>::kNotFound;  ///< in its manager, if it has one
  /// The box of what is neither a capsule nor a sphere. If only the end of a step counts, it rests
  /// there.
  geometry::MovingSegment segment;
  double error = 0;                          ///< of the end points
  std::shared_ptr<const BesideEntry> mesh;   ///< if its triangles count; they may be awaited
  mutable std::optional<MovingShape> shape;  ///< within the box, once a scene has read it
  /// The triangles in the frame, once a scene has asked for them; null if it has none.
  mutable std::optional<std::shared_ptr<const index::PosedMesh>> triangles;
};

/// One side of a query: the objects of a manager, as the manager that is asked sees them. That may
/// be the same one. A query about a single object has a partner and no scene. What reads objects
/// may throw RefusedObject.
template <typename S>
class Scene {
 public:
  using State = ManagerState<S>;
  using Object = fcl::CollisionObject<S>;
  using BesideEntry = typename Obstacles<S>::BesideEntry;

  /// @param asked  the manager that is asked: its frame and its report count
  /// @param moves  whether the whole step counts, not only its end
  /// @pre QueryScopes of both managers exist
  Scene(const char* call, const State& state, const State& asked, bool moves);

  const State& state() const { return state_; }
  const ObjectSource<S>& source() const { return source_; }
  /// Whether objects count by more than their boxes.
  bool countsShapes() const { return counts_shapes_; }
  /// Whether a segment in the tree may be the box of a shape that counts.
  bool hasShapesInTree() const { return has_shapes_in_tree_; }
  /// Whether a segment in the tree may be a capsule or the box of one. Pairs without capsules count
  /// by their boxes.
  bool hasCapsulesInTree() const { return has_capsules_in_tree_; }
  /// Whether an object is a mesh in the tree whose triangles count for the manager that is asked.
  bool isMeshInTree(const Object& object) const { return has_meshes_in_tree_ && isMesh(object); }
  bool hasMeshesInTree() const { return has_meshes_in_tree_; }

  /// Finds one of the objects. Returns false if it cannot be read.
  bool find(SegmentId id, Partner<S>& partner) const;
  /// One beside the tree. It borrows the entry.
  Partner<S> partnerOf(const BesideEntry& entry) const;
  /// An object of the manager, or of none, as it is now.
  Partner<S> readNow(const Object& object, SegmentId id) const;
  /// An object that a program asks about: during a step a managed one is where it was read.
  Partner<S> ofProgram(const Object& object) const;

  /// A mesh of the manager, or one that was read for this query, with its triangles. Throws
  /// std::invalid_argument if they are refused.
  const BesideEntry& withTriangles(const BesideEntry& mesh) const;

  /// What is within the box of an object of the manager. It is read when it is first asked for.
  const MovingShape& shapeOf(const Partner<S>& partner) const {
    if (!partner.shape) readShape(partner, partner.shape.emplace());
    return *partner.shape;
  }

  /// Whether an object of the manager that is asked comes as near to another one as a query asks,
  /// if their boxes do. This looks at what is within the boxes. The answer is never false if they
  /// do.
  /// @param reach   in the frame
  /// @param others  the scene of q
  bool mayTouch(const Partner<S>& p, const Partner<S>& q, const Scene& others, double reach) const;

 private:
  const geometry::Frame& frame() const { return asked_.frame(); }
  geometry::Segment inThisFrame(const geometry::Segment& segment) const {
    return change_.around(segment, geometry::FrameChange::Grows::kBoxes);
  }
  void readShape(const Partner<S>& partner, MovingShape& shape) const;
  /// The triangles of a mesh at rest; null if it has none after all.
  const index::PosedMesh* posed(const Partner<S>& mesh) const;
  bool hasSteps() const { return moves_ && state_.options().motion; }

  const char* const call_;
  const State &state_, &asked_;
  const ObjectSource<S> source_;
  const geometry::FrameChange change_;
  const bool is_own_, moves_, counts_shapes_, has_shapes_in_tree_, has_capsules_in_tree_,
      has_meshes_in_tree_;
};

extern template class Scene<float>;
extern template class Scene<double>;

}  // namespace fcl_fibers::broadphase
