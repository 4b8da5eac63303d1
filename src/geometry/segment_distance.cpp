// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/segment_distance.h"

#include <algorithm>

#include "geometry/cone_distance.h"
#include "geometry/double_double.h"
#include "geometry/squared_distance.h"

namespace fcl_fibers::geometry {
namespace {

/// The sum of the 1-norms of w, u and v, by which rounding is bounded.
double sizeOf(const Segment& p, const Segment& q) {
  return norm1(p.a - q.a) + norm1(p.b - p.a) + norm1(q.b - q.a);
}

/// Bounds the rounding of `squared - gap` in double for a pair of size m. The vector r carries an
/// error of 3 eps m, its square 9 eps m^2, and each slope 13 eps m^2.
double roundingFor(double m) { return 64 * std::numeric_limits<double>::epsilon() * m * m; }

/// Whether products of four lengths of this size neither overflow nor vanish.
bool isWellScaled(double m) { return m > 0x1p-200 && m < 0x1p200; }

double scaleFor(const Segment& p, const Segment& q, double m) {
  return scaleForSize(m, std::max({maxNorm(p.a), maxNorm(p.b), maxNorm(q.a), maxNorm(q.b)}));
}

/// Whether all of p lies more than `reach` beyond all of q along the line through their midpoints,
/// which takes no division and settles most pairs that are apart.
bool isApartAlongMidpoints(const Segment& p, const Segment& q, double rounding, double reach) {
  const Vec3d twice = (p.a - q.a) + (p.b - q.b);
  const double squared = squaredNorm(twice);
  const double apart =
      squared - std::fabs(dot(p.b - p.a, twice)) - std::fabs(dot(q.b - q.a, twice)) - 4 * rounding;
  return apart > 0 && apart * apart > 4 * reach * reach * squared * (1 + 0x1p-40);
}

bool wellScaledAxesWithin(const Segment& p, const Segment& q, double m, double reach) {
  if (isApartAlongMidpoints(p, q, roundingFor(m), reach)) return false;
  const double reach_squared = reach * reach;
  const Certified<double> rough = SquaredDistance<double>(p, q).atClosest();
  if (rough.squared <= reach_squared) return true;
  const double rounding = roundingFor(m);
  if (rough.squared - rough.gap - rounding > reach_squared) return false;

  // The pair is near the boundary, or nearly parallel. DoubleDouble rounds to 2^-104, double to
  // 2^-52.
  const Certified<DoubleDouble> fine = SquaredDistance<DoubleDouble>(p, q).atBestCandidate();
  return fine.squared - fine.gap <=
         DoubleDouble(reach) * DoubleDouble(reach) + DoubleDouble(0x1p-52 * rounding);
}

ClosestPoints wellScaledClosestPoints(const Segment& p, const Segment& q, double m) {
  const SquaredDistance<double> rough(p, q);
  const Certified<double> best = rough.atClosestByProjection();
  // Closer points need more digits, or rounding would show in the direction.
  constexpr double kNear = 0x1p-20;
  if (best.squared > kNear * kNear * m * m) {
    return {best.s, best.t, -1.0 * rough.between(best.s, best.t)};
  }
  // The axes of adjacent segments meet at an end of both, which takes no arithmetic to see.
  for (const double s : {0.0, 1.0}) {
    const Vec3d& end = s == 0 ? p.a : p.b;
    if (end == q.a) return {s, 0, {0, 0, 0}};
    if (end == q.b) return {s, 1, {0, 0, 0}};
  }
  const SquaredDistance<DoubleDouble> fine(p, q);
  const Certified<DoubleDouble> finest = fine.atBestCandidate();
  const Vec3<DoubleDouble> r = fine.between(finest.s, finest.t);
  return {double(finest.s), double(finest.t), {-double(r.x), -double(r.y), -double(r.z)}};
}

}  // namespace

bool axesWithin(const Segment& p, const Segment& q, double reach) {
  const double m = sizeOf(p, q);
  if (isWellScaled(m)) return wellScaledAxesWithin(p, q, m, reach);
  if (m == 0) return true;  // both segments are one point
  if (!std::isfinite(m)) return true;
  const double scale = scaleFor(p, q, m);
  // The scaled reach must not overflow either.
  return axesWithin(scaled(p, scale), scaled(q, scale), std::min(scale * reach, 0x1p200));
}

ClosestPoints closestPoints(const Segment& p, const Segment& q) {
  if (p.isTapered() || q.isTapered()) return closestOfCone(p, q);
  const double m = sizeOf(p, q);
  if (isWellScaled(m)) return wellScaledClosestPoints(p, q, m);
  if (m == 0) return {0, 0, {0, 0, 0}};
  const double scale = scaleFor(p, q, m);
  ClosestPoints closest = closestPoints(scaled(p, scale), scaled(q, scale));
  closest.apart = (1 / scale) * closest.apart;
  return closest;
}

}  // namespace fcl_fibers::geometry
