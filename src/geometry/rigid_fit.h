// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "geometry/affine_map.h"

namespace fcl_fibers::geometry {

/// A point before and after a motion.
struct MovedPoint {
  Vec3d before, after;
};

/// Returns a rotation and a shift that take the points about to where they are after the motion, by
/// least squares. Its columns are orthonormal up to a few eps, also for points on a line, in one
/// place, or at infinity.
AffineMap rigidFit(const std::vector<MovedPoint>& points);

}  // namespace fcl_fibers::geometry
