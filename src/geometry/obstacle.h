// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>

#include <fcl_fibers/tree_export.h>

#include "geometry/box.h"
#include "geometry/frame.h"
#include "geometry/moving_segment.h"
#include "geometry/segment.h"

namespace fcl_fibers::geometry {

class PolytopeVertices;

/// A shape in the frame of an index, together with all points within `margin` of it.
struct Obstacle {
  enum class Kind : std::uint8_t {
    kNone,       ///< nothing is known; any capsule counts as touching
    kBox,        ///< point + the sum of t_i vector[i], each t_i from -1 to 1
    kHalfspace,  ///< all x with vector[0] . (x - point) <= offset
    kPlane,      ///< all x with vector[0] . (x - point) = offset
    kTriangle,   ///< with the corners vector[i]; see Triangle
    kAxis,       ///< point + t vector[0], with t from -1 to 1; that of a capsule or a sphere
    kPolytope,   ///< the hull of all point + x vector[0] + y vector[1] + z vector[2] of `vertices`
  };

  Kind kind = Kind::kNone;
  Vec3d point{0, 0, 0};
  /// Half the edges of a box, of any length and at any angle, so that a rotation may have drifted.
  /// The columns of a polytope's pose, too.
  /// The normal of a half-space or plane is a unit vector up to 16 eps.
  Vec3d vector[3] = {};
  double offset = 0;
  double margin = 0;
  double error = 0;  ///< bounds how far rounding has moved any point of a bounded shape, and
                     ///< `point` and `offset` together
  /// Of a polytope. Obstacles share them.
  std::shared_ptr<const PolytopeVertices> vertices = nullptr;

  /// @pre kind is kAxis
  Segment capsule() const { return {point - vector[0], point + vector[0], margin}; }
};

/// Two polytopes are equal only if they share their vertices.
inline bool operator==(const Obstacle& p, const Obstacle& q) {
  return p.kind == q.kind && p.point == q.point && p.vector[0] == q.vector[0] &&
         p.vector[1] == q.vector[1] && p.vector[2] == q.vector[2] && p.offset == q.offset &&
         p.margin == q.margin && p.vertices == q.vertices;
}

/// An obstacle whose point and vectors are scaled, and nothing else.
Obstacle scaled(const Obstacle& obstacle, double scale);

/// How far the points of a box, axis or polytope are from its point, at most, on each axis. Of any
/// other obstacle it is the sum of its vectors.
FCL_FIBERS_TREE_EXPORT Vec3d reachOfVectors(const Obstacle& obstacle);

inline bool isFinite(const Obstacle& obstacle) {
  const double sum = obstacle.offset + obstacle.margin + obstacle.error + maxNorm(obstacle.point);
  return std::isfinite(sum + norm1(reachOfVectors(obstacle)));
}

/// The capsule that an obstacle is, or the box around it, which has no bounds if that is no box.
inline Segment aroundOf(const Obstacle& obstacle) {
  if (obstacle.kind == Obstacle::Kind::kAxis) return obstacle.capsule();
  const bool is_known =
      obstacle.kind == Obstacle::Kind::kBox || obstacle.kind == Obstacle::Kind::kPolytope;
  if (!is_known) return Segment::everywhere();
  const double r = obstacle.margin + obstacle.error;
  const Vec3d reach = reachOfVectors(obstacle) + Vec3d{r, r, r};
  return Segment::box(obstacle.point - reach, obstacle.point + reach);
}

/// An obstacle in another frame. Of one that overflows nothing is known.
FCL_FIBERS_TREE_EXPORT Obstacle inFrame(const FrameChange& change, const Obstacle& obstacle);

/// Whether a capsule or rounded cone and an obstacle are at most `margin` apart. The answer is
/// never false if they are. It is wrongly true only if they are further apart by at most a few ulp
/// of the coordinates and radii and by the errors, or if these are not finite.
/// @param error  bounds the error of both end points of the capsule
/// @pre the segment is not a box
bool touch(const Segment& capsule, const Obstacle& obstacle, double margin, double error);

/// The same for a capsule that moves while the obstacle rests. The answer may also be wrongly true
/// if they come nearer than `margin` and the tolerance of findImpact().
FCL_FIBERS_TREE_EXPORT bool touch(const MovingSegment& capsule, const Obstacle& obstacle,
                                  double margin, double error);

/// Two closest points of the axis of a capsule and a box. If many are closest, as for an axis along
/// a face, this is one such pair. Of a rounded cone it is the center of the closest ball and the
/// point of the box that is closest to it. Its axis may reach deeper into the box elsewhere.
struct ClosestOnBox {
  double s;     ///< capsule.a + s (capsule.b - capsule.a); 0 to 1, and 0 where a = b
  double t[3];  ///< box.point + the sum of t[i] box.vector[i]; each from -1 to 1
  Vec3d apart;  ///< from the point of the axis to the point of the box
};

/// @pre the obstacle is a box, and the sum of all lengths is finite
ClosestOnBox closestPoints(const Segment& capsule, const Obstacle& box);

/// Whether an obstacle may be at most `margin` from some point of a box at some time of a step. It
/// is false only for a plane or half-space. `box` contains the step of what is in it.
/// @param way    of the obstacle from the start to the end, where it is
/// @param error  bounds the error of `way`
FCL_FIBERS_TREE_EXPORT bool mayReach(const Box& box, const Obstacle& obstacle, const Vec3d& way,
                                     double margin, double error);

}  // namespace fcl_fibers::geometry
