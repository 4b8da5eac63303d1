// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include <fcl_fibers/tree_export.h>

#include "geometry/affine_map.h"

namespace fcl_fibers::geometry {

/// The least boxes of points. `posed` is that under the linear part of a map, with the rounding of
/// AffineMap::linear().
struct PointBoxes {
  Vec3d low, high;
  Vec3d posed_low, posed_high;
  bool is_proper;  ///< whether there are points, all of them finite; else the boxes mean nothing
};

/// @param points  x, y and z of each, one after the other
FCL_FIBERS_TREE_EXPORT PointBoxes boxesOf(const double* points, std::size_t count,
                                          const AffineMap& map);
FCL_FIBERS_TREE_EXPORT PointBoxes boxesOf(const float* points, std::size_t count,
                                          const AffineMap& map);

}  // namespace fcl_fibers::geometry
