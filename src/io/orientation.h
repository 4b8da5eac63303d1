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
int orientation(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c);

/// The same where narrow triangles count as lines.
class Sides {
 public:
  /// @param tolerance  the height of such a triangle above its longest edge
  explicit Sides(double tolerance = 0) : tolerance_(tolerance) {}
  int operator()(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) const;

 private:
  double tolerance_;
};

}  // namespace fcl_fibers::io
