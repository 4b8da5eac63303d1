// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::io {

inline double dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

inline Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline double norm(const Point& p) { return std::hypot(p[0], p[1], p[2]); }

inline double distance(const Point& p, const Point& q) {
  return norm({q[0] - p[0], q[1] - p[1], q[2] - p[2]});
}

}  // namespace fcl_fibers::io
