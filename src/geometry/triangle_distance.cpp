// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/triangle_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/cone_distance.h"
#include "geometry/double_double.h"
#include "geometry/squared_triangle_distance.h"
#include "geometry/triangle_rows.h"

namespace fcl_fibers::geometry {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();

/// The sum of the 1-norms of the differences, by which rounding is bounded.
double sizeOf(const Segment& p, const Triangle& t) {
  return norm1(p.a - t.a) + norm1(p.b - p.a) + norm1(t.b - t.a) + norm1(t.c - t.a);
}

/// Bounds the rounding of `squared - gap` in double for a pair of size m. The vector r carries an
/// error of 5 eps m, its square 12 eps m^2, and each slope 16 eps m^2.
double roundingFor(double m) { return 128 * kEps * m * m; }

/// Whether products of six lengths of this size neither overflow nor vanish.
bool isWellScaled(double m) { return m > 0x1p-150 && m < 0x1p150; }

double largestOf(const Segment& p, const Triangle& t) {
  return std::max({maxNorm(p.a), maxNorm(p.b), maxNorm(t.a), maxNorm(t.b), maxNorm(t.c)});
}

/// Whether all of the axis lies more than `reach` beyond all of the triangle along the line between
/// their middles, which takes no division and settles most pairs that are apart.
bool isApartAlongMiddles(const Segment& p, const Triangle& t, double rounding, double reach) {
  // Six times the vector between the middles, and its products with six times the half extents.
  const Vec3d apart = 3.0 * (p.a - t.a + p.b - t.a) - 2.0 * (t.b - t.a + t.c - t.a);
  const double squared = squaredNorm(apart);
  const double axis = 3 * std::fabs(dot(p.b - p.a, apart));
  const double b = dot(t.b - t.a, apart), c = dot(t.c - t.a, apart);
  const double most = 6 * std::max({0.0, b, c}) - 2 * (b + c);
  const double gap = squared - axis - most - 72 * rounding;
  return gap > 0 && gap * gap > 36 * reach * reach * squared * (1 + 0x1p-40);
}

bool wellScaledWithin(const Segment& p, const Triangle& t, double m, double reach) {
  const double rounding = roundingFor(m);
  if (isApartAlongMiddles(p, t, rounding, reach)) return false;
  const double reach_squared = reach * reach;
  const CertifiedOnTriangle<double> rough = SquaredTriangleDistance<double>(p, t).atClosest();
  if (rough.squared <= reach_squared) return true;
  if (rough.squared - rough.gap - rounding > reach_squared) return false;
  const CertifiedOnTriangle<DoubleDouble> fine =
      SquaredTriangleDistance<DoubleDouble>(p, t).atClosest();
  return fine.squared - fine.gap <=
         DoubleDouble(reach) * DoubleDouble(reach) + DoubleDouble(0x1p-52 * rounding);
}

/// Finds the closest points in a few operations where an end of the axis is above the inside of a
/// triangle that is no needle, or where the axis crosses it at no tiny angle. Then they are as near
/// to each other as the closest ones, up to a few times the error of a coordinate. The error of
/// where the axis crosses is that divided by the angle, which is less than the way to the edges.
/// @return whether it is such a pair for certain
bool findInside(const Segment& capsule, const Triangle& t, double m, ClosestOnTriangle& closest) {
  const Vec3d w = capsule.a - t.a, u = capsule.b - capsule.a, v1 = t.b - t.a, v2 = t.c - t.a;
  const Vec3d normal = cross(v1, v2);
  const double nn = squaredNorm(normal);
  const double height = dot(normal, w), climb = dot(normal, u);
  constexpr double kLeastSine = 0x1p-4, kLeastSize = 0x1p-20, kLeastClimb = 0x1p-20;  // squared
  const double vv1 = squaredNorm(v1), vv2 = squaredNorm(v2);
  const bool is_wide = nn >= kLeastSine * vv1 * vv2 && std::min(vv1, vv2) >= kLeastSize * m * m;
  if (!is_wide) return false;
  // The error of a height and of the climb, in units of the normal.
  const double rounding = 64 * kEps * std::sqrt(nn) * m;
  const double end = height + climb;
  if (std::min({std::fabs(height), std::fabs(end), std::fabs(climb)}) <= rounding) return false;
  const bool crosses = (height > 0) != (end > 0);
  const bool is_steep = climb * climb >= kLeastClimb * nn * squaredNorm(u);
  if (crosses && !is_steep) return false;
  const bool is_first = (height > 0) == (climb > 0);
  const double s = crosses ? height / (height - end) : is_first ? 0 : 1;
  const Vec3d p = w + s * u;
  const double x = dot(cross(p, v2), normal) / nn, y = dot(cross(v1, p), normal) / nn;
  constexpr double kInside = 0x1p-20;
  if (std::min({x, y, 1 - x - y}) <= kInside) return false;
  const Vec3d apart = crosses ? Vec3d{0, 0, 0} : ((s == 0 ? -height : -end) / nn) * normal;
  closest = {s, {1 - x - y, x, y}, apart};
  return true;
}

/// Of a well scaled pair that rows leave open.
ClosestOnTriangle closestInDetail(const Segment& capsule, const Triangle& triangle, double m) {
  ClosestOnTriangle closest;
  if (findInside(capsule, triangle, m, closest)) return closest;
  const SquaredTriangleDistance<DoubleDouble> fine(capsule, triangle);
  const CertifiedOnTriangle<DoubleDouble> best = fine.atClosest();
  const Vec3<DoubleDouble> r = fine.between(best);
  const double x = double(best.x), y = double(best.y);
  return {
      double(best.s), {std::max(1 - x - y, 0.0), x, y}, {-double(r.x), -double(r.y), -double(r.z)}};
}

/// Of a pair that is not well scaled.
ClosestOnTriangle closestOfScaled(const Segment& capsule, const Triangle& triangle, double m) {
  if (m == 0) return {0, {1, 0, 0}, {0, 0, 0}};
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  // No scale makes these finite.
  if (std::isnan(m) || !std::isfinite(largestOf(capsule, triangle))) {
    return {0, {1, 0, 0}, {kInfinity, kInfinity, kInfinity}};
  }
  const double scale = scaleForSize(m, largestOf(capsule, triangle));
  ClosestOnTriangle closest = closestPoints(scaled(capsule, scale), scaled(triangle, scale));
  closest.apart = (1 / scale) * closest.apart;
  return closest;
}

void setVector(TriangleRows::Vectors& vectors, std::size_t lane, const Vec3d& vector) {
  for (int axis = 0; axis < 3; ++axis) vectors[axis][lane] = vector.*kAxes[axis];
}

}  // namespace

