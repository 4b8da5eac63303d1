// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/segment.h"

namespace fcl_fibers::geometry {

/// Whether the axes of two capsules come as close as `reach`: never false when they do, and true
/// without need only where the distance exceeds `reach` by a few ulp of the coordinates, or these
/// are not finite.
bool axesWithin(const Segment& p, const Segment& q, double reach);

/// Two points at which the axes of two capsules are closest. Where many are, as of parallel axes,
/// one such pair.
struct ClosestPoints {
  double s, t;  ///< p.a + s (p.b - p.a) and q.a + t (q.b - q.a); 0 to 1, and 0 where a = b
  Vec3d apart;  ///< from the point of p to that of q
};

/// With m the distance of the axes and their lengths together, the points' distance exceeds that of
/// the axes by 16 eps m at most, at any angle; and along `apart` all of q lies beyond all of p by
/// that distance, right to 64 eps m (1 + m / distance).
ClosestPoints closestPoints(const Segment& p, const Segment& q);

}  // namespace fcl_fibers::geometry
