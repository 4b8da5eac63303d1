// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/cone_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/least_distance.h"
#include "geometry/polytope_vertices.h"

namespace fcl_fibers::geometry {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();

// What the search asks of each shape.

/// The shape relative to its own first point, which costs no more than a rounding of differences.
///@{
Segment atOrigin(const Segment& s, const Vec3d& from) {
  return {s.a - from, s.b - from, s.radius, s.taper};
}
Segment atOrigin(const Segment& s) { return atOrigin(s, s.a); }
Triangle atOrigin(const Triangle& t) { return {{0, 0, 0}, t.b - t.a, t.c - t.a}; }
Obstacle atOrigin(Obstacle obstacle) {
  obstacle.point = {0, 0, 0};
  return obstacle;
}
const Vec3d& originOf(const Segment& s) { return s.a; }
const Vec3d& originOf(const Triangle& t) { return t.a; }
const Vec3d& originOf(const Obstacle& obstacle) { return obstacle.point; }
///@}

/// The sum of the 1-norms of a shape's vectors and of its radii.
///@{
double extentOf(const Segment& s) {
  return norm1(s.b - s.a) + std::max(s.radius, std::fabs(s.taper));
}
double extentOf(const Triangle& t) { return norm1(t.b - t.a) + norm1(t.c - t.a); }
double extentOf(const Obstacle& obstacle) { return 2 * norm1(reachOfVectors(obstacle)); }
///@}
/// This sum of a pair, by which rounding is bounded, with that of the differences in between.
template <class Other>
double sizeOf(const Segment& cone, const Other& other) {
  return norm1(cone.a - originOf(other)) + extentOf(cone) + extentOf(other);
}

double largestOf(const Segment& s) { return std::max({maxNorm(s.a), maxNorm(s.b), s.radius}); }
double largestOf(const Triangle& t) { return std::max({maxNorm(t.a), maxNorm(t.b), maxNorm(t.c)}); }
double largestOf(const Obstacle& obstacle) {
  return maxNorm(obstacle.point) + norm1(reachOfVectors(obstacle));
}

/// Whether products of six lengths of this size neither overflow nor vanish.
bool isWellScaled(double m) { return m > 0x1p-150 && m < 0x1p150; }
template <class Other>
double scaleFor(const Segment& cone, const Other& other, double m) {
  return scaleForSize(m, std::max(largestOf(cone), largestOf(other)));
}

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
  const double vv = squaredNorm(v), rest = vv - s.taper * s.taper;
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
  return {{}, nearest.distance, nearest.distance, nearest.direction};
}

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
template <class Other, class IsEnough>
auto search(const Segment& cone, const Other& other, double m, IsEnough&& isEnough) {
  constexpr int kMostRounds = 64;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Vec3d along = cone.b - cone.a;
  // The lines on both sides of the nearest ball, and those before them.
  Line lines[2] = {{0, -kInfinity, 0}, {1, -kInfinity, 0}}, before[2] = {lines[0], lines[1]};
  double least = kInfinity, lowest = kInfinity, next = 0;
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
    best.least = least = std::min(least, gap);
    const int side = line.slope > 0 ? 1 : 0;
    before[side] = lines[side];
    lines[side] = line;
    const double width = lines[1].at - lines[0].at;
    if (line.slope == 0 || !(width > 0)) break;
    double crossing =
        (lines[1].gapAt(lines[0].at) - lines[0].gap) / (lines[0].slope - lines[1].slope);
    crossing = lines[0].at + std::min(std::max(crossing, 0.0), width);
    best.least = std::min({least, lines[0].gapAt(crossing), lines[1].gapAt(crossing)});
    if (isEnough(best) || width <= kEps) break;
    if (round == 0) {
      next = 1;
      continue;
    }
    // The slope may jump, or change on one side alone. There it is the steeper one.
    const int steep = lines[1].slope > -lines[0].slope ? 1 : 0;
    const Line& second = before[steep].isKnown() ? before[steep] : lines[1 - steep];
    next = round % 2 == 1 ? lines[steep].rootWith(second) : crossing;
    if (!(next > lines[0].at && next < lines[1].at)) next = lines[0].at + 0.5 * width;
  }
  return best;
}

