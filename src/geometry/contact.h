// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/contact.h>

#include "geometry/segment.h"

namespace fcl_fibers::geometry {

/// Why a capsule is refused and what to do, or nullptr.
const char* contactProblem(const Segment& capsule);

/// The contact of two capsules whose coordinates are relative to `origin`.
/// @pre contactProblem() has nothing against them
Contact capsuleContact(const Segment& p, const Segment& q, const Vec3d& origin);

}  // namespace fcl_fibers::geometry
