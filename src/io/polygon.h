// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::io {

/// Cuts a polygon into triangles by taking off ears. All decisions are about the polygon as it
/// projects along one axis, the one nearest to its normal, and are exact there. If that fails,
/// files may have rounded its corners, so it is done again as if narrow triangles were lines.
///
/// Triangles of which none is clockwise cover each place as many times as the polygon runs around
/// it. So whichever ears are taken off, the cut is right if no two triangles overlap, which is
/// tested in the end. A polygon may touch itself, and pass an edge to and fro: so a face has holes.
///
/// Appends n - 2 triangles to `triangles`, of three corners each in the order of the polygon,
/// where n is the number of corners. Triangles have no area where corners are at one place, and
/// where the polygon goes back on its own line. A polygon that goes round several times counts
/// as one that goes round once.
///
/// Takes a time of O(n^2) at most. Returns false and appends nothing if the polygon crosses
/// itself.
///
/// @param corners  at least 3, indices of points, whose coordinates are finite; those of one
///     round remain
bool cutPolygon(const std::vector<Point>& points, std::vector<std::int32_t>& corners,
                std::vector<std::int32_t>& triangles);

}  // namespace fcl_fibers::io
