// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/fiber_polylines.h>

#include "scenes/cap.h"

namespace fcl_fibers::scenes {

/// Fibers at the start and at the end of a step. Both have the same fibers, points and radii.
struct Step {
  FiberPolylines start, end;
};

/// The scene `cap` in the wind, from parameters.frame on. At the end of the step every point is
/// also one radius away from its place, in a random direction, so that no fiber moves exactly as
/// its neighbours do. The step takes so many frames that meanMotion() is `radii` of the fibers, to
/// 1 %: 5,000 x 50 move by 50 radii in a frame. A few fibers near the top move by thousands.
///
/// Throws as makeCap() does, and std::invalid_argument if radii is not in (1, 1000].
Step makeCapStep(const CapParameters& parameters, double radii);

/// The mean distance of a point at the start from its place at the end.
double meanMotion(const Step& step);

}  // namespace fcl_fibers::scenes
