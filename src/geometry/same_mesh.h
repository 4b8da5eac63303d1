// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include <fcl_fibers/tree_export.h>

#include "geometry/triangle.h"

namespace fcl_fibers::geometry {

// Whether a program's mesh is the one that was read, many numbers at a time. -0 equals 0, and NaN
// equals nothing.

/// @param numbers  three for each of `count` points
///@{
FCL_FIBERS_TREE_EXPORT bool arePoints(const MeshPoint* points, const double* numbers,
                                      std::size_t count);
FCL_FIBERS_TREE_EXPORT bool arePoints(const MeshPoint* points, const float* numbers,
                                      std::size_t count);
///@}
/// @param indices  three for each of `count` triangles
FCL_FIBERS_TREE_EXPORT bool areTriangles(const TriangleIndices* triangles,
                                         const std::size_t* indices, std::size_t count);

}  // namespace fcl_fibers::geometry
