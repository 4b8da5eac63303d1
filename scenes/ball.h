// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/triangle_mesh.h>

namespace fcl_fibers::scenes {

/// A triangle mesh that owns its arrays.
struct Triangles {
  std::vector<Point> points;
  std::vector<std::int32_t> corners;  ///< three of each triangle, counterclockwise from outside

  MeshArrays<double> arrays() const {
    return {points.front().data(), points.size(), corners.data(), corners.size() / 3};
  }
};

/// An ellipsoid about the origin with these radii along x, y and z, closed, whose points are on it
/// and whose triangles are below it: rings between two poles on the y axis. They are about as many
/// as asked for, 102,400 of 102,400.
///
/// Throws std::invalid_argument if `triangles` is less than 16 or more than 100 million.
Triangles makeBall(const Point& radii, int triangles);

/// An upper bound of how far a ball's triangles are below a sphere of that radius.
double depthOfTriangles(double radius, int triangles);

}  // namespace fcl_fibers::scenes
