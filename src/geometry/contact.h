// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/tree_export.h>

#include "geometry/segment.h"

namespace fcl_fibers::geometry {

/// Where two capsules touch or, if they are apart, are closest; see fcl_fibers::Contact.
struct CapsuleContact {
  double s, t;             ///< arc parameters of the closest points of the axes
  double distance;         ///< between the surfaces
  Vec3d point_a, point_b;  ///< on the surfaces
  Vec3d normal;            ///< unit vector from p to q
};

/// Why a capsule is refused and what to do, or nullptr if it is valid.
FCL_FIBERS_TREE_EXPORT const char* contactProblem(const Segment& capsule);

/// The contact of two capsules whose coordinates are relative to `origin`.
/// @pre contactProblem() is nullptr for both
FCL_FIBERS_TREE_EXPORT CapsuleContact capsuleContact(const Segment& p, const Segment& q,
                                                     const Vec3d& origin);

}  // namespace fcl_fibers::geometry
