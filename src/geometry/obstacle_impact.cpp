// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/obstacle_impact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/advancement.h"
#include "geometry/cone_distance.h"
#include "geometry/polytope_distance.h"

namespace fcl_fibers::geometry {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();
constexpr int kCorners = 8;

/// Calls take(k, x, y, z) for each corner of a box. x, y and z are its sides along the box's
/// vectors, -1 or 1, which are the bits of its number k.
template <class Take>
void forEachCorner(Take&& take) {
  const auto side = [](int bit) { return bit == 0 ? -1.0 : 1.0; };
  for (int k = 0; k < kCorners; ++k) take(k, side(k & 1), side(k & 2), side(k & 4));
}

Instant<kCorners> instant(const Segment& s, const Obstacle& box, double reach) {
  Instant<kCorners> instant{{s.a, s.b}, {}, s.radius, reach};
  const auto& v = box.vector;
  forEachCorner([&](int k, double x, double y, double z) {
    instant.corner[k] = box.point + (x * v[0] + y * v[1] + z * v[2]);
  });
  return instant;
}

}  // namespace

/// The search for closest points goes to double-double where it has to.
template <typename T>
Closest<kCorners> closestOf(const Pose<kCorners>& pose) {
  Obstacle box{Obstacle::Kind::kBox};
  for (int i = 0; i < 3; ++i) {
    box.vector[i] = 0.5 * pose.corner(1 << i);
    box.point = box.point + box.vector[i];
  }
  const ClosestOnBox found = closestPoints({pose.w, pose.w + pose.u, 0}, box);
  Closest<kCorners> closest{found.s, {}, -1.0 * found.apart};
  const double(&t)[3] = found.t;
  forEachCorner([&](int k, double x, double y, double z) {
    closest.weight[k] = (0.5 + 0.5 * x * t[0]) * (0.5 + 0.5 * y * t[1]) * (0.5 + 0.5 * z * t[2]);
  });
  return closest;
}

namespace {

bool findOnBox(const MovingSegment& p, const Obstacle& box, double near, double errors,
               bool only_nearer, Impact& impact) {
  double largest = maxNorm(box.point);
  for (const Vec3d& v : box.vector) largest += maxNorm(v);
  const double error = errors + 8 * kEps * largest;  // of the corners
  const auto at = [&](const Segment& s) {
    return instant(s, box, (s.radius + near) * (1 + 4 * kEps) + error);
  };
  Arrival<kCorners> arrival;
  if (!findArrival(at(p.start), at(p.end), /*from=*/0, only_nearer, arrival)) return false;
  impact = {arrival.time, arrival.s, 0};
  return true;
}

/// The radius at either end of the axis, at the start and at the end of a step.
struct Radii {
  double at[2][2];

