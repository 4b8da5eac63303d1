// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "geometry/segment.h"
#include "geometry/triangle.h"

namespace fcl_fibers::geometry {

/// What changes linearly during a step, which lasts from time 0 to time 1: the ends and the radius
/// of a segment, or the corners of a triangle.
template <class T>
struct Moving {
  T start, end;
};
using MovingSegment = Moving<Segment>;
using MovingTriangle = Moving<Triangle>;

inline bool rests(const MovingSegment& s) { return s.start == s.end; }

/// Whether the segment counts by boxes, because it is one at the start or at the end.
inline bool isBox(const MovingSegment& s) { return s.start.isBox() || s.end.isBox(); }

inline bool isTapered(const MovingSegment& s) { return s.start.isTapered() || s.end.isTapered(); }

inline Vec3d between(const Vec3d& start, const Vec3d& end, double time) {
  return (1 - time) * start + time * end;
}

/// The segment or triangle at a time.
inline Segment at(const MovingSegment& s, double time) {
  const Vec3d a = between(s.start.a, s.end.a, time), b = between(s.start.b, s.end.b, time);
  const auto radius = [time](double start, double end) { return (1 - time) * start + time * end; };
  if (!isTapered(s)) return {a, b, radius(s.start.radius, s.end.radius)};
  return Segment::cone(a, b, radius(s.start.radiusAtA(), s.end.radiusAtA()),
                       radius(s.start.radiusAtB(), s.end.radiusAtB()));
}
inline Triangle at(const MovingTriangle& t, double time) {
  return {between(t.start.a, t.end.a, time), between(t.start.b, t.end.b, time),
          between(t.start.c, t.end.c, time)};
}

/// A box around the whole step.
inline Segment aroundStep(const MovingSegment& s) {
  const Segment p = boxAround(s.start, 0), q = boxAround(s.end, 0);
  return Segment::box(min(p.a, q.a), max(p.b, q.b));
}

/// Bounds how far the stored end points lie from those that poses and length define, at any time.
inline double endPointError(const MovingSegment& s) {
  return std::max(endPointError(s.start), endPointError(s.end));
}

}  // namespace fcl_fibers::geometry
