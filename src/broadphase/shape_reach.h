// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <limits>

#include "broadphase/frame_of_other.h"
#include "broadphase/manager_state.h"
#include "geometry/touch.h"
#include "simd/always_inline.h"

namespace fcl_fibers::broadphase {

/// Lengths this large are as good as infinite; sums with them do not overflow.
inline bool isReach(double reach) { return reach < 0x1p500; }

/// A shape during a step, in a frame.
struct MovingShape {
  geometry::Obstacle end;        ///< of Kind::kNone if only the box counts
  geometry::Vec3d way{0, 0, 0};  ///< from the start to the end
  double way_error = 0;
  bool is_moved_only = true;  ///< whether it neither turns nor changes

  /// @param start, end  in the world's frame
  /// @param shape       the end in `frame`
  static MovingShape between(const geometry::Obstacle& start, const geometry::Obstacle& end,
                             const geometry::Obstacle& shape, const geometry::Frame& frame) {
    return {shape, frame.scale * (end.point - start.point), frame.scale * (start.error + end.error),
            isMovedOnly(start, end)};
  }

 private:
  static bool isMovedOnly(const geometry::Obstacle& p, const geometry::Obstacle& q) {
    return p.kind == q.kind && p.vector[0] == q.vector[0] && p.vector[1] == q.vector[1] &&
           p.vector[2] == q.vector[2] && p.offset == q.offset && p.margin == q.margin;
  }
};

/// Whether objects come as near to each other as a query asks, of which at least one is in the tree
/// as a box. This looks at what is in the box. The answer is never false if they do. `reach` is in
/// the manager's frame.
template <typename S>
class ShapeReach {
 public:
  using MovingSegment = geometry::MovingSegment;
  using BesideEntry = typename Obstacles<S>::BesideEntry;

  /// @param moves  whether the whole step counts, not only its end
  ShapeReach(const ManagerState<S>& state, bool moves)
      : state_(state),
        moves_(moves),
        counts_(countsTriangles(state.options())),
        has_boxes_(counts_ && state.generations().hasBoxes()) {}

  /// Whether a segment of the manager may be the box of a shape that counts.
  bool hasBoxes() const { return has_boxes_; }

  /// The shape of an object that was read as a segment, as it is now.
  MovingShape read(const fcl::CollisionObject<S>& object, const geometry::Segment& segment) const {
    MovingShape shape;
    if (counts_ && segment.isBox()) shape.end = obstacleOf(readObject(object, bounds()), frame());
    return shape;
  }

  /// A segment of the manager.
  MovingSegment segment(SegmentId id) const {
    const MovingSegment moving = state_.generations().moving(id);
    return moves_ ? moving : MovingSegment{moving.end, moving.end};
  }
  /// The shape of an object of the manager, whose segment is `box` at the end.
  MovingShape shape(SegmentId id, const geometry::Segment& box) const {
    return shapeIn(frame(), FrameOfOther(frame(), frame()), id, box);
  }
  /// In another manager's frame.
  /// @param change  from the frame of this manager
  MovingShape shapeIn(const geometry::Frame& other, const FrameOfOther& change, SegmentId id,
                      const geometry::Segment& box) const {
    if (!counts_) return {};
    if (const auto* entry = state_.obstacles().shape(id)) {
      const geometry::Obstacle shape = change(entry->shape);
      if (moves_ && state_.options().motion) {
        return MovingShape::between(entry->start, entry->end, shape, other);
      }
      return {shape};
    }
    // Where it was at the start is not known, nor where it was if it has moved since it was read.
    if (moves_ && state_.options().motion) return {};
    const ReadObject object = readObject(*state_.registry()[id], bounds());
    geometry::Segment now;
    // What has no mark, because it became this shape by assignment, cannot be told from another.
    if (segmentOf(object, frame(), now, /*marks_boxes=*/true) != nullptr || !(now == box) ||
        now.radius == -1) {
      return {};
    }
    return {change(obstacleOf(object, frame()))};
  }

  /// Two segments of the manager. Most scenes have no boxes, and pay for no more than that.
  FCL_FIBERS_ALWAYS_INLINE bool mayTouch(SegmentId a, SegmentId b, double reach) const {
    const Generations& segments = state_.generations();
    return !has_boxes_ || !(segments.isBox(a) || segments.isBox(b)) || mayTouchAsBoxes(a, b, reach);
  }

  /// A segment of the manager and one of another object, whose shape is `other`.
  bool mayTouch(SegmentId a, const MovingSegment& segment_b, double error, const MovingShape& other,
                double reach) const {
    if (!counts_ || !(has_boxes_ || segment_b.end.isBox())) return true;
    const MovingSegment p = segment(a);
    return mayTouch(
        p, endPointError(p), [&] { return shape(a, p.end); }, segment_b, error,
        [&] { return other; }, reach);
  }

