// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/tree_export.h>

#include "geometry/obstacle.h"
#include "geometry/segment.h"

namespace fcl_fibers::geometry {

/// Where a capsule and an obstacle touch or, if they are apart, are closest; see
/// fcl_fibers::ShapeContact. The obstacle's margin counts as part of it.
struct ObstacleContact {
  double s;                ///< arc parameter of the point of the axis; of a cone, of the ball
  double t;                ///< arc parameter of the point of an obstacle's axis, otherwise 0
  double distance;         ///< between the surfaces; negative: the depth
  Vec3d point_a, point_b;  ///< on the capsule's surface and on the obstacle's
  Vec3d normal;            ///< unit vector from the capsule to the obstacle
};

/// The contact of a capsule and an obstacle whose coordinates are relative to `origin`. A motion of
/// the capsule by the depth against the normal takes it off the obstacle.
///
/// If the axis is outside of the obstacle, the normal leads along the way between two closest
/// points. If it reaches into a box, up to 16 eps of the coordinates, the motion is the shortest
/// that takes all of the capsule out: across a face, or across an edge and the axis. It goes to the
/// side on which the middle of the axis is, and if that is at the middle of the box, to the side of
/// the vector product. If several are as short, up to 16 eps of the size, the first counts, and
/// faces come before edges, in the order of the box's vectors. A half-space is left where its
/// normal points, a plane to the side on which the middle of the axis is, or else where its normal
/// points. The points are then those that touch after the motion. Where many are, as for an axis
/// along a face, they are one pair of them; of an axis along a plane it is the middle.
///
/// The error of the distance is at most 32 eps of the sum of the radius, the margin, the axis's
/// length, the box's edges and the ways from its middle to the axis's ends, or from a plane's point
/// and its offset. So far the closest points may be from closest. The normal's error is as many eps
/// of one plus that sum over the distance of axis and box.
///
/// Of a rounded cone the ball that is closest counts, or the one that leaves the obstacle last. The
/// shortest way of the cone out of a box is across a face, or across an edge while both ends reach
/// as far. There is one more if the axis reaches into the box, but the nearest ball is beside it:
/// the way from the box to this ball, which is longer than the shortest by no more than the
/// normal's error times the sum above. Each face may be left to both sides, and a plane is left to
/// the side that takes the shorter way.
///
/// The contact with a triangle is that of triangleContact(), and that with an axis that of two
/// capsules.
///
/// @pre The obstacle is known. Neither has a coordinate, length or radius beyond 2^1000.
FCL_FIBERS_TREE_EXPORT ObstacleContact obstacleContact(const Segment& capsule,
                                                       const Obstacle& obstacle,
                                                       const Vec3d& origin);

}  // namespace fcl_fibers::geometry
