// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "geometry/segment.h"

namespace fcl_fibers::test {

/// The least value of a convex function over [0, 1], by golden sections.
template <class F>
long double leastOfConvex(F&& f) {
  constexpr long double kSection = 0.618033988749894848204586834365638L;
  long double low = 0, high = 1, p = 1 - kSection, q = kSection;
  long double at_p = f(p), at_q = f(q);
  // Which leaves 2^-62 of the interval.
  for (int i = 0; i < 90; ++i) {
    if (at_p <= at_q) {
      high = q, q = p, at_q = at_p;
      p = high - kSection * (high - low), at_p = f(p);
    } else {
      low = p, p = q, at_p = at_q;
      q = low + kSection * (high - low), at_q = f(q);
    }
  }
  return std::fmin(std::fmin(at_p, at_q), std::fmin(f(0.0L), f(1.0L)));
}

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

}  // namespace fcl_fibers::test
