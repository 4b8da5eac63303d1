// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/way_apart.h"

#include <algorithm>
#include <cmath>

#include "geometry/directions.h"

namespace fcl_fibers::geometry {
namespace {

/// By how much all of q lies beyond all of p along a unit vector.
double gapAlong(const Vec3d& n, const Segment& p, const Segment& q) {
  const double p_end =
      std::max(dot(n, p.a - q.a) + p.radiusAtA(), dot(n, p.b - q.a) + p.radiusAtB());
  return std::min(-q.radiusAtA(), dot(n, q.b - q.a) - q.radiusAtB()) - p_end;
}

}  // namespace

Vec3d wayApart(const Segment& p, const Segment& q, const ClosestPoints& closest) {
  const Vec3d u = p.b - p.a, v = q.b - q.a;
  const Vec3d across = perpendicularTo(u, v, closest.apart);
  if (!p.isTapered() && !q.isTapered()) return across;
  const auto lean = [](const Vec3d& along, double slope) {
    const double squared = squaredNorm(along);
    return squared > 0 ? (slope / squared) * along : Vec3d{0, 0, 0};
  };
  const Vec3d by_p = lean(u, -p.taper), by_q = lean(v, q.taper);
  const double share = squaredNorm(u) > 0 ? dot(u, v) / squaredNorm(u) : 0;
  const Vec3d by_both = by_p + lean(v - share * u, q.taper - dot(by_p, v));
  Vec3d best = across;
  double most = gapAlong(across, p, q);
  for (const Vec3d& leaning : {by_p, by_q, by_both}) {
    const double rest = 1 - squaredNorm(leaning);
    if (!(rest > 0)) continue;
    const Vec3d n = leaning + std::sqrt(rest) * across;
    const double gap = gapAlong(n, p, q);
    if (gap <= most) continue;
    best = n;
    most = gap;
  }
  return best;
}

}  // namespace fcl_fibers::geometry
