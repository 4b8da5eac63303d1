// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include "broadphase/manager_state.h"
#include "broadphase/obstacle_shapes.h"
#include "geometry/touch.h"

namespace fcl_fibers::broadphase {

/// Lengths this large are as good as infinite; sums with them do not overflow.
inline bool isReach(double reach) { return reach < 0x1p500; }

/// Takes the segments of one manager into the frame of another. Boxes grow by the rounding; if they
/// overflow, they become open to all sides.
class FrameOfOther {
 public:
  FrameOfOther(const geometry::Frame& from, const geometry::Frame& to) : change_(from, to) {}

  geometry::Segment operator()(const geometry::Segment& segment) const {
    const geometry::Segment moved = change_(segment);
    if (!segment.isBox()) return moved;
    if (!isBounded(segment)) return moved;  // an open side stays open
    constexpr geometry::Vec3d kFar{kInfinity, kInfinity, kInfinity};
    if (!isBounded(moved)) return geometry::Segment::box(-1.0 * kFar, kFar);
    const double error = change_.error(moved);
    const geometry::Vec3d outward{error, error, error};
    return geometry::Segment::box(moved.a - outward, moved.b + outward);
  }
  double error(const geometry::Segment& moved) const { return change_.error(moved); }
  double scale() const { return change_.scale(); }

 private:
  geometry::FrameChange change_;
};

/// Whether capsules come as near to shapes and meshes as a query asks. A shape is in the tree as a
/// box, and this looks at what is in the box. The answer is never false if they do.
/// `reach` is in the manager's frame.
template <typename S>
class ShapeReach {
 public:
  explicit ShapeReach(const ManagerState<S>& state)
      : state_(state), counts_(countsTriangles(state.options())) {}

  /// The shape of an object that was read as a segment.
  geometry::Obstacle read(const fcl::CollisionObject<S>& object,
                          const geometry::Segment& segment) const {
    geometry::Obstacle shape;
    if (counts_ && segment.isBox()) {
      readObstacle(object, state_.generations().frame(), state_.options().bounds, shape);
    }
    return shape;
  }

  /// Two segments of the manager.
  bool mayTouch(SegmentId a, SegmentId b, double reach) const {
    if (!state_.obstacles().hasShapes()) return true;
    const geometry::Segment p = state_.generations().segment(a),
                            q = state_.generations().segment(b);
    if (p.isBox() == q.isBox()) return true;
    return p.isBox() ? capsuleTouches(q, endPointError(q), state_.obstacles().shape(a), reach)
                     : capsuleTouches(p, endPointError(p), state_.obstacles().shape(b), reach);
  }

  /// A segment of the manager and one of another object, whose shape is `shape`.
  bool mayTouch(SegmentId a, const geometry::Segment& segment, double error,
                const geometry::Obstacle& shape, double reach) const {
    if (!counts_ || !(state_.obstacles().hasShapes() || segment.isBox())) return true;
    const geometry::Segment p = state_.generations().segment(a);
    if (p.isBox() == segment.isBox()) return true;
    return p.isBox() ? capsuleTouches(segment, error, state_.obstacles().shape(a), reach)
                     : capsuleTouches(p, endPointError(p), &shape, reach);
  }

  /// A mesh of the manager and a segment of another object.
  bool mayTouch(const typename Obstacles<S>::MeshEntry& mesh, const geometry::Segment& segment,
                double error, double reach) const {
    return !isReach(reach) || !mesh.counts_triangles ||
           touches(mesh.posed(), segment, state_.generations().frame(), reach, error);
  }

  static bool capsuleTouches(const geometry::Segment& capsule, double error,
                             const geometry::Obstacle* shape, double reach) {
    return shape == nullptr || !isReach(reach) || touch(capsule, *shape, reach, error);
  }

 private:
  const ManagerState<S>& state_;
  const bool counts_;
};

/// The same for pairs with another manager's objects.
template <typename S>
class ReachOfOther {
 public:
  ReachOfOther(const ManagerState<S>& state, const ManagerState<S>& other)
      : state_(state),
        other_(other),
        source_(other.source("")),
        to_other_(state.generations().frame(), other.generations().frame()),
        from_other_(other.generations().frame(), state.generations().frame()),
        other_counts_(countsTriangles(other.options())),
        matters_(
            countsTriangles(state.options()) &&
            (state.obstacles().hasShapes() || !other_counts_ || other.obstacles().hasShapes())) {}

  /// Finds a segment of the other manager in the frame of this one. Returns false if it cannot be
  /// read.
  bool find(SegmentId b, geometry::Segment& segment, double& error) const {
    if (other_.generations().keepsSegments()) {
      segment = from_other_(other_.generations().segment(b));
      error = from_other_.error(segment);
      return true;
    }
    if (!source_.readNow(b, state_.generations().frame(), segment)) return false;
    error = endPointError(segment);
    return true;
  }

  /// A segment of this manager and one of the other.
  bool mayTouch(SegmentId a, SegmentId b, double reach) const {
    if (!matters_) return true;
    const geometry::Segment p = state_.generations().segment(a);
    if (p.isBox()) {
      const geometry::Obstacle* shape = state_.obstacles().shape(a);
      geometry::Segment q;
      double error = 0;
      return shape == nullptr || !find(b, q, error) || q.isBox() ||
             ShapeReach<S>::capsuleTouches(q, error, shape, reach);
    }
    if (other_counts_) {
      const geometry::Obstacle* shape = other_.obstacles().shape(b);
      if (shape == nullptr) return true;
      const geometry::Segment moved = to_other_(p);
      constexpr double kOutward = 1 + 4 * std::numeric_limits<double>::epsilon();
      return ShapeReach<S>::capsuleTouches(moved, to_other_.error(moved), shape,
                                           reach * to_other_.scale() * kOutward);
    }
    if (other_.options().bounds == Bounds::kObjects) return true;
    geometry::Obstacle shape;
    readObstacle(*other_.registry()[b], state_.generations().frame(), other_.options().bounds,
                 shape);
    return ShapeReach<S>::capsuleTouches(p, endPointError(p), &shape, reach);
  }

 private:
  const ManagerState<S>&state_, &other_;
  const ObjectSource<S> source_;
  const FrameOfOther to_other_, from_other_;
  const bool other_counts_, matters_;
};

}  // namespace fcl_fibers::broadphase
