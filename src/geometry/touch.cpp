// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/touch.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "geometry/cone_distance.h"
#include "geometry/segment_distance.h"

namespace fcl_fibers::geometry {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();

struct Interval {
  double low, high;
};

Interval extent(const Segment& s, double Vec3d::*axis) {
  const auto [low, high] = std::minmax(s.a.*axis, s.b.*axis);
  return {low - s.thickness(), high + s.thickness()};
}

double finiteOrZero(double x) { return std::isfinite(x) ? x : 0; }

}  // namespace

BoxGaps boxGaps(const Segment& p, const Segment& q, double Vec3d::*axis) {
  const Interval i = extent(p, axis), j = extent(q, axis);
  const double error = finiteOrZero(endPointError(p)) + finiteOrZero(endPointError(q)) +
                       4 * kEps * (p.thickness() + q.thickness());
  return {i.low - j.high - error, j.low - i.high - error};
}

double reachOf(const Segment& p, const Segment& q, double margin, double error) {
  return (p.radius + q.radius + margin) * (1 + 4 * kEps) + error;
}

bool touch(const Segment& p, const Segment& q, double margin, double error) {
  if (p.isBox() || q.isBox()) return boxesTouch(p, q, margin + error);
  if (p.isTapered() || q.isTapered()) return coneWithin(p, q, margin, error);
  return axesWithin(p, q, reachOf(p, q, margin, error));
}

bool boxesTouch(const Segment& p, const Segment& q, double margin) {
  return std::all_of(std::begin(kAxes), std::end(kAxes), [&](auto axis) {
    const BoxGaps gaps = boxGaps(p, q, axis);
    return !(std::max(gaps.above, gaps.below) > margin);
  });
}

bool isNear(const Box& volume, const Segment& box, double margin) {
  const double error = finiteOrZero(endPointError(box)) + 4 * kEps * box.thickness();
  for (int i = 0; i < 3; ++i) {
    const auto [low, high] = extent(box, kAxes[i]);
    const double above = double{volume.low[i]} - high - error, below = low - volume.high[i] - error;
    // A volume is rounded outward by more than these differences are.
    if (above > margin || below > margin) return false;
  }
  return true;
}

}  // namespace fcl_fibers::geometry
