// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/tree_export.h>

#include "geometry/box.h"
#include "geometry/segment.h"

namespace fcl_fibers::geometry {

// These decide about pairs of segments in double. They err on the side of touching, by at most
// `error` and a few ulp. `error` bounds the error of all four end points together, see
// endPointError(). A box may be unbounded on any side.

/// How far apart the axes of two capsules may be that touch.
double reachOf(const Segment& p, const Segment& q, double margin, double error);

/// Whether two capsules are at most `margin` apart. If one of the two is a box, the boxes of both
/// count, on every axis.
FCL_FIBERS_TREE_EXPORT bool touch(const Segment& p, const Segment& q, double margin, double error);

/// Lower bounds of the gap by which the box of p lies above that of q along an axis, and below it.
/// They are not positive if the boxes overlap there.
struct BoxGaps {
  double above, below;
};
BoxGaps boxGaps(const Segment& p, const Segment& q, double Vec3d::*axis);

/// Whether the boxes of two segments are at most `margin` apart on every axis.
bool boxesTouch(const Segment& p, const Segment& q, double margin);

/// Whether a volume and the box of a segment are at most `margin` apart on every axis. It is never
/// false because of rounding. `margin` may be negative or infinite.
FCL_FIBERS_TREE_EXPORT bool isNear(const Box& volume, const Segment& box, double margin);

}  // namespace fcl_fibers::geometry
