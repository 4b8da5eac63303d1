// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/segment.h"
#include "geometry/segment_distance.h"

namespace fcl_fibers::geometry {

/// The direction along which q is taken off p if their axes intersect. It is across both axes, or
/// of cones, across the lines along which their surfaces face each other: it leans towards the
/// thinner end of each so that all of the axis is as far from the surface.
Vec3d wayApart(const Segment& p, const Segment& q, const ClosestPoints& closest);

}  // namespace fcl_fibers::geometry
