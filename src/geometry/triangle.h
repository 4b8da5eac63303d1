// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "geometry/segment.h"

namespace fcl_fibers::geometry {

/// Three corners. They may be on one line or at one point.
struct Triangle {
  Vec3d a, b, c;
};
inline Triangle scaled(const Triangle& t, double scale) {
  return {scale * t.a, scale * t.b, scale * t.c};
}
inline Segment boxAround(const Triangle& t) {
  return Segment::box(min(min(t.a, t.b), t.c), max(max(t.a, t.b), t.c));
}

/// A point of a mesh, which is loaded as one vector.
struct alignas(32) MeshPoint {
  double numbers[4];  ///< x, y, z, and 0
};

/// The indices of a triangle's points.
struct TriangleIndices {
  std::int32_t a, b, c;
};

inline Vec3d toVec3d(const MeshPoint& p) { return {p.numbers[0], p.numbers[1], p.numbers[2]}; }

}  // namespace fcl_fibers::geometry
