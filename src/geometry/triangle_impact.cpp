// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/triangle_impact.h"

#include "geometry/advancement.h"
#include "geometry/triangle_distance.h"

namespace fcl_fibers::geometry {
namespace {

Instant<3> instant(const Segment& capsule, const Triangle& t, double reach) {
  return {{capsule.a, capsule.b}, {t.a, t.b, t.c}, capsule.radius, reach};
}

bool find(const MovingSegment& capsule, const MovingTriangle& triangle, double margin, double error,
          double from, bool only_nearer, TriangleImpact& impact) {
  Arrival<3> arrival;
  const bool found =
      findArrival(instant(capsule.start, triangle.start, reachOf(capsule.start, margin, error)),
                  instant(capsule.end, triangle.end, reachOf(capsule.end, margin, error)), from,
                  only_nearer, arrival);
  const auto& [a, b, c] = arrival.weight;
  if (found) impact = {arrival.time, arrival.s, {a, b, c}};
  return found;
}

}  // namespace

bool findImpact(const MovingSegment& capsule, const MovingTriangle& triangle, double margin,
                double error, double from, TriangleImpact& impact) {
  return find(capsule, triangle, margin, error, from, /*only_nearer=*/false, impact);
}

bool findApproach(const MovingSegment& capsule, const MovingTriangle& triangle, double margin,
                  double error, double from, TriangleImpact& impact) {
  return find(capsule, triangle, margin, error, from, /*only_nearer=*/true, impact);
}

double impactTolerance(const MovingSegment& capsule, const MovingTriangle& triangle) {
  return toleranceFor(
      sizeOf(instant(capsule.start, triangle.start, 0), instant(capsule.end, triangle.end, 0)));
}

}  // namespace fcl_fibers::geometry
