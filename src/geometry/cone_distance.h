// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/obstacle.h"
#include "geometry/polytope_distance.h"
#include "geometry/segment.h"
#include "geometry/segment_distance.h"
#include "geometry/triangle_distance.h"

namespace fcl_fibers::geometry {

// A rounded cone and a convex shape: a capsule or cone, a triangle, or an Obstacle that is a box or
// a polytope. A cone is a row of balls, and how far a ball is from such a shape is a convex
// function of its arc parameter. So one search along the cone serves for all shapes: it needs no
// more of one than what of it is nearest to a point.

/// Whether a cone and a shape are at most `margin` apart. The answer is never false if they are. It
/// is wrongly true only if they are further apart by at most a few ulp of the coordinates and radii
/// and by `error`, or if these are not finite. Of a polytope that is thin it may be wrongly true up
/// to 2^-40 of the size.
/// @param other  a Segment, Triangle or Obstacle
/// @param error  bounds the error of all points together
template <class Other>
bool coneWithin(const Segment& cone, const Other& other, double margin, double error);

/// The center of the ball that is nearest to a shape, and what of the shape is nearest to it. If
/// the axis reaches into a box, another ball may be deeper in it. What is not finite is nowhere
/// near.
///
/// Let m be the sum of the way between both, their lengths and the radii. The distance of the two
/// exceeds that of cone and shape by at most 32 eps m. Along `apart` all of the shape lies beyond
/// all of the cone by that distance, with an error of at most 64 eps m (1 + m / |apart|).
///@{
ClosestPoints closestOfCone(const Segment& cone, const Segment& other);
ClosestOnTriangle closestOfCone(const Segment& cone, const Triangle& triangle);
ClosestOnBox closestOfCone(const Segment& cone, const Obstacle& box);
///@}

/// See leastDistance().
double leastDistanceOfCone(const Segment& cone, const Triangle& triangle);

/// As nearestToPolytope(), of a box as well.
/// @pre scaleOfPair() is 1
NearestToPolytope nearestOfCone(const Segment& cone, const Obstacle& obstacle);

}  // namespace fcl_fibers::geometry
