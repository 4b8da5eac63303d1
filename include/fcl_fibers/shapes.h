// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <variant>

#include <fcl_fibers/triangle_mesh.h>

namespace fcl_fibers {

// Shapes as plain numbers, without FCL. A shape is in the frame and unit of the fibers that it is
// asked about. A call that takes a shape throws std::invalid_argument if a number of it is NaN or
// has a magnitude above 2^1000, or is not as its comment requires.

/// A capsule: all points within `radius` of the line from `start` to `end`, which may be one point.
struct CapsuleShape {
  std::array<double, 3> start;  ///< x, y, z of the first end of the axis
  std::array<double, 3> end;    ///< x, y, z of the second end
  double radius;                ///< not negative
};

/// A ball, which is a capsule of no length.
struct SphereShape {
  std::array<double, 3> center;  ///< x, y, z
  double radius;                 ///< not negative
};

/// A box. On each axis low <= high, so the box may be flat. Without a pose its edges are along the
/// axes of the frame. With a pose, a point p between low and high is at rotation * p + position.
struct BoxShape {
  std::array<double, 3> low;   ///< x, y, z of the low corner
  std::array<double, 3> high;  ///< x, y, z of the high corner
  MeshPose pose = {};          ///< its rotation is as TriangleMesh::setPose() requires
};

/// All points p with normal . p <= offset, such as the ground below a floor.
struct HalfSpaceShape {
  std::array<double, 3> normal;  ///< x, y, z; it points out, and is of any length but 0
  double offset;                 ///< the surface is offset / |normal| from the origin along it
};

/// All points p with normal . p = offset: a thin sheet without an end, which has two sides.
struct PlaneShape {
  std::array<double, 3> normal;  ///< x, y, z, of any length but 0
  double offset;                 ///< see HalfSpaceShape::offset
};

/// Any of the shapes. What is said of a Shape as a partner holds for each of its types.
using Shape = std::variant<CapsuleShape, SphereShape, BoxShape, HalfSpaceShape, PlaneShape>;

}  // namespace fcl_fibers
