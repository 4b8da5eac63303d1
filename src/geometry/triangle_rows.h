// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "geometry/triangle_distance.h"
#include "simd/lanes.h"

namespace fcl_fibers::geometry {

/// Pairs of an axis and a triangle, side by side for a search of their closest points in double.
struct TriangleRows {
  static constexpr int kLanes = static_cast<int>(kClosestAtOnce);

  /// The axes x, y and z of one vector of each pair.
  using Vectors = double[3][kLanes];
  alignas(64) Vectors w;            ///< from the first corner to the axis's first end
  alignas(64) Vectors u;            ///< along the axis
  alignas(64) Vectors v1, v2;       ///< from the first corner to the second and to the third
  alignas(64) double size[kLanes];  ///< the sum of the 1-norms of these vectors

  // The points w + s u and x v1 + y v2, relative to the first corner.
  alignas(64) double s[kLanes], x[kLanes], y[kLanes];
  alignas(64) Vectors apart;  ///< from the triangle's point to the axis's
};

/// Finds the closest points of pairs whose sizes are from 2^-150 to 2^150.
/// @param count  of pairs; if there are more than one, all lanes have to be set
/// @return the lanes that are certain: as near to each other as the closest ones, up to 32 eps of
///         the size; `apart` is within 10 eps of the size of the vector between them, and all of
///         the axis lies beyond all of the triangle along it by its length, up to 16 eps of the
///         size
simd::LaneMask findClosest(TriangleRows& rows, std::size_t count);

}  // namespace fcl_fibers::geometry
