// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "geometry/segment.h"
#include "geometry/triangle.h"
#include "support/exact_geometry.h"
#include "support/least_of_convex.h"

namespace fcl_fibers::test {

/// The distance of two rounded cones by its definition, up to some 2^-60 of coordinates and radii:
/// the least over both arc parameters of the distance of the two balls.
inline long double coneDistance(const geometry::Segment& p, const geometry::Segment& q) {
  const auto at = [](const geometry::Segment& c, long double s) {
    const auto mix = [s](double from, double to) { return (1 - s) * from + s * to; };
    return std::array{mix(c.a.x, c.b.x), mix(c.a.y, c.b.y), mix(c.a.z, c.b.z),
                      mix(c.radiusAtA(), c.radiusAtB())};
  };
  return leastOfConvex([&](long double s) {
    const auto x = at(p, s);
    return leastOfConvex([&](long double t) {
      const auto y = at(q, t);
      const long double dx = x[0] - y[0], dy = x[1] - y[1], dz = x[2] - y[2];
      return std::sqrt(dx * dx + dy * dy + dz * dz) - x[3] - y[3];
    });
  });
}

/// The distance of a rounded cone and a triangle by its definition, with the same error.
inline long double coneDistance(const geometry::Segment& p, const geometry::Triangle& t) {
  const auto exact = [](const geometry::Vec3d& x) { return Point(x.x, x.y, x.z); };
  const Point a = exact(p.a), b = exact(p.b);
  const ExactTriangle triangle{exact(t.a), exact(t.b), exact(t.c)};
  return leastOfConvex([&](long double s) {
    const Point x = (1 - s) * a + s * b;
    return segmentTriangleDistance(x, x, triangle) - ((1 - s) * p.radiusAtA() + s * p.radiusAtB());
  });
}

}  // namespace fcl_fibers::test