  /// An object beside the tree and another object, of which it has the boxes overlap.
  bool mayTouch(const BesideEntry& entry, const MovingShape& shape, const MovingSegment& segment,
                double error, const MovingShape& other, double reach) const {
    if (!counts_ || !isReach(reach)) return true;
    if (!entry.is_mesh) {
      const MovingSegment box = moves_ ? entry.movingBox() : MovingSegment{entry.box, entry.box};
      return mayTouch(
          box, endPointError(box), [&] { return shape; }, segment, error, [&] { return other; },
          reach);
    }
    if (!moves_) {
      return !entry.counts_triangles || touches(entry.posed(), segment.end, frame(), reach, error);
    }
    index::MeshImpact impact;
    return !entry.countsMovingTriangles() ||
           findImpact(*state_.movingMesh(entry), segment, reach, error, impact);
  }

  /// Two segments whose boxes overlap if one is a box, and their shapes.
  template <class ShapeOfP, class ShapeOfQ>
  static bool mayTouch(const MovingSegment& p, double p_error, ShapeOfP&& shapeOfP,
                       const MovingSegment& q, double q_error, ShapeOfQ&& shapeOfQ, double reach) {
    if (!q.end.isBox()) return !p.end.isBox() || capsuleTouches(q, q_error, shapeOfP(), reach);
    if (!p.end.isBox()) return capsuleTouches(p, p_error, shapeOfQ(), reach);
    if (holdsCapsule(p.end)) return axisTouches(shapeOfP(), shapeOfQ(), reach);
    return !holdsCapsule(q.end) || axisTouches(shapeOfQ(), shapeOfP(), reach);
  }

  static bool capsuleTouches(const MovingSegment& capsule, double error, const MovingShape& shape,
                             double reach) {
    if (!isReach(reach)) return true;
    // The boxes of both overlap at some time, and that is all that counts if a shape turns.
    if (isBox(capsule) || !shape.is_moved_only) return true;
    // The capsule as seen from the shape.
    MovingSegment seen = capsule;
    seen.start.a = seen.start.a + shape.way;
    seen.start.b = seen.start.b + shape.way;
    return touch(seen, shape.end, reach, error + shape.way_error);
  }

  /// A capsule in a box and another shape.
  static bool axisTouches(const MovingShape& axis, const MovingShape& shape, double reach) {
    if (axis.end.kind != geometry::Obstacle::Kind::kAxis || !axis.is_moved_only) return true;
    MovingSegment capsule{axis.end.capsule(), axis.end.capsule()};
    capsule.start.a = capsule.start.a - axis.way;
    capsule.start.b = capsule.start.b - axis.way;
    return capsuleTouches(capsule, axis.end.error + axis.way_error, shape, reach);
  }

 private:
  [[gnu::noinline]] bool mayTouchAsBoxes(SegmentId a, SegmentId b, double reach) const {
    const MovingSegment p = segment(a), q = segment(b);
    return mayTouch(
        p, endPointError(p), [&] { return shape(a, p.end); }, q, endPointError(q),
        [&] { return shape(b, q.end); }, reach);
  }
  const geometry::Frame& frame() const { return state_.generations().frame(); }
  Bounds bounds() const { return state_.options().bounds; }

  const ManagerState<S>& state_;
  const bool moves_, counts_, has_boxes_;
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
        from_other_(other.generations().frame(), state.generations().frame()),
        other_counts_(countsTriangles(other.options())),
        matters_(countsTriangles(state.options()) &&
                 (own_reach_.hasBoxes() || !other_counts_ || its_reach_.hasBoxes())) {}

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
  /// The shape of an object of the other manager in the frame of this one. If it counts by its
  /// volume there, it is read again.
  /// @param box  its segment at the end, in the other manager's frame
  MovingShape shape(SegmentId b, const geometry::Segment& box) const {
    if (other_counts_) return its_reach_.shapeIn(state_.generations().frame(), from_other_, b, box);
    MovingShape now;
    if (countsTriangles(state_.options()) && other_.options().bounds != Bounds::kObjects) {
      now.end = obstacleOf(readObject(*other_.registry()[b], other_.options().bounds),
                           state_.generations().frame());
    }
    return now;
  }
  /// That of an object in the other manager's tree.
  MovingShape shape(SegmentId b) const {
    return shape(b, other_counts_ ? other_.generations().segment(b) : geometry::Segment());
  }

  /// A segment of this manager and one of the other.
  bool mayTouch(SegmentId a, SegmentId b, double reach) const {
    if (!matters_) return true;
    const MovingSegment p = own_reach_.segment(a);
    MovingSegment q;
    double error = 0;
    if (!find(b, q, error)) return true;
    return ShapeReach<S>::mayTouch(
        p, endPointError(p), [&] { return own_reach_.shape(a, p.end); }, q, error,
        [&] { return shape(b); }, reach);
  }

 private:
  static double errorOf(const FrameOfOther& change, const MovingSegment& moved) {
    return std::max(change.error(moved.start), change.error(moved.end));
  }

  const ManagerState<S>&state_, &other_;
  const ShapeReach<S> own_reach_, its_reach_;
  const ObjectSource<S> source_;
  const FrameOfOther from_other_;
  const bool other_counts_, matters_;
};

}  // namespace fcl_fibers::broadphase
