// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "support/touch_oracle.h"

namespace fcl_fibers::test {

// Distances that the library's are tested against: long double, every candidate enumerated, nothing
// shared with the library. Whether capsules touch is TouchOracle's to say.

using Real = long double;
using Point = Eigen::Matrix<Real, 3, 1>;

/// All points at most `radius` away from the segment from `a` to `b`, which may be the same point.
/// Or a rounded cone: the larger one of its two balls has that radius, so this capsule is around
/// it.
struct ExactCapsule {
  Point a, b;
  Real radius;
  Real taper = 0;  ///< by how much the radius grows from a to b

  Real radiusAt(Real s) const { return radius - (taper > 0 ? 1 - s : -s) * taper; }
};

/// Closed; sides may be infinite.
struct ExactBox {
  Point min, max;
};

struct ExactSphere {
  Point center;
  Real radius;
};

/// A capsule with its end points and its taper rounded.
ExactCapsule roundedCapsule(const GivenCapsule& capsule);

Real pointSegmentDistance(const Point& p, const Point& a, const Point& b);

/// Distance of the segments [a, b] and [c, d]; never below the true one by more than rounding,
/// which is a few dozen 2^-64 x (distance of the segments + their lengths). This holds for segments
/// at any angle: where the crossing of near-parallel lines is badly conditioned, moving along the
/// lines hardly changes their distance.
Real segmentDistance(const Point& a, const Point& b, const Point& c, const Point& d);

/// Surface to surface; negative if they overlap. Of two capsules segmentDistance() less the radii.
/// Of rounded cones it has an error of some 2^-58 of the distance, lengths and radii at most.
Real surfaceDistance(const ExactCapsule& p, const ExactCapsule& q);

/// Three corners.
struct ExactTriangle {
  Point a, b, c;
};

/// Distance of the segment [a, b] and the triangle, 0 if they meet; with the same error.
Real segmentTriangleDistance(const Point& a, const Point& b, const ExactTriangle& triangle);

/// Distance of the segment [a, b] and the box, 0 if they meet.
Real segmentBoxDistance(const Point& a, const Point& b, const ExactBox& box);

/// Euclidean distance, 0 if they meet.
Real boxDistance(const ExactBox& a, const ExactBox& b);

/// The largest gap over the axes; negative if the boxes overlap, 0 if they touch.
Real boxGap(const ExactBox& a, const ExactBox& b);

/// Surface to surface; negative if they overlap.
Real sphereGap(const ExactSphere& a, const ExactSphere& b);

/// The smallest box around a capsule; of a cone that of the capsule around it.
ExactBox boxOf(const ExactCapsule& capsule);

/// The segment's sphere: around the middle, half the length and the radius.
ExactSphere sphereOf(const ExactCapsule& capsule);

}  // namespace fcl_fibers::test
