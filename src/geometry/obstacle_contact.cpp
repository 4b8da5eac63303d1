// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/obstacle_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/directions.h"
#include "geometry/segment_distance.h"
#include "geometry/triangle_contact.h"
#include "geometry/way_apart.h"

namespace fcl_fibers::geometry {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();

/// A contact of an axis, without the capsule's radius at the point and the margin of the obstacle.
struct AxisContact {
  double s, t;
  double distance;
  Vec3d on_obstacle;
  Vec3d normal;
};

struct WayOut {
  Vec3d normal;  ///< the way is against it
  double depth;
};

/// The shortest way of an axis out of a box. The differences of their points are a zonotope around
/// that of their middles, and each of its faces is along two of the box's vectors and the axis.
WayOut wayOut(const Segment& axis, const Obstacle& box) {
  const Vec3d along[] = {box.vector[0], box.vector[1], box.vector[2], axis.b - axis.a};
  const Vec3d middle = 0.5 * (axis.a - box.point) + 0.5 * (axis.b - box.point);
  double size = norm1(middle);
  for (const Vec3d& v : along) size += norm1(v);
  WayOut best{{}, std::numeric_limits<double>::infinity()};
  const auto consider = [&](const Vec3d& n) {
    double depth = 0.5 * std::fabs(dot(n, along[3])) - std::fabs(dot(n, middle));
    for (int i = 0; i < 3; ++i) depth += std::fabs(dot(n, along[i]));
    if (depth < best.depth - 16 * kEps * size) best = {dot(n, middle) < 0 ? n : -1.0 * n, depth};
  };
  constexpr int kPairs[][2] = {{1, 2}, {2, 0}, {0, 1}, {0, 3}, {1, 3}, {2, 3}};
  // A face of this angle is so narrow that those beside it are as near.
  constexpr double kNarrow = 8 * kEps;
  for (const auto& pair : kPairs) {
    const Vec3d n = productDirection(along[pair[0]], along[pair[1]], kNarrow);
    if (maxNorm(n) > 0) consider(n);
  }
  if (!std::isinf(best.depth)) return best;
  // All is on one line.
  const Vec3d* longest = &along[0];
  for (const Vec3d& v : along) {
    if (maxNorm(v) > maxNorm(*longest)) longest = &v;
  }
  consider(perpendicularTo(*longest, *longest, middle));
  return best;
}

/// The shortest way of a rounded cone out of a box, with its radii. In that direction something
/// ends that holds the way off: it is across two of the box's vectors, or across one of them while
/// both ends of the cone reach as far. If a ball outside of the box is nearest, the way is along
/// `apart`.
WayOut wayOfConeOut(const Segment& cone, const Obstacle& box, const Vec3d& apart) {
  const Vec3d(&v)[3] = box.vector;
  const Vec3d a = cone.a - box.point, b = cone.b - box.point, along = cone.b - cone.a;
  const Vec3d middle = 0.5 * a + 0.5 * b;
  double size = norm1(middle) + norm1(along) + cone.radius;
  for (const Vec3d& x : v) size += norm1(x);
  WayOut best{{}, std::numeric_limits<double>::infinity()};
  const auto consider = [&](const Vec3d& outward) {
    double depth = std::max(cone.radiusAtA() - dot(outward, a), cone.radiusAtB() - dot(outward, b));
    for (const Vec3d& x : v) depth += std::fabs(dot(outward, x));
    if (depth < best.depth - 16 * kEps * size) best = {-1.0 * outward, depth};
  };
  const auto considerBoth = [&](const Vec3d& n) {
    const Vec3d first = dot(n, middle) < 0 ? -1.0 * n : n;
    consider(first);
    consider(-1.0 * first);
  };
  // Both ends reach as far along n = lean * e + rest * across if n.along is the taper.
  const auto considerLeaning = [&](const Vec3d& e, const Vec3d& across) {
    const double lean = cone.taper / dot(along, e), rest = 1 - lean * lean;
    if (!(rest > 0)) return;
    for (const double side : {1.0, -1.0}) {
      consider(normalized(lean * e + side * std::sqrt(rest) * across));
    }
  };
  constexpr double kNarrow = 8 * kEps;  // as in wayOut()
  if (maxNorm(apart) > 0) consider(normalized(-1.0 * apart));
  for (int k = 0; k < 3; ++k) {
    const Vec3d n = productDirection(v[(k + 1) % 3], v[(k + 2) % 3], kNarrow);
    if (maxNorm(n) > 0) considerBoth(n);
  }
  for (const Vec3d& x : v) {
    const Vec3d across = productDirection(x, along, kNarrow);
    if (maxNorm(across) > 0) considerLeaning(normalized(cross(across, scaledToOne(x))), across);
  }
  if (!std::isinf(best.depth)) return best;
  // The box is on a line, and the axis is on it or leans no more than the taper.
  const Vec3d* longest = &v[0];
  for (const Vec3d& x : v) {
    if (maxNorm(x) > maxNorm(*longest)) longest = &x;
  }
  const Vec3d across = perpendicularTo(*longest, along, middle);
  considerBoth(across);
  if (maxNorm(along) > 0) considerLeaning(normalized(along), across);
  return best;
}

AxisContact boxContact(const Segment& capsule, const Obstacle& box, double rounding) {
  ClosestOnBox closest = closestPoints(capsule, box);
  const bool tapers = capsule.isTapered();
  const Vec3d apart = tapers ? closestPoints({capsule.a, capsule.b, 0}, box).apart : closest.apart;
  Vec3d normal;
  double distance;
  if (maxNorm(apart) > rounding) {
    normal = normalized(closest.apart);
    distance = dot(normal, closest.apart);
  } else {
    const bool is_beside = maxNorm(closest.apart) > rounding;
    const WayOut way = tapers
                           ? wayOfConeOut(capsule, box, is_beside ? closest.apart : Vec3d{0, 0, 0})
                           : wayOut(capsule, box);
    normal = way.normal;
    distance = -way.depth;
    Segment moved = capsule;
    moved.a = capsule.a + distance * normal;
    moved.b = capsule.b + distance * normal;
    closest = closestPoints(moved, box);
    if (tapers) distance += capsule.radiusAt(closest.s);
  }
  const auto& [x, y, z] = closest.t;
  const Vec3d on_box = box.point + (x * box.vector[0] + y * box.vector[1] + z * box.vector[2]);
  return {closest.s, 0, distance, on_box, normal};
}

AxisContact planeContact(const Segment& axis, const Obstacle& plane) {
  const double length = norm(plane.vector[0]);
  Vec3d outward = (1 / length) * plane.vector[0];
  double offset = plane.offset / length;
  const Vec3d a = axis.a - plane.point, b = axis.b - plane.point;
  double at_a = dot(outward, a) - offset, at_b = dot(outward, b) - offset;
  // By how much the ends have less than the larger radius.
  const double less_a = axis.radius - axis.radiusAtA(), less_b = axis.radius - axis.radiusAtB();
  // A plane is left to the side that is nearer, which is that of a capsule's middle.
  const double nearer = axis.isTapered() ? std::min(at_a + less_a, at_b + less_b) +
                                               std::max(at_a - less_a, at_b - less_b)
                        : at_a + at_b < 0 ? -1
                                          : 1;
  if (plane.kind == Obstacle::Kind::kPlane && nearer < 0) {
    outward = -1.0 * outward;
    at_a = -at_a;
    at_b = -at_b;
  }
  const double low_a = at_a + less_a, low_b = at_b + less_b;
  const double rounding =
      8 * kEps * (norm1(a) + norm1(b) + std::fabs(offset) + std::fabs(axis.taper));
  const bool is_along = std::fabs(low_b - low_a) <= rounding && !(axis.a == axis.b);
  const double s = is_along ? 0.5 : low_b < low_a ? 1 : 0;
  const double height = is_along ? 0.5 * at_a + 0.5 * at_b : s == 1 ? at_b : at_a;
  return {s, 0, height, axis.a + s * (axis.b - axis.a) - height * outward, -1.0 * outward};
}

AxisContact axesContact(const Segment& p, const Segment& q, double rounding) {
  const ClosestPoints closest = closestPoints(p, q);
  const Vec3d v = q.b - q.a;
  const Vec3d normal =
      maxNorm(closest.apart) > rounding ? normalized(closest.apart) : wayApart(p, q, closest);
  return {closest.s, closest.t, safeNorm(closest.apart), q.a + closest.t * v, normal};
}

}  // namespace