  explicit Radii(const MovingSegment& p)
      : at{{p.start.radiusAtA(), p.end.radiusAtA()}, {p.start.radiusAtB(), p.end.radiusAtB()}} {}
};

/// Conservative advancement, as Advancement does it, along directions that are fixed during a step.
/// The obstacle's furthest point stays the same along one, so the gap of each end of the axis
/// changes linearly.
/// @param nearestOf  returns the NearestToPolytope of an axis or a cone
/// @pre products of their lengths neither overflow nor vanish
template <class NearestOf>
bool advance(const MovingSegment& p, const Vec3d& point, double size, double near, double errors,
             bool only_nearer, NearestOf&& nearestOf, Impact& impact) {
  // As for other shapes; see toleranceFor() and Advancement::slack().
  constexpr int kRoundsAtFullPrecision = 4096;
  const double tolerance = toleranceFor(size), slack = 0x1p-9 * tolerance;
  const Radii radii(p);
  double reach[2], growth[2];
  for (int end = 0; end < 2; ++end) {
    const double(&radius)[2] = radii.at[end];
    reach[end] = (radius[0] + near) * (1 + 4 * kEps) + errors +
                 4 * kEps * (std::fabs(p.start.taper) + std::fabs(p.end.taper));
    growth[end] = (radius[1] - radius[0]) * (1 + 4 * kEps);
  }
  const Vec3d rate[2] = {p.end.a - p.start.a, p.end.b - p.start.b};
  const auto coneAt = [&](double time) {
    return Segment::cone(p.start.a + time * rate[0], p.start.b + time * rate[1],
                         radii.at[0][0] + time * (radii.at[0][1] - radii.at[0][0]),
                         radii.at[1][0] + time * (radii.at[1][1] - radii.at[1][0]));
  };
  const auto between = [](const double(&ends)[2], double s) {
    return ends[0] + s * (ends[1] - ends[0]);
  };
  if (only_nearer) {
    const NearestToPolytope nearest = nearestOf(coneAt(0));
    const double before = between(reach, nearest.s);
    if (nearest.distance <= before + tolerance / 2) {
      for (double& r : reach) r = nearest.distance - 2 * tolerance + (r - before);
    }
  }
  double accepted = tolerance / 2, time = 0;
  for (int round = 0;; ++round) {
    const Segment cone = coneAt(time);
    NearestToPolytope nearest = nearestOf(cone);
    double level[2] = {reach[0] + time * growth[0], reach[1] + time * growth[1]};
    const double near_level = between(level, nearest.s);
    // Nothing parts them then, so that only radii that grow bring them nearer.
    if (nearest.distance <= tolerance / 4) {
      nearest = {nearest.s, nearest.distance, {0, 0, 0}, 0};
      level[0] = level[1] = near_level;
    }
    if (!(nearest.distance > near_level + accepted)) {
      impact = {time, nearest.s, 0};
      return true;
    }
    const Vec3d& n = nearest.direction;
    const double at[2] = {dot(n, cone.a - point), dot(n, cone.b - point)};
    const double first = std::min(at[0], at[1]);
    double step = std::numeric_limits<double>::infinity();
    for (int end = 0; end < 2; ++end) {
      const double gap = nearest.least_along + (at[end] - first) - level[end] - slack;
      step = std::min(step, firstRoot(gap, dot(n, rate[end]) - growth[end], 0));
    }
    if (step > 1 - time) return false;
    time += step;
    if (round >= kRoundsAtFullPrecision) accepted *= 2;
  }
}

/// Of a polytope or, if the capsule is tapered, a box.
bool findByAdvance(const MovingSegment& p, const Obstacle& obstacle, double near, double errors,
                   bool only_nearer, Impact& impact) {
  // Of two scales the one that brings the larger of both ends near one.
  const double size = std::max(sizeOfPair(p.start, obstacle), sizeOfPair(p.end, obstacle)) +
                      std::max(p.start.radius, p.end.radius);
  const Segment& larger =
      sizeOfPair(p.start, obstacle) < sizeOfPair(p.end, obstacle) ? p.end : p.start;
  if (size > 0x1p-150 && size < 0x1p150) {
    const auto nearestOf = [&](const Segment& cone) {
      return isTapered(p) ? nearestOfCone(cone, obstacle) : nearestToPolytope(cone, obstacle);
    };
    return advance(p, obstacle.point, size, near, errors, only_nearer, nearestOf, impact);
  }
  impact = {0, 0, 0};
  const double scale = scaleOfPair(larger, obstacle);
  if (scale == 0 || scale == 1 || !std::isfinite(size)) return !(size == 0 && only_nearer);
  return findByAdvance({scaled(p.start, scale), scaled(p.end, scale)}, scaled(obstacle, scale),
                       std::min(scale * near, 0x1p150), std::min(scale * errors, 0x1p150),
                       only_nearer, impact);
}

/// The distance of each end of the axis changes linearly.
bool findOnPlane(const MovingSegment& p, const Obstacle& plane, double near, double error,
                 bool only_nearer, Impact& impact) {
  const Vec3d ends[2][2] = {{p.start.a - plane.point, p.end.a - plane.point},
                            {p.start.b - plane.point, p.end.b - plane.point}};
  double gap[2][2], size = 0;
  double rounding = 32 * kEps * (std::fabs(p.start.taper) + std::fabs(p.end.taper));
  for (int end = 0; end < 2; ++end) {
    for (int time = 0; time < 2; ++time) {
      gap[end][time] = dot(plane.vector[0], ends[end][time]) - plane.offset;
      size = std::max(size, std::fabs(gap[end][time]));
      rounding += 32 * kEps * (norm1(ends[end][time]) + std::fabs(plane.offset));
    }
  }
  const bool is_plane = plane.kind == Obstacle::Kind::kPlane;
  const double side = is_plane && std::max(gap[0][0], gap[1][0]) < 0 ? -1 : 1;
  const Radii radii(p);
  double reach[2][2];
  for (int end = 0; end < 2; ++end) {
    for (int time = 0; time < 2; ++time) {
      reach[end][time] = (radii.at[end][time] + near) * (1 + 4 * kEps) + error + rounding;
    }
  }
  size += norm1(p.start.b - p.start.a) + norm1(p.end.b - p.end.a) + p.start.radius + p.end.radius;
  const double most = std::max(reach[0][0], reach[1][0]);
  const double less[2] = {most - reach[0][0], most - reach[1][0]};
  const double nearest = std::min(side * gap[0][0] + less[0], side * gap[1][0] + less[1]);
  if (only_nearer && nearest <= most + toleranceFor(size) / 2) {
    if (is_plane && std::min(side * gap[0][0], side * gap[1][0]) < 0) return false;
    for (int end = 0; end < 2; ++end) {
      reach[end][0] = nearest - less[end] - 2 * toleranceFor(size);
      reach[end][1] = reach[end][0] + (radii.at[end][1] - radii.at[end][0]);
    }
  }
  impact = {2, 0, 0};
  for (int end = 0; end < 2; ++end) {
    const double from = side * gap[end][0] - reach[end][0], to = side * gap[end][1] - reach[end][1];
    // What is not finite touches.
    const double time = !(from > 0) ? 0 : !(to > 0) ? from / (from - to) * (1 - 4 * kEps) : 2;
    if (time < impact.time || !(time >= 0)) impact = {time >= 0 ? time : 0, double(end), 0};
  }
  return impact.time <= 1;
}

}  // namespace