template <class Other>
bool within(const Segment& cone, const Other& other, double margin, double error) {
  const double m = sizeOf(cone, other);
  if (m == 0 || !std::isfinite(m)) return true;
  if (!isWellScaled(m)) {
    const double scale = scaleFor(cone, other, m);
    return within(scaled(cone, scale), scaled(other, scale), scale * margin, scale * error);
  }
  // The gap carries 8 eps of the size: 6 of differences, products and radii, 2 of the direction.
  const double reach = margin + error + 4 * kEps * std::fabs(margin) + 8 * kEps * m;
  const auto isDecided = [&](const auto& b) { return b.distance <= reach || b.least > reach; };
  return !(search(atOrigin(cone, originOf(other)), atOrigin(other), m, isDecided).least > reach);
}

/// The direction is as certain as the length of the way lets it be.
template <class Other>
auto nearestBall(const Segment& cone, const Other& other, double m) {
  const auto isNearest = [&](const auto& b) {
    return b.distance - b.least <= 32 * kEps * m &&
           std::fabs(b.slope) * b.near.length <= 2 * kEps * m * (m + b.near.length);
  };
  return search(atOrigin(cone, originOf(other)), atOrigin(other), m, isNearest);
}

template <class Other>
auto closest(const Segment& cone, const Other& other) {
  using Closest = decltype(nearestOn(other, cone.a).closest);
  const double m = sizeOf(cone, other);
  if (m == 0 || std::isnan(m) || !std::isfinite(largestOf(cone) + largestOf(other))) {
    Closest none{};
    if (m != 0) none.apart.x = std::numeric_limits<double>::infinity();
    return none;
  }
  if (!isWellScaled(m)) {
    const double scale = scaleFor(cone, other, m);
    Closest found = closest(scaled(cone, scale), scaled(other, scale));
    found.apart = (1 / scale) * found.apart;
    return found;
  }
  const auto ball = nearestBall(cone, other, m);
  Closest found = ball.near.closest;
  found.s = ball.s;
  return found;
}

}  // namespace

bool coneWithin(const Segment& cone, const Segment& other, double margin, double error) {
  return within(cone, other, margin, error);
}
bool coneWithin(const Segment& cone, const Triangle& triangle, double margin, double error) {
  return within(cone, triangle, margin, error);
}
bool coneWithin(const Segment& cone, const Obstacle& obstacle, double margin, double error) {
  return within(cone, obstacle, margin, error);
}

ClosestPoints closestOfCone(const Segment& cone, const Segment& other) {
  return closest(cone, other);
}
ClosestOnTriangle closestOfCone(const Segment& cone, const Triangle& triangle) {
  return closest(cone, triangle);
}
ClosestOnBox closestOfCone(const Segment& cone, const Obstacle& box) { return closest(cone, box); }

double leastDistanceOfCone(const Segment& cone, const Triangle& triangle) {
  const double m = sizeOf(cone, triangle);
  if (m == 0 || !std::isfinite(m)) return 0;
  if (!isWellScaled(m)) {
    const double scale = scaleFor(cone, triangle, m);
    return leastDistanceOfCone(scaled(cone, scale), scaled(triangle, scale)) / scale;
  }
  const auto isTight = [&](const auto& b) {
    return b.distance - b.least <= 0x1p-28 * (b.distance + cone.radius);
  };
  const auto ball = search(atOrigin(cone, triangle.a), atOrigin(triangle), m, isTight);
  const double least = ball.least - 8 * kEps * m;
  // The difference to the radius of the capsule is rounded twice.
  return std::max(least + cone.radius - 4 * kEps * (std::fabs(least) + cone.radius), 0.0);
}

NearestToPolytope nearestOfCone(const Segment& cone, const Obstacle& obstacle) {
  const auto ball = nearestBall(cone, obstacle, sizeOf(cone, obstacle));
  const Vec3d& n = ball.near.direction;
  const double least = std::min(dot(n, cone.a - obstacle.point), dot(n, cone.b - obstacle.point));
  return {ball.s, ball.near.length, n, least - mostAlong(n, atOrigin(obstacle))};
}

}  // namespace fcl_fibers::geometry
