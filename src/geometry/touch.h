// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/segment.h"

namespace fcl_fibers::geometry {

// These decide about pairs of segments in double. They err on the side of touching, by at most
// `error` and a few ulp. `error` bounds the error of all four end points together, see
// endPointError(). A box may be unbounded on any side.

/// Whether two capsules are at most `margin` apart. If one of the two is a box, the boxes of both
/// count, on every axis.
bool touch(const Segment& p, const Segment& q, double margin, double error);

/// Whether the boxes of two segments are at most `margin` apart on every axis.
bool boxesTouch(const Segment& p, const Segment& q, double margin);

/// A lower bound of the distance between the boxes of two segments.
double boxDistanceLowerBound(const Segment& p, const Segment& q);

}  // namespace fcl_fibers::geometry