bool findImpact(const MovingSegment& capsule, const Obstacle& obstacle, double margin, double error,
                bool only_nearer, Impact& impact) {
  const double near = margin + obstacle.margin, errors = error + obstacle.error;
  const Vec3d(&v)[3] = obstacle.vector;
  const auto find = [&](const auto& other, auto& found) {
    return only_nearer ? findApproach(capsule, {other, other}, near, errors, 0, found)
                       : findImpact(capsule, {other, other}, near, errors, 0, found);
  };
  switch (obstacle.kind) {
    case Obstacle::Kind::kBox:
      return isTapered(capsule)
                 ? findByAdvance(capsule, obstacle, near, errors, only_nearer, impact)
                 : findOnBox(capsule, obstacle, near, errors, only_nearer, impact);
    case Obstacle::Kind::kHalfspace:
    case Obstacle::Kind::kPlane:
      return findOnPlane(capsule, obstacle, near, errors, only_nearer, impact);
    case Obstacle::Kind::kPolytope:
      return findByAdvance(capsule, obstacle, near, errors, only_nearer, impact);
    case Obstacle::Kind::kAxis: {
      Segment axis = obstacle.capsule();
      axis.radius = 0;
      return find(axis, impact);
    }
    case Obstacle::Kind::kTriangle: {
      TriangleImpact found;
      if (!find(Triangle{v[0], v[1], v[2]}, found)) return false;
      impact = {found.time, found.s, 0};
      return true;
    }
    case Obstacle::Kind::kNone:
      break;
  }
  impact = {0, 0, 0};
  return true;
}

}  // namespace fcl_fibers::geometry
