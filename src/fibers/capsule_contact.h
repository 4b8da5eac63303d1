// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/contact.h>
#include <fcl_fibers/tree_export.h>

#include "geometry/segment.h"

namespace fcl_fibers::fibers {

/// Why a capsule is refused and what to do, or nullptr if it is valid.
FCL_FIBERS_TREE_EXPORT const char* contactProblem(const geometry::Segment& capsule);

/// The contact of two capsules whose coordinates are relative to `origin`.
/// @param a, b  their places
/// @pre contactProblem() is nullptr for both
FCL_FIBERS_TREE_EXPORT Contact contactOf(const geometry::Segment& p, const geometry::Segment& q,
                                         const geometry::Vec3d& origin, FiberSegment a = {},
                                         FiberSegment b = {});

}  // namespace fcl_fibers::fibers
