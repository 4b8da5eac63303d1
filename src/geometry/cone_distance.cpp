// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/cone_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/least_distance.h"
#include "geometry/polytope_vertices.h"
#include "geometry/squared_distance.h"

namespace fcl_fibers::geometry {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();

// What the search asks of each shape.

const Vec3d& originOf(const Segment& s) { return s.a; }
const Vec3d& originOf(const Triangle& t) { return t.a; }
const Vec3d& originOf(const Obstacle& obstacle) { return obstacle.point; }

Segment relativeTo(const Vec3d& from, const Segment& s) {
  return {s.a - from, s.b - from, s.radius, s.taper};
}
Triangle relativeTo(const Vec3d& from, const Triangle& t) {
  return {t.a - from, t.b - from, t.c - from};
}
Obstacle relativeTo(const Vec3d& from, Obstacle obstacle) {
  obstacle.point = obstacle.point - from;
  return obstacle;
}

/// The sum of the 1-norms of a shape's vectors and of its radii.
///@{
double extentOf(const Segment& s) {
  return norm1(s.b - s.a) + std::max(s.radius, std::fabs(s.taper));
}
double extentOf(const Triangle& t) { return norm1(t.b - t.a) + norm1(t.c - t.a); }
double extentOf(const Obstacle& obstacle) { return 2 * norm1(reachOfVectors(obstacle)); }
///@}

/// How far the furthest point of a shape at the origin is along a vector.
///@{
double mostAlong(const Vec3d& n, const Segment& s) {
  return std::max(dot(n, s.a) + s.radiusAtA(), dot(n, s.b) + s.radiusAtB());
}
double mostAlong(const Vec3d& n, const Triangle& t) {
  return std::max({dot(n, t.a), dot(n, t.b), dot(n, t.c)});
}
double mostAlong(const Vec3d& n, const Obstacle& obstacle) {
  const auto& v = obstacle.vector;
  const Vec3d along{dot(n, v[0]), dot(n, v[1]), dot(n, v[2])};
  if (obstacle.kind == Obstacle::Kind::kPolytope) return obstacle.vertices->furthest(along).product;
  return norm1(along);
}
///@}

/// A point that is a center, and what of a shape is nearest to it.
template <class Closest>
struct Near {
  Closest closest;
  double length;    ///< of the way
  double distance;  ///< length less the radius of the shape there
  Vec3d direction;  ///< from the shape; a unit vector, or shorter if the way has no length
};

/// The ball of a cone nearest to a point lies beyond the foot of the point towards the larger
/// balls, where the way to the point is across the cone's surface. The direction is made so,
/// because the rounding of points would show in it if they are near.
Near<ClosestPoints> nearestOn(const Segment& s, const Vec3d& center) {
  const Vec3d w = center - s.a, v = s.b - s.a;
  // Beside a pair's size rounding hides a length whose squares underflow.
  const double vv = squaredNorm(v), rest = vv < 0x1p-450 ? 0 : vv - s.taper * s.taper;
  double t = s.taper > 0 ? 1 : 0;
  Vec3d direction{0, 0, 0};
  if (rest > 0) {
    const double foot = dot(w, v) / vv;
    const Vec3d rough = w - foot * v;
    // What rounding has left along the axis would be much of a short vector, or all of it.
    const Vec3d away = rough - (dot(rough, v) / vv) * v;
    const double height = 4 * squaredNorm(away) < squaredNorm(rough) ? 0 : norm(away);
    t = clampedToUnit(foot + s.taper * height / std::sqrt(vv * rest));
    direction = (-s.taper / vv) * v;
    if (height > 0) direction = direction + (std::sqrt(rest / vv) / height) * away;
  }
  const Vec3d way = t == 0 ? w : t == 1 ? center - s.b : w - t * v;
  const double length = norm(way);
  // At an end the way leans towards the rest of the axis no more than the surface does, unless only
  // rounding has moved the ball there.
  if ((t == 0 || t == 1) && length > 0) {
    const Vec3d of_way = (1 / length) * way;
    const double lean = dot(of_way, v) + s.taper;
    if (!(rest > 0) || (t == 0 ? lean <= 0 : lean >= 0)) direction = of_way;
  }
  return {{0, t, -length * direction}, length, length - s.radiusAt(t), direction};
}
template <class Closest>
Near<Closest> nearAlong(const Closest& closest) {
  const double length = norm(closest.apart);
  const Vec3d direction = length > 0 ? (-1 / length) * closest.apart : Vec3d{0, 0, 0};
  return {closest, length, length, direction};
}
Near<ClosestOnTriangle> nearestOn(const Triangle& t, const Vec3d& center) {
  return nearAlong(closestPoints(Segment{center, center, 0}, t));
}
Near<ClosestOnBox> nearestOn(const Obstacle& obstacle, const Vec3d& center) {
  const Segment point{center, center, 0};
  if (obstacle.kind == Obstacle::Kind::kBox) return nearAlong(closestPoints(point, obstacle));
  const NearestToPolytope nearest = nearestToPolytope(point, obstacle, 16 * kEps);
  const Vec3d apart = -nearest.distance * nearest.direction;
  return {{0, {}, apart}, nearest.distance, nearest.distance, nearest.direction};
}

/// Where an axis is nearest to a shape. Few cones are nearest far from there.
///@{
double nearestOfAxis(const Segment& axis, const Segment& other) {
  return SquaredDistance<double>(axis, other).atClosestByProjection().s;
}
double nearestOfAxis(const Segment& axis, const Triangle& t) { return closestPoints(axis, t).s; }
double nearestOfAxis(const Segment& axis, const Obstacle& obstacle) {
  return obstacle.kind == Obstacle::Kind::kBox ? closestPoints(axis, obstacle).s
                                               : nearestToPolytope(axis, obstacle).s;
}
///@}

/// A ball of a cone beside a shape. No ball of the cone is nearer than `least`.
template <class Closest>
struct Ball {
  double s;
  Near<Closest> near;
  double distance, least;
  double slope;  ///< of the distance
};

/// The line below the distances of all balls that a ball at an arc parameter adds: along the
/// direction from the shape to that ball their gaps change evenly, and no ball is nearer than that.
struct Line {
  double at, gap, slope;

