// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/segment.h"
#include "geometry/triangle.h"
#include "geometry/triangle_distance.h"

namespace fcl_fibers::geometry {

/// Where a capsule and a triangle touch or, if they are apart, are closest; see
/// fcl_fibers::MeshContact.
struct TriangleContact {
  double s;                ///< arc parameter of the closest point of the axis
  double weight[3];        ///< of the corners at the triangle's closest point
  double distance;         ///< between the capsule's surface and the triangle; negative: the depth
  Vec3d point_a, point_b;  ///< on the capsule's surface and on the triangle
  Vec3d normal;            ///< unit vector from the capsule to the triangle
  bool crosses;            ///< whether the axis meets the triangle, within rounding
};

/// The contact of a capsule or cone and a triangle whose coordinates are relative to `origin`. If
/// the axis crosses the triangle, the normal is one of the triangle's two: the one against which
/// the capsule has to move less to get off the triangle's plane.
/// @param closest  their closest points
TriangleContact triangleContact(const Segment& capsule, const Triangle& triangle,
                                const ClosestOnTriangle& closest, const Vec3d& origin);
inline TriangleContact triangleContact(const Segment& capsule, const Triangle& triangle,
                                       const Vec3d& origin) {
  return triangleContact(capsule, triangle, closestPoints(capsule, triangle), origin);
}

/// The unit normal of a triangle, around which its corners are counterclockwise. A triangle without
/// area has `otherwise`.
Vec3d unitNormal(const Triangle& triangle, const Vec3d& otherwise);

}  // namespace fcl_fibers::geometry
