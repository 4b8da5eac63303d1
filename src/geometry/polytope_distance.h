// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/obstacle.h"

namespace fcl_fibers::geometry {

// The distance of a segment and a convex polytope, an Obstacle of Kind::kPolytope.

/// The sum of 1-norms by which rounding is bounded, and which is at least the distance.
double sizeOfPair(const Segment& axis, const Obstacle& polytope);

/// Whether they are at most `reach` apart. The answer is never false if they are. It is wrongly
/// true only if they are further apart by at most a few ulp of the coordinates, or if these are not
/// finite.
bool polytopeWithin(const Segment& axis, const Obstacle& polytope, double reach);

/// The power of two by which both have to be scaled so that products of their lengths neither
/// overflow nor vanish, mostly 1. It is 0 if there is none, because they are in one point or not
/// finite.
double scaleOfPair(const Segment& axis, const Obstacle& polytope);

/// Where an axis is nearest to a polytope.
struct NearestToPolytope {
  double s;            ///< axis.a + s (axis.b - axis.a)
  double distance;     ///< 0 if they meet
  Vec3d direction;     ///< unit vector from the polytope to the axis, unless they meet
  double least_along;  ///< by how much all of the axis is beyond all of the polytope along it
};
/// @param certain  by how much the distance may exceed `least_along`, as a part of the size
/// @pre scaleOfPair() is 1
NearestToPolytope nearestToPolytope(const Segment& axis, const Obstacle& polytope,
                                    double certain = 0x1p-40);

}  // namespace fcl_fibers::geometry
