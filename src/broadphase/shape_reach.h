// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <limits>

#include "broadphase/frame_of_other.h"
#include "broadphase/manager_state.h"
#include "broadphase/obstacle_shapes.h"
#include "geometry/touch.h"

namespace fcl_fibers::broadphase {

/// Lengths this large are as good as infinite; sums with them do not overflow.
inline bool isReach(double reach) { return reach < 0x1p500; }

/// A shape during a step.
struct MovingShape {
  const geometry::Obstacle* end;  ///< null if nothing is known of the shape
  geometry::Vec3d way{0, 0, 0};   ///< from the start to the end, in the frame of `end`
  double way_error = 0;
  bool is_moved_only = true;  ///< whether it neither turns nor changes

  static MovingShape resting(const geometry::Obstacle* shape) { return {shape}; }

  template <typename S>
  static MovingShape of(const Obstacles<S>& obstacles, SegmentId id, const geometry::Frame& frame) {
    const auto* entry = obstacles.shape(id);
    return entry == nullptr ? resting(nullptr)
                            : between(entry->start, entry->end, &entry->shape, frame);
  }
  /// @param start, end  in the world's frame
  /// @param shape       the end in `frame`
  static MovingShape between(const geometry::Obstacle& start, const geometry::Obstacle& end,
                             const geometry::Obstacle* shape, const geometry::Frame& frame) {
    return {shape, frame.scale * (end.point - start.point), frame.scale * (start.error + end.error),
            isMovedOnly(start, end)};
  }

 private:
  static bool isMovedOnly(const geometry::Obstacle& p, const geometry::Obstacle& q) {
    return p.kind == q.kind && p.vector[0] == q.vector[0] && p.vector[1] == q.vector[1] &&
           p.vector[2] == q.vector[2] && p.offset == q.offset && p.margin == q.margin;
  }
};

/// Whether capsules come as near to shapes and meshes as a query asks. A shape is in the tree as a
/// box, and this looks at what is in the box. The answer is never false if they do.
/// `reach` is in the manager's frame.
template <typename S>
class ShapeReach {
 public:
  using MovingSegment = geometry::MovingSegment;

  /// @param moves  whether the whole step counts, not only its end
  ShapeReach(const ManagerState<S>& state, bool moves)
      : state_(state), moves_(moves), counts_(countsTriangles(state.options())) {}

  /// The shape of an object that was read as a segment, as it is now.
  geometry::Obstacle read(const fcl::CollisionObject<S>& object,
                          const geometry::Segment& segment) const {
    geometry::Obstacle shape;
    if (counts_ && segment.isBox()) {
      readObstacle(object, state_.generations().frame(), state_.options().bounds, shape);
    }
    return shape;
  }

  /// A segment of the manager.
  MovingSegment segment(SegmentId id) const {
    const MovingSegment moving = state_.generations().moving(id);
    return moves_ ? moving : MovingSegment{moving.end, moving.end};
  }
  MovingShape shape(SegmentId id) const {
    const MovingShape moving =
        MovingShape::of(state_.obstacles(), id, state_.generations().frame());
    return moves_ ? moving : MovingShape::resting(moving.end);
  }

  /// Two segments of the manager.
  bool mayTouch(SegmentId a, SegmentId b, double reach) const {
    if (!state_.obstacles().hasShapes()) return true;
    const MovingSegment p = segment(a), q = segment(b);
    if (p.end.isBox() == q.end.isBox()) return true;
    return p.end.isBox() ? capsuleTouches(q, endPointError(q), shape(a), reach)
                         : capsuleTouches(p, endPointError(p), shape(b), reach);
  }

  /// A segment of the manager and one of another object, whose shape is `other`.
  bool mayTouch(SegmentId a, const MovingSegment& segment_b, double error, const MovingShape& other,
                double reach) const {
    if (!counts_ || !(state_.obstacles().hasShapes() || segment_b.end.isBox())) return true;
    const MovingSegment p = segment(a);
    if (p.end.isBox() == segment_b.end.isBox()) return true;
    return p.end.isBox() ? capsuleTouches(segment_b, error, shape(a), reach)
                         : capsuleTouches(p, endPointError(p), other, reach);
  }

