// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/impact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/advancement.h"
#include "geometry/impact_pairs.h"
#include "geometry/touch.h"
#include "geometry/triangle_distance.h"

namespace fcl_fibers::geometry {
namespace {

/// @param reach  how near two capsules have to be
Instant<2> instant(const Segment& p, const Segment& q, double reach) {
  const double less = std::max(p.taper, 0.0) + std::max(q.taper, 0.0);
  return {{p.a, p.b},   {q.a, q.b}, p.thickness() + q.thickness() - less,
          reach - less, p.taper,    q.taper};
}
Instant<3> instant(const Segment& p, const Triangle& q, double reach) {
  const double less = std::max(p.taper, 0.0);
  return {{p.a, p.b}, {q.a, q.b, q.c}, p.radius - less, reach - less, p.taper};
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

template <class Hull, int K>
bool find(const MovingSegment& p, const Moving<Hull>& q, double margin, double error, double from,
          bool only_nearer, Arrival<K>& arrival) {
  return findArrival(instant(p.start, q.start, reachOf(p.start, q.start, margin, error)),
                     instant(p.end, q.end, reachOf(p.end, q.end, margin, error)), from, only_nearer,
                     arrival);
}

bool find(const MovingSegment& p, const MovingSegment& q, double margin, double error, double from,
          bool only_nearer, Impact& impact) {
  Arrival<2> arrival;
  const bool found = find(p, q, margin, error, from, only_nearer, arrival);
  if (found) impact = {arrival.time, arrival.s, arrival.weight[1]};
  return found;
}

void setRow(ImpactRows::Instant& rows, int lane, const Pose<2>& pose, double reach) {
  const double numbers[] = {pose.w.x,    pose.w.y, pose.w.z,    pose.u.x,
                            pose.u.y,    pose.u.z, pose.v[0].x, pose.v[0].y,
                            pose.v[0].z, reach,    pose.taper,  pose.corner_taper};
  for (int i = 0; i < ImpactRows::kNumbers; ++i) rows[i][lane] = numbers[i];
}

void setPair(ImpactRows& rows, int lane, const ImpactQuery<Segment>& query) {
  const auto& [p, q, margin, error, from] = query;
  const Instant<2> start = instant(p.start, q.start, reachOf(p.start, q.start, margin, error));
  const Instant<2> end = instant(p.end, q.end, reachOf(p.end, q.end, margin, error));
  setRow(rows.start, lane, Pose<2>(start), start.reach);
  setRow(rows.end, lane, Pose<2>(end), end.reach);
  rows.from[lane] = from;
  rows.arrival[lane] = toleranceFor(sizeOf(start, end)) / 2;
}

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

}  // namespace

bool findImpact(const MovingSegment& p, const MovingSegment& q, double margin, double error,
                double from, Impact& impact) {
  if (isBox(p) || isBox(q)) return findBoxImpact(p, q, margin + error, from, impact);
  return find(p, q, margin, error, from, /*only_nearer=*/false, impact);
}
bool findImpact(const MovingSegment& p, const MovingTriangle& q, double margin, double error,
                double from, TriangleImpact& impact) {
  if (!isBox(p)) return find(p, q, margin, error, from, /*only_nearer=*/false, impact);
  Impact of_boxes;
  const MovingSegment box{boxAround(q.start), boxAround(q.end)};
  if (!findBoxImpact(p, box, margin + error, from, of_boxes)) return false;
  impact = {of_boxes.time, 0, {1, 0, 0}};
  return true;
}

std::uint32_t findImpacts(const ImpactQuery<Triangle>* queries, int count, Impact* impacts) {
  std::uint32_t found = 0;
  for (int i = 0; i < count; ++i) {
    const auto& [p, q, margin, error, from] = queries[i];
    TriangleImpact impact;
    if (!findImpact(p, q, margin, error, from, impact)) continue;
    impacts[i] = {impact.time, impact.s, 0};
    found |= 1u << i;
  }
  return found;
}

std::uint32_t findImpacts(const ImpactQuery<Segment>* queries, int count, Impact* impacts) {
  static_assert(kImpactsAtOnce == ImpactRows::kLanes);
  std::uint32_t found = 0, capsules = 0, cones = 0;
  const auto findOne = [&](int i, double from) {
    const auto& [p, q, margin, error, unused] = queries[i];
    if (findImpact(p, q, margin, error, from, impacts[i])) found |= 1u << i;
  };
  for (int i = 0; i < count; ++i) {
    const auto& [p, q, margin, error, from] = queries[i];
    if (isBox(p) || isBox(q)) {
      findOne(i, from);
    } else {
      (isTapered(p) || isTapered(q) ? cones : capsules) |= 1u << i;
    }
  }
  // A pair has the same answer in any company.
  for (const bool may_taper : {false, true}) {
    const std::uint32_t chosen = may_taper ? cones : capsules;
    if (chosen == 0) continue;
    ImpactRows rows{};
    rows.may_taper = may_taper;
    for (std::uint32_t rest = chosen; rest != 0; rest &= rest - 1) {
      const int i = __builtin_ctz(rest);
      setPair(rows, i, queries[i]);
    }
    advance(rows);
    for (std::uint32_t rest = chosen; rest != 0; rest &= rest - 1) {
      const int i = __builtin_ctz(rest);
      const std::uint32_t bit = 1u << i;
      if ((rows.arrived & bit) != 0) {
        impacts[i] = {rows.from[i], rows.s[i], rows.t[i]};
        found |= bit;
      } else if ((rows.apart & bit) == 0) {
        findOne(i, rows.from[i]);
      }
    }
  }
  return found;
}

bool findApproach(const MovingSegment& p, const MovingSegment& q, double margin, double error,
                  double from, Impact& impact) {
  return find(p, q, margin, error, from, /*only_nearer=*/true, impact);
}
bool findApproach(const MovingSegment& p, const MovingTriangle& q, double margin, double error,
                  double from, TriangleImpact& impact) {
  return find(p, q, margin, error, from, /*only_nearer=*/true, impact);
}

double impactTolerance(const MovingSegment& p, const MovingSegment& q) {
  return toleranceFor(sizeOf(instant(p.start, q.start, 0), instant(p.end, q.end, 0)));
}
double impactTolerance(const MovingSegment& p, const MovingTriangle& q) {
  return toleranceFor(sizeOf(instant(p.start, q.start, 0), instant(p.end, q.end, 0)));
}

}  // namespace fcl_fibers::geometry
