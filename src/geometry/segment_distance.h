// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/segment.h"

namespace fcl_fibers::geometry {

/// Whether the axes of two capsules come as close as `reach`: never false when they do, and true
/// without need only where the distance exceeds `reach` by a few ulp of the coordinates, or these
/// are not finite.
bool axesWithin(const Segment& p, const Segment& q, double reach);

}  // namespace fcl_fibers::geometry
