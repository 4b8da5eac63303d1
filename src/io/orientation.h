// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

namespace fcl_fibers::io {

using PlanePoint = std::array<double, 2>;

/// Returns the sign of a polygon's signed area, without error for any finite coordinates: 1 if it
/// runs counterclockwise, -1 if clockwise, 0 if the parts of its area cancel.
int areaSign(const std::vector<PlanePoint>& polygon);

/// The same of a triangle: 1 if c is left of the line from a to b, -1 if right of it, 0 if on it.
/// @param tolerance  triangles of at most this height above their longest edge count as lines
int orientation(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c,
                double tolerance = 0);

}  // namespace fcl_fibers::io
