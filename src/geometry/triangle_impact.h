// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/moving_segment.h"
#include "geometry/triangle.h"

namespace fcl_fibers::geometry {

/// A triangle during a step, whose corners move linearly.
struct MovingTriangle {
  Triangle start, end;
};

/// The triangle at a time.
inline Triangle at(const MovingTriangle& t, double time) {
  return {between(t.start.a, t.end.a, time), between(t.start.b, t.end.b, time),
          between(t.start.c, t.end.c, time)};
}

/// The first time in a step at which a moving capsule and a moving triangle touch, and their
/// closest points at that time.
struct TriangleImpact {
  double time;
  double s;          ///< on the capsule's axis
  double weight[3];  ///< of the corners; not negative, with sum 1
};

/// As findImpact() of two capsules. A capsule touches a triangle that its axis passes through.
/// @param error  bounds the error of all five points together, at any time
/// @pre the segment is not a box
bool findImpact(const MovingSegment& capsule, const MovingTriangle& triangle, double margin,
                double error, double from, TriangleImpact& impact);
bool findApproach(const MovingSegment& capsule, const MovingTriangle& triangle, double margin,
                  double error, double from, TriangleImpact& impact);
double impactTolerance(const MovingSegment& capsule, const MovingTriangle& triangle);

}  // namespace fcl_fibers::geometry