ObstacleContact obstacleContact(const Segment& capsule, const Obstacle& obstacle,
                                const Vec3d& origin) {
  const Vec3d(&v)[3] = obstacle.vector;
  const double margin = obstacle.margin;
  if (obstacle.kind == Obstacle::Kind::kTriangle) {
    const TriangleContact c = triangleContact(capsule, Triangle{v[0], v[1], v[2]}, origin);
    return {c.s, 0, c.distance - margin, c.point_a, c.point_b - margin * c.normal, c.normal};
  }
  // This bounds the rounding of points, which were rounded in world coordinates before.
  const double rounding =
      16 * kEps *
      (maxNorm(origin) + std::max({maxNorm(capsule.a), maxNorm(capsule.b), maxNorm(obstacle.point),
                                   maxNorm(v[0]), maxNorm(v[1]), maxNorm(v[2])}));
  const AxisContact c =
      obstacle.kind == Obstacle::Kind::kBox    ? boxContact(capsule, obstacle, rounding)
      : obstacle.kind == Obstacle::Kind::kAxis ? axesContact(capsule, obstacle.capsule(), rounding)
                                               : planeContact(capsule, obstacle);
  const double radius = capsule.radiusAt(c.s);
  return {c.s,
          c.t,
          c.distance - radius - margin,
          capsule.a + c.s * (capsule.b - capsule.a) + radius * c.normal + origin,
          c.on_obstacle - margin * c.normal + origin,
          c.normal};
}

}  // namespace fcl_fibers::geometry
