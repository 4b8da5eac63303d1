// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/segment.h"

namespace fcl_fibers::geometry {

/// Whether the axes of two capsules are at most `reach` apart. The answer is never false if they
/// are. It is wrongly true only if the distance exceeds `reach` by at most a few ulp of the
/// coordinates, or if these are not finite.
bool axesWithin(const Segment& p, const Segment& q, double reach);

/// Two closest points of the axes of two capsules or, of rounded cones, the centers of their
/// closest balls. If many are closest, as for parallel axes, this is one such pair.
struct ClosestPoints {
  double s, t;  ///< p.a + s (p.b - p.a) and q.a + t (q.b - q.a); 0 to 1, and 0 where a = b
  Vec3d apart;  ///< from the point of p to the point of q
};

/// Let m be the distance of the axes plus their lengths. The distance of the points exceeds the
/// distance of the axes by at most 16 eps m, at any angle. Along `apart` all of q lies beyond all
/// of p by that distance, with an error of at most 64 eps m (1 + m / distance). Of cones, m has the
/// radii in it, and the distance is less the radii.
ClosestPoints closestPoints(const Segment& p, const Segment& q);

}  // namespace fcl_fibers::geometry
