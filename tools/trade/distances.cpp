// SPDX-License-Identifier: BSD-3-Clause
#include "tools/trade/distances.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>

namespace fcl_fibers::tools::trade {
namespace {

constexpr Real kInfinity = std::numeric_limits<Real>::infinity();
constexpr int kCuts = 72;  ///< of an interval, after which 2^-64 of it is left
constexpr Real kDigits = 0x1p-58;

Vector onAxis(const Vector& from, const Vector& to, const Vector& x) {
  const Vector along = to - from;
  const Real squared = dot(along, along);
  if (!(squared > 0)) return from;
  return from + std::clamp<Real>(dot(along, x - from) / squared, 0, 1) * along;
}

Vector placeAt(const Axis& axis, Real s) { return between(axis.from, axis.to, s); }
Real radiusAt(const Axis& axis, Real s) { return axis.radius + s * axis.taper; }

/// Where the ball of a segment is that is nearest to a point: towards the larger end from the foot
/// of the point, so far that the surface is met at a right angle.
Real nearestBall(const Axis& axis, const Vector& x) {
  const Vector along = axis.to - axis.from;
  const Real length = norm(along);
  if (!(length > std::abs(axis.taper))) return axis.taper > 0 ? 1 : 0;
  const Vector unit = (1 / length) * along;
  const Real foot = dot(unit, x - axis.from);
  const Real away = norm(x - axis.from - foot * unit);
  const Real cosine = std::sqrt((length - axis.taper) * (length + axis.taper));
  return std::clamp<Real>((foot + away * axis.taper / cosine) / length, 0, 1);
}

/// The least gap of a convex function of the place along a segment.
/// @param partner  the ball of the partner that is nearest to that of the segment at a place
template <class Partner>
Gap leastGap(const Axis& axis, const Partner& partner) {
  const auto at = [&](Real s) {
    const Vector p = placeAt(axis, s);
    const auto [q, radius_q] = partner(p);
    const Real radius = radiusAt(axis, s);
    return Gap{norm(p - q) - radius - radius_q, p, q, radius, radius_q};
  };
  Gap best = at(0);
  const auto keep = [&best](const Gap& gap) {
    if (gap.gap < best.gap) best = gap;
  };
  keep(at(1));
  const Vector along = axis.to - axis.from;
  Real low = 0, high = 1;
  for (int i = 0; i < kCuts && low < high; ++i) {
    // Not the middle, where axes of round numbers may cross, so that the slope is not known.
    const Real s = low + 0.4641L * (high - low);
    const Gap gap = at(s);
    keep(gap);
    const Vector way = gap.p - gap.q;
    const bool rises = dot(way, along) >= axis.taper * norm(way);
    (rises ? high : low) = s;
  }
  // Around the least value many gaps are equal to their last digits, and this place is the best.
  const Gap last = at(high);
  const Real scale = norm(last.p - last.q) + last.radius_p + last.radius_q;
  return last.gap - best.gap <= kDigits * scale ? last : best;
}

void keepNearer(Closest& best, const Vector& p, const Vector& q) {
  const Real distance = norm(p - q);
  if (distance < best.distance) best = {distance, p, q};
}

}  // namespace

Closest closest(const Axis& a, const Axis& b) {
  Closest best{kInfinity, a.from, b.from};
  for (const Vector& p : {a.from, a.to}) keepNearer(best, p, onAxis(b.from, b.to, p));
  for (const Vector& q : {b.from, b.to}) keepNearer(best, onAxis(a.from, a.to, q), q);
  const Vector along = b.to - b.from, normal = cross(a.to - a.from, along);
  const Real squared = dot(normal, normal);
  if (squared > 0) {
    const Real s = dot(cross(b.from - a.from, along), normal) / squared;
    if (s > 0 && s < 1) {
      const Vector q = onAxis(b.from, b.to, between(a.from, a.to, s));
      keepNearer(best, onAxis(a.from, a.to, q), q);
    }
  }
  return best;
}

Closest closest(const Axis& axis, const std::array<Vector, 3>& triangle) {
  Closest best{kInfinity, axis.from, triangle[0]};
  const Vector normal = cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
  const Real squared = dot(normal, normal);
  // Whether the foot of a point on the plane is in the triangle.
  const auto isInside = [&](const Vector& x) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector &p = triangle[k], &q = triangle[(k + 1) % 3];
      if (dot(cross(q - p, x - p), normal) < 0) return false;
    }
    return true;
  };
  for (std::size_t k = 0; k < 3; ++k) {
    const Closest edge = closest(axis, Axis{triangle[k], triangle[(k + 1) % 3], 0});
    if (edge.distance < best.distance) best = edge;
  }
  if (!(squared > 0)) return best;
  const Real from = dot(axis.from - triangle[0], normal), to = dot(axis.to - triangle[0], normal);
  for (const auto& [end, height] : {std::pair(axis.from, from), std::pair(axis.to, to)}) {
    if (isInside(end)) keepNearer(best, end, end - (height / squared) * normal);
  }
  if ((from < 0) != (to < 0)) {
    const Vector crossing = between(axis.from, axis.to, from / (from - to));
    if (isInside(crossing)) best = {0, crossing, crossing};
  }
  return best;
}

Gap gapOf(const Axis& a, const Axis& b) {
  if (a.taper == 0 && b.taper == 0) {
    const Closest near = closest(a, b);
    return {near.distance - a.radius - b.radius, near.p, near.q, a.radius, b.radius};
  }
  return leastGap(a, [&b](const Vector& p) {
    const Real t = nearestBall(b, p);
    return std::pair(placeAt(b, t), radiusAt(b, t));
  });
}

Gap gapOf(const Axis& axis, const std::array<Vector, 3>& triangle) {
  if (axis.taper == 0) {
    const Closest near = closest(axis, triangle);
    return {near.distance - axis.radius, near.p, near.q, axis.radius, 0};
  }
  return leastGap(axis, [&triangle](const Vector& p) {
    return std::pair(closest(Axis{p, p, 0}, triangle).q, Real{0});
  });
}

}  // namespace fcl_fibers::tools::trade
