// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "geometry/segment.h"
#include "geometry/triangle.h"

namespace fcl_fibers::geometry {

/// Whether the axis of a capsule and a triangle are at most `reach` apart. The answer is never
/// false if they are. It is wrongly true only if the distance exceeds `reach` by at most a few ulp
/// of the coordinates, or if these are not finite.
bool axisWithin(const Segment& capsule, const Triangle& triangle, double reach);

/// How far apart the axis of a capsule and a triangle may be that touch.
double reachOf(const Segment& capsule, const Triangle& triangle, double margin, double error);

/// Whether a capsule or cone and a triangle are at most `margin` apart. It errs on the side of
/// touching, by at most `error` and a few ulp. `error` bounds the error of all five points
/// together.
/// @pre the segment is not a box; if it is tapered, the margin is not negative
bool touch(const Segment& capsule, const Triangle& triangle, double margin, double error);

/// A lower bound of how far apart the axis of a capsule and a triangle are: less than that by at
/// most 1e-8 of it and a few ulp of the coordinates; 0 if these are not finite. The axis of a cone
/// counts as being as far away as that of the capsule around it would be if the capsule were as
/// near to the triangle as the cone. If the axis of a cone meets the triangle, it may be 0.
double leastDistance(const Segment& capsule, const Triangle& triangle);

/// Two closest points of the axis of a capsule and a triangle. Of a cone it is the center of the
/// ball that is nearest to the triangle.
struct ClosestOnTriangle {
  double s;          ///< capsule.a + s (capsule.b - capsule.a); 0 to 1, and 0 where a = b
  double weight[3];  ///< of the corners a, b, c; not negative, with sum 1
  Vec3d apart;       ///< from the point of the axis to the point of the triangle
};
ClosestOnTriangle closestPoints(const Segment& capsule, const Triangle& triangle);

/// The same of several pairs at a time.
/// @param count  1 to kClosestAtOnce
constexpr std::size_t kClosestAtOnce = 8;
void closestPoints(const Segment* capsules, const Triangle* triangles, std::size_t count,
                   ClosestOnTriangle* closest);

}  // namespace fcl_fibers::geometry
