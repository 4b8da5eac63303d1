// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/segment.h"

namespace fcl_fibers::geometry {

// Decisions about pairs of segments in double. All err on the side of touching, by no more than
// `error` and a few ulp; `error` is how far the four end points together may lie from where they
// should, see endPointError(). A box may be unbounded on any side.

/// Whether two capsules are at most `margin` apart; where one of the two is a box, whether their
/// boxes are, on every axis.
bool touch(const Segment& p, const Segment& q, double margin, double error);

/// Whether the boxes of two segments are at most `margin` apart on every axis.
bool boxesTouch(const Segment& p, const Segment& q, double margin);

/// A lower bound of the distance between the boxes of two segments.
double boxDistanceLowerBound(const Segment& p, const Segment& q);

}  // namespace fcl_fibers::geometry
