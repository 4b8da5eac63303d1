// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "geometry/segment.h"
#include "geometry/sphere.h"
#include "support/exact_geometry.h"

// What tests of geometry/ and tree/ share.
namespace fcl_fibers::geometry {

inline Vec3d fromEigen(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
inline test::Point toPoint(const Vec3d& v) { return {v.x, v.y, v.z}; }
inline test::Point centerOf(const Sphere& sphere) {
  return {sphere.center[0], sphere.center[1], sphere.center[2]};
}

inline test::Real axisDistance(const Segment& p, const Segment& q) {
  return test::segmentDistance(toPoint(p.a), toPoint(p.b), toPoint(q.a), toPoint(q.b));
}
inline test::Real capsuleDistance(const Segment& p, const Segment& q) {
  return axisDistance(p, q) - test::Real(p.radius) - test::Real(q.radius);
}

}  // namespace fcl_fibers::geometry