  bool isKnown() const { return !std::isinf(gap); }
  double gapAt(double s) const { return gap + (s - at) * slope; }
  /// Where the slope vanishes if it changes evenly.
  double rootWith(const Line& other) const {
    return at - slope * ((at - other.at) / (slope - other.slope));
  }
};

/// Looks for the nearest ball between two arc parameters that come nearer to each other, until
/// isEnough(ball).
/// @param m  size of the pair
template <class Other, class IsEnough>
auto search(const Segment& cone, const Other& other, double m, IsEnough&& isEnough) {
  constexpr int kMostRounds = 64;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Vec3d along = cone.b - cone.a;
  // The lines on both sides of the nearest ball, and those before them.
  Line lines[2] = {{0, -kInfinity, 0}, {1, -kInfinity, 0}}, before[2] = {lines[0], lines[1]};
  double least = kInfinity, lowest = kInfinity;
  double next = nearestOfAxis({cone.a, cone.b, 0}, other);
  Ball<decltype(nearestOn(other, cone.a).closest)> best{};
  for (int round = 0; round < kMostRounds; ++round) {
    const double s = next;
    const Vec3d center = cone.a + s * along;
    const auto near = nearestOn(other, center);
    const Vec3d& n = near.direction;
    const double distance = near.distance - cone.radiusAt(s);
    const double gap = dot(n, center) - mostAlong(n, other) - cone.radiusAt(s);
    const Line line{s, gap, dot(n, along) - cone.taper};
    // Of balls that rounding cannot tell apart the last one has the best direction.
    lowest = std::min(lowest, distance);
    if (distance <= lowest + 4 * kEps * m) best = {s, near, distance, 0, line.slope};
    // If one is no number, it stays so, and holds nothing apart.
    if (gap < least || std::isnan(gap)) least = gap;
    best.least = least;
    const int side = line.slope > 0 ? 1 : 0;
    before[side] = lines[side];
    lines[side] = line;
    const double width = lines[1].at - lines[0].at;
    if (line.slope == 0 || !(width > 0)) break;
    double crossing =
        (lines[1].gapAt(lines[0].at) - lines[0].gap) / (lines[0].slope - lines[1].slope);
    crossing = lines[0].at + std::min(std::max(crossing, 0.0), width);
    const double of_both = std::min(lines[0].gapAt(crossing), lines[1].gapAt(crossing));
    const double of_line = std::min(line.gapAt(lines[0].at), line.gapAt(lines[1].at));
    best.least = std::min(least, std::max(of_both, of_line));
    if (isEnough(best) || width <= kEps) break;
    const Line& opposite = lines[1 - side];
    if (round == 0) {
      next = nearestOn(cone, center + near.closest.apart).closest.t;
    } else if (!opposite.isKnown()) {
      next = line.rootWith(before[side]);
    } else {
      // The slope may jump, or change on one side alone. There it is the steeper one.
      const int steep = lines[1].slope > -lines[0].slope ? 1 : 0;
      const Line& second = before[steep].isKnown() ? before[steep] : lines[1 - steep];
      next = round % 2 == 0 ? lines[steep].rootWith(second) : crossing;
    }
    if (next > lines[0].at && next < lines[1].at) continue;
    next = opposite.isKnown() ? lines[0].at + 0.5 * width : opposite.at;
  }
  return best;
}

/// A cone and a shape relative to a point of the shape, which costs a rounding of differences, and
/// scaled so that products of six lengths neither overflow nor vanish.
template <class Other>
struct Pair {
  Segment cone;
  Other other;
  double size;  ///< the sum of the 1-norms of all differences and the radii, which bounds rounding
  double scale = 1;

