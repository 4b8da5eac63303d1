// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/cone_box.h"

#include <algorithm>
#include <limits>

#include "geometry/segment_distance.h"

namespace fcl_fibers::geometry {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();

/// Calls take(k, side, edge) for each edge of a box, relative to the box's point. It is along
/// vector k, and side[i] is its side along each other vector, -1 or 1.
template <class Take>
void forEachEdge(const Obstacle& box, Take&& take) {
  const auto& v = box.vector;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    for (int corner = 0; corner < 4; ++corner) {
      double side[3] = {};
      side[i] = (corner & 1) == 0 ? -1 : 1;
      side[j] = (corner & 2) == 0 ? -1 : 1;
      const Vec3d middle = side[i] * v[i] + side[j] * v[j];
      take(k, side, Segment{middle - v[k], middle + v[k], 0});
    }
  }
}

Segment relativeTo(const Vec3d& point, Segment cone) {
  cone.a = cone.a - point;
  cone.b = cone.b - point;
  return cone;
}

}  // namespace

bool coneTouchesBox(const Segment& cone, const Obstacle& box, double margin, double error) {
  const double at_a = cone.radiusAtA(), at_b = cone.radiusAtB();
  const double inexact = error + 4 * kEps * cone.radius;  // due to the radii at the ends
  const auto touches = [&](const Vec3d& a, const Vec3d& b, double radius) {
    return touch(Segment{a, b, radius}, box, margin, inexact);
  };
  if (!touches(cone.a, cone.b, cone.radius)) return false;
  if (touches(cone.a, cone.b, std::min(at_a, at_b)) || touches(cone.a, cone.a, at_a) ||
      touches(cone.b, cone.b, at_b)) {
    return true;
  }
  const Segment relative = relativeTo(box.point, cone);
  double size = norm1(relative.a) + norm1(relative.b);
  for (const Vec3d& v : box.vector) size += norm1(v);
  const double errors = inexact + box.error + 4 * kEps * size;  // due to differences and corners
  bool is_within = false;
  forEachEdge(box, [&](int, const double(&)[3], const Segment& edge) {
    is_within = is_within || conesWithin(relative, edge, margin + box.margin, errors);
  });
  return is_within;
}

ClosestOnBox closestOfCone(const Segment& cone, const Obstacle& box) {
  ClosestOnBox best{};
  double least = std::numeric_limits<double>::infinity();
  const auto consider = [&](const ClosestOnBox& found) {
    const double distance = safeNorm(found.apart) - cone.radiusAt(found.s);
    if (!(distance < least)) return;
    least = distance;
    best = found;
  };
  consider(closestPoints({cone.a, cone.b, 0}, box));
  for (const double s : {0.0, 1.0}) {
    const Vec3d& end = s == 0 ? cone.a : cone.b;
    ClosestOnBox found = closestPoints({end, end, 0}, box);
    found.s = s;
    consider(found);
  }
  const Segment relative = relativeTo(box.point, cone);
  forEachEdge(box, [&](int k, const double(&side)[3], const Segment& edge) {
    const ClosestPoints found = closestPoints(relative, edge);
    ClosestOnBox on_box{found.s, {side[0], side[1], side[2]}, found.apart};
    on_box.t[k] = 2 * found.t - 1;
    consider(on_box);
  });
  return best;
}

}  // namespace fcl_fibers::geometry
