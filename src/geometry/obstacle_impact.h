// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/impact.h"
#include "geometry/obstacle.h"

namespace fcl_fibers::geometry {

/// Finds the first time at which a capsule or cone that moves and an obstacle that rests are no
/// further apart than the margin, as findImpact() of two capsules does, with impactTolerance() of
/// the capsule and the obstacle's edges. Of a plane or half-space, its distance from the capsule
/// counts. t of the impact is 0, unless the obstacle is an axis.
/// @param error        bounds the error of both end points of the capsule, at any time
/// @param only_nearer  whether they have to come nearer first if they touch at the start, as in
///                     findApproach(). A capsule comes nearer to a half-space as it sinks into it,
///                     and never to a plane that its axis crosses. It comes nearer to a box that
///                     its axis reaches into only if its radius grows.
bool findImpact(const MovingSegment& capsule, const Obstacle& obstacle, double margin, double error,
                bool only_nearer, Impact& impact);

}  // namespace fcl_fibers::geometry
