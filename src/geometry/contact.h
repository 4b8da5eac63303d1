// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/segment.h"

namespace fcl_fibers::geometry {

/// Where two capsules touch, or would touch first; fcl_fibers::Contact says more.
struct CapsuleContact {
  double s, t;             ///< arc parameters of the axis points
  double distance;         ///< from surface to surface
  Vec3d point_a, point_b;  ///< on the surfaces
  Vec3d normal;            ///< of length one, from p to q
};

/// Why a capsule is refused and what to do, or nullptr.
const char* contactProblem(const Segment& capsule);

/// The contact of two capsules whose coordinates are relative to `origin`.
/// @pre contactProblem() has nothing against them
CapsuleContact capsuleContact(const Segment& p, const Segment& q, const Vec3d& origin);

}  // namespace fcl_fibers::geometry
