// SPDX-License-Identifier: BSD-3-Clause
#include "support/exact_within.h"

namespace fcl_fibers::test {
namespace {

/// Whether the point x and the segment from 0 to v are that near.
bool pointWithin(const Vector<Integer>& x, const Vector<Integer>& v, const Integer& reach_squared) {
  const Integer along = dot(x, v), length_squared = dot(v, v);
  if (along <= 0) return dot(x, x) <= reach_squared;
  if (along >= length_squared) {
    const Vector<Integer> from_end = x - v;
    return dot(from_end, from_end) <= reach_squared;
  }
  const Vector<Integer> normal = cross(x, v);
  return dot(normal, normal) <= reach_squared * length_squared;
}

}  // namespace

/// |w + s u - t v| is convex over the unit square, so its minimum is inside, where it is the
/// distance of the lines, or on an edge, where one of the two is at an end.
bool segmentsWithin(const Vector<Integer>& w, const Vector<Integer>& u, const Vector<Integer>& v,
                    const Integer& reach) {
  if (reach < 0) return false;
  const Integer reach_squared = reach * reach;
  const Vector<Integer> zero{};
  if (pointWithin(w, v, reach_squared) || pointWithin(w + u, v, reach_squared) ||
      pointWithin(zero - w, u, reach_squared) || pointWithin(v - w, u, reach_squared)) {
    return true;
  }
  const Vector<Integer> normal = cross(u, v);
  const Integer determinant = dot(normal, normal);
  if (determinant == 0) return false;
  const Integer uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
  const Integer s = uv * vw - vv * uw, t = uu * vw - uv * uw;
  if (s < 0 || s > determinant || t < 0 || t > determinant) return false;
  const Integer height = dot(w, normal);
  return height * height <= reach_squared * determinant;
}

bool insideWithin(const Vector<Integer>& w, const Vector<Integer>& u, const Vector<Integer>& v1,
                  const Vector<Integer>& v2, const Integer& reach) {
  const Vector<Integer> normal = cross(v1, v2);
  const Integer area = dot(normal, normal);
  if (area == 0) return false;
  // Of the point p / divisor.
  const auto isOver = [&](const Vector<Integer>& p, const Integer& divisor) {
    const Integer x = dot(cross(p, v2), normal), y = dot(cross(v1, p), normal);
    return x >= 0 && y >= 0 && x + y <= area * divisor;
  };
  const Vector<Integer> end = w + u;
  const Integer from = dot(normal, w), to = dot(normal, end);
  const Integer most = reach * reach * area;
  if (from * from <= most && isOver(w, 1)) return true;
  if (to * to <= most && isOver(end, 1)) return true;
  if (from == to || from * to > 0) return false;
  const Integer sign = from > to ? 1 : -1, divisor = sign * (from - to);
  return isOver(divisor * w + Integer(sign * from) * u, divisor);
}

}  // namespace fcl_fibers::test
