// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/impact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/advancement.h"
#include "geometry/touch.h"

namespace fcl_fibers::geometry {
namespace {

Instant<2> instant(const Segment& p, const Segment& q, double reach) {
  return {{p.a, p.b}, {q.a, q.b}, p.thickness() + q.thickness(), reach};
}

/// The times at which a gap that changes linearly is at most `margin`, leaning outward.
struct Times {
  double first, last;

  void whileWithin(double start, double end, double margin) {
    const double from = start - margin, to = end - margin;
    // NaN, as of a box without bounds, excludes no time.
    if (!(from > 0) && !(to > 0)) return;
    constexpr double kEps = std::numeric_limits<double>::epsilon();
    const double error = 4 * kEps * (std::fabs(start) + std::fabs(end) + std::fabs(margin));
    const double fall = std::fabs(to - from);
    if (!(std::isfinite(fall) && fall > 0)) {
      if (from > error && to > error) last = -1;
      return;
    }
    if (from > error) first = std::max(first, to < from ? (from - error) / fall * (1 - kEps) : 2);
    if (to > error) last = std::min(last, to > from ? 1 - (to - error) / fall * (1 - kEps) : -1);
  }
};

bool findBoxImpact(const MovingSegment& p, const MovingSegment& q, double margin, double from,
                   Impact& impact) {
  Times times{from, 1};
  for (const auto axis : kAxes) {
    const BoxGaps start = boxGaps(p.start, q.start, axis), end = boxGaps(p.end, q.end, axis);
    times.whileWithin(start.above, end.above, margin);
    times.whileWithin(start.below, end.below, margin);
  }
  impact = {times.first, 0, 0};
  return times.first <= times.last;
}

bool find(const MovingSegment& p, const MovingSegment& q, double margin, double error, double from,
          bool only_nearer, Impact& impact) {
  Arrival<2> arrival;
  const bool found = findArrival(
      instant(p.start, q.start, reachOf(p.start, q.start, margin, error)),
      instant(p.end, q.end, reachOf(p.end, q.end, margin, error)), from, only_nearer, arrival);
  if (found) impact = {arrival.time, arrival.s, arrival.weight[1]};
  return found;
}

}  // namespace

bool findImpact(const MovingSegment& p, const MovingSegment& q, double margin, double error,
                double from, Impact& impact) {
  if (isBox(p) || isBox(q)) return findBoxImpact(p, q, margin + error, from, impact);
  return find(p, q, margin, error, from, /*only_nearer=*/false, impact);
}

bool findApproach(const MovingSegment& p, const MovingSegment& q, double margin, double error,
                  double from, Impact& impact) {
  return find(p, q, margin, error, from, /*only_nearer=*/true, impact);
}

double impactTolerance(const MovingSegment& p, const MovingSegment& q) {
  return toleranceFor(sizeOf(instant(p.start, q.start, 0), instant(p.end, q.end, 0)));
}

}  // namespace fcl_fibers::geometry