  /// A mesh of the manager and a segment of another object.
  bool mayTouch(const typename Obstacles<S>::MeshEntry& mesh, const MovingSegment& segment,
                double error, double reach) const {
    const geometry::Frame& frame = state_.generations().frame();
    if (!isReach(reach)) return true;
    if (!moves_) {
      return !mesh.counts_triangles || touches(mesh.posed(), segment.end, frame, reach, error);
    }
    index::MeshImpact impact;
    return !mesh.countsMovingTriangles() ||
           findImpact(*state_.movingMesh(mesh), segment, reach, error, impact);
  }

  static bool capsuleTouches(const MovingSegment& capsule, double error, const MovingShape& shape,
                             double reach) {
    if (shape.end == nullptr || !isReach(reach)) return true;
    // The boxes of both overlap at some time, and that is all that counts if a shape turns.
    if (isBox(capsule) || !shape.is_moved_only) return true;
    // The capsule as seen from the shape.
    MovingSegment seen = capsule;
    seen.start.a = seen.start.a + shape.way;
    seen.start.b = seen.start.b + shape.way;
    return touch(seen, *shape.end, reach, error + shape.way_error);
  }

 private:
  const ManagerState<S>& state_;
  const bool moves_, counts_;
};

/// The same for pairs with another manager's objects.
template <typename S>
class ReachOfOther {
 public:
  using MovingSegment = geometry::MovingSegment;

  /// @param moves  as in ShapeReach
  ReachOfOther(const ManagerState<S>& state, const ManagerState<S>& other, bool moves)
      : state_(state),
        other_(other),
        own_reach_(state, moves),
        its_reach_(other, moves),
        source_(other.source("")),
        to_other_(state.generations().frame(), other.generations().frame()),
        from_other_(other.generations().frame(), state.generations().frame()),
        other_counts_(countsTriangles(other.options())),
        matters_(
            countsTriangles(state.options()) &&
            (state.obstacles().hasShapes() || !other_counts_ || other.obstacles().hasShapes())) {}

  /// Finds a segment of the other manager in the frame of this one. Returns false if it cannot be
  /// read.
  bool find(SegmentId b, MovingSegment& segment, double& error) const {
    if (other_.generations().keepsSegments()) {
      const MovingSegment its = its_reach_.segment(b);
      segment = {from_other_(its.start), from_other_(its.end)};
      error = errorOf(from_other_, segment);
      return true;
    }
    if (!source_.readNow(b, state_.generations().frame(), segment.end)) return false;
    segment.start = segment.end;
    error = endPointError(segment);
    return true;
  }

  /// A segment of this manager and one of the other.
  bool mayTouch(SegmentId a, SegmentId b, double reach) const {
    if (!matters_) return true;
    const MovingSegment p = own_reach_.segment(a);
    if (p.end.isBox()) {
      const MovingShape shape = own_reach_.shape(a);
      MovingSegment q;
      double error = 0;
      return shape.end == nullptr || !find(b, q, error) || q.end.isBox() ||
             ShapeReach<S>::capsuleTouches(q, error, shape, reach);
    }
    if (other_counts_) {
      const MovingShape shape = its_reach_.shape(b);
      if (shape.end == nullptr) return true;
      const MovingSegment moved{to_other_(p.start), to_other_(p.end)};
      constexpr double kOutward = 1 + 4 * std::numeric_limits<double>::epsilon();
      return ShapeReach<S>::capsuleTouches(moved, errorOf(to_other_, moved), shape,
                                           reach * to_other_.scale() * kOutward);
    }
    if (other_.options().bounds == Bounds::kObjects) return true;
    geometry::Obstacle shape;
    readObstacle(*other_.registry()[b], state_.generations().frame(), other_.options().bounds,
                 shape);
    return ShapeReach<S>::capsuleTouches(p, endPointError(p), MovingShape::resting(&shape), reach);
  }

 private:
  static double errorOf(const FrameOfOther& change, const MovingSegment& moved) {
    return std::max(change.error(moved.start), change.error(moved.end));
  }

  const ManagerState<S>&state_, &other_;
  const ShapeReach<S> own_reach_, its_reach_;
  const ObjectSource<S> source_;
  const FrameOfOther to_other_, from_other_;
  const bool other_counts_, matters_;
};

}  // namespace fcl_fibers::broadphase