  Pair(const Segment& given, const Other& given_other)
      : cone(relativeTo(originOf(given_other), given)),
        other(relativeTo(originOf(given_other), given_other)),
        size(norm1(cone.a) + extentOf(cone) + extentOf(other)) {
    if ((size > 0x1p-150 && size < 0x1p150) || !hasSize()) return;
    scale = scaleForSize(size, size);
    cone = scaled(cone, scale);
    other = scaled(other, scale);
    size *= scale;
  }
  /// Otherwise all is at one point, or not finite.
  bool hasSize() const { return size > 0 && std::isfinite(size); }

  /// The direction is as certain as the length of the way lets it be.
  auto nearestBall() const {
    return search(cone, other, size, [m = size](const auto& b) {
      return b.distance - b.least <= 16 * kEps * m &&
             std::fabs(b.slope) * b.near.length <= 2 * kEps * m * (m + b.near.length);
    });
  }
};

template <class Other>
auto closest(const Segment& cone, const Other& other) {
  const Pair<Other> pair(cone, other);
  decltype(pair.nearestBall().near.closest) found{};
  if (!pair.hasSize()) {
    if (pair.size == 0) return nearestOn(pair.other, pair.cone.a).closest;
    found.apart.x = std::numeric_limits<double>::infinity();
    return found;
  }
  const auto ball = pair.nearestBall();
  found = ball.near.closest;
  found.s = ball.s;
  found.apart = (1 / pair.scale) * found.apart;
  return found;
}

}  // namespace

template <class Other>
bool coneWithin(const Segment& cone, const Other& other, double margin, double error) {
  const Pair<Other> pair(cone, other);
  if (!pair.hasSize()) return true;
  // The gap carries 8 eps of the size: 6 of differences, products and radii, 2 of the direction.
  const double reach =
      pair.scale * (margin + error + 4 * kEps * std::fabs(margin)) + 8 * kEps * pair.size;
  const auto isDecided = [&](const auto& b) { return b.distance <= reach || b.least > reach; };
  return !(search(pair.cone, pair.other, pair.size, isDecided).least > reach);
}
template bool coneWithin(const Segment&, const Segment&, double, double);
template bool coneWithin(const Segment&, const Triangle&, double, double);
template bool coneWithin(const Segment&, const Obstacle&, double, double);

ClosestPoints closestOfCone(const Segment& cone, const Segment& other) {
  return closest(cone, other);
}
ClosestOnTriangle closestOfCone(const Segment& cone, const Triangle& triangle) {
  return closest(cone, triangle);
}
ClosestOnBox closestOfCone(const Segment& cone, const Obstacle& box) { return closest(cone, box); }

double leastDistanceOfCone(const Segment& cone, const Triangle& triangle) {
  const Pair<Triangle> pair(cone, triangle);
  if (!pair.hasSize()) return 0;
  const double radius = pair.cone.radius;
  const auto isTight = [&](const auto& b) {
    return b.distance - b.least <= 0x1p-28 * (b.distance + radius);
  };
  const double least =
      search(pair.cone, pair.other, pair.size, isTight).least - 8 * kEps * pair.size;
  // The difference to the radius of the capsule is rounded twice.
  return std::max(least + radius - 4 * kEps * (std::fabs(least) + radius), 0.0) / pair.scale;
}

NearestToPolytope nearestOfCone(const Segment& cone, const Obstacle& obstacle) {
  const Pair<Obstacle> pair(cone, obstacle);
  const auto ball = pair.nearestBall();
  const Vec3d& n = ball.near.direction;
  const double least = std::min(dot(n, pair.cone.a), dot(n, pair.cone.b));
  return {ball.s, ball.near.length, n, least - mostAlong(n, pair.other)};
}

}  // namespace fcl_fibers::geometry
