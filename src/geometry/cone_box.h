// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/obstacle.h"
#include "geometry/segment.h"

namespace fcl_fibers::geometry {

// A rounded cone and a box, an Obstacle of Kind::kBox. The ball that is nearest to the box is in it
// or touches it, or it is one at an end of the cone, or the one that is nearest to an edge. For
// where a face is nearest the distance changes evenly along the axis.

/// See touch(). The obstacle's margin and error count.
bool coneTouchesBox(const Segment& cone, const Obstacle& box, double margin, double error);

/// The center of the ball that is nearest to a box and the point of the box nearest to it. If the
/// axis reaches into the box, another ball may be deeper in it.
ClosestOnBox closestOfCone(const Segment& cone, const Obstacle& box);

}  // namespace fcl_fibers::geometry