bool axisWithin(const Segment& capsule, const Triangle& triangle, double reach) {
  const double m = sizeOf(capsule, triangle);
  if (isWellScaled(m)) return wellScaledWithin(capsule, triangle, m, reach);
  if (m == 0 || !std::isfinite(m)) return true;
  const double scale = scaleForSize(m, largestOf(capsule, triangle));
  // The scaled reach must not overflow either.
  return axisWithin(scaled(capsule, scale), scaled(triangle, scale),
                    std::min(scale * reach, 0x1p150));
}

double reachOf(const Segment& capsule, const Triangle& /*triangle*/, double margin, double error) {
  return std::max(capsule.radius + margin, 0.0) * (1 + 4 * kEps) + error;
}

bool touch(const Segment& capsule, const Triangle& triangle, double margin, double error) {
  if (capsule.isTapered()) return coneWithin(capsule, triangle, margin, error);
  return axisWithin(capsule, triangle, reachOf(capsule, triangle, margin, error));
}

double leastDistance(const Segment& capsule, const Triangle& triangle) {
  if (capsule.isTapered()) return leastDistanceOfCone(capsule, triangle);
  const double m = sizeOf(capsule, triangle);
  if (m == 0 || !std::isfinite(m)) return 0;
  if (!isWellScaled(m)) {
    const double scale = scaleForSize(m, largestOf(capsule, triangle));
    return leastDistance(scaled(capsule, scale), scaled(triangle, scale)) / scale;
  }
  const auto rootOf = [](double squared) {
    return std::sqrt(std::max(squared, 0.0)) * (1 - 4 * kEps);
  };
  const double rounding = roundingFor(m);
  const CertifiedOnTriangle<double> rough =
      SquaredTriangleDistance<double>(capsule, triangle).atClosest();
  const double slack = rough.gap + rounding;
  if (slack <= 0x1p-26 * rough.squared) return rootOf(rough.squared - slack);
  const CertifiedOnTriangle<DoubleDouble> fine =
      SquaredTriangleDistance<DoubleDouble>(capsule, triangle).atClosest();
  return rootOf(double(fine.squared - fine.gap - DoubleDouble(0x1p-52 * rounding)));
}

void closestPoints(const Segment* capsules, const Triangle* triangles, std::size_t count,
                   ClosestOnTriangle* closest) {
  TriangleRows rows;
  // Lanes behind several pairs repeat the last one.
  const std::size_t lanes = count == 1 ? 1 : kClosestAtOnce;
  for (std::size_t i = 0; i < lanes; ++i) {
    const Segment& p = capsules[std::min(i, count - 1)];
    const Triangle& t = triangles[std::min(i, count - 1)];
    setVector(rows.w, i, p.a - t.a);
    setVector(rows.u, i, p.b - p.a);
    setVector(rows.v1, i, t.b - t.a);
    setVector(rows.v2, i, t.c - t.a);
    rows.size[i] = sizeOf(p, t);
  }
  const simd::LaneMask certain = findClosest(rows, count);
  for (std::size_t i = 0; i < count; ++i) {
    const double m = rows.size[i], x = rows.x[i], y = rows.y[i];
    if (capsules[i].isTapered()) {
      closest[i] = closestOfCone(capsules[i], triangles[i]);
    } else if (!isWellScaled(m)) {
      closest[i] = closestOfScaled(capsules[i], triangles[i], m);
    } else if ((certain >> i & 1) == 0) {
      closest[i] = closestInDetail(capsules[i], triangles[i], m);
    } else {
      closest[i] = {rows.s[i],
                    {std::max(1 - x - y, 0.0), x, y},
                    {-rows.apart[0][i], -rows.apart[1][i], -rows.apart[2][i]}};
    }
  }
}

ClosestOnTriangle closestPoints(const Segment& capsule, const Triangle& triangle) {
  ClosestOnTriangle closest;
  closestPoints(&capsule, &triangle, 1, &closest);
  return closest;
}

}  // namespace fcl_fibers::geometry
