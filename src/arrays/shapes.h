// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <fcl_fibers/contact.h>

#include "geometry/obstacle.h"

namespace fcl_fibers::arrays {

/// Throws std::invalid_argument, which names the call, if no shape has such numbers.
void requireShape(const std::string& call, const Shape& shape);

/// A shape in a frame. The result is not finite if it overflows.
/// @pre requireShape() has passed
geometry::Obstacle obstacleOf(const Shape& shape, const geometry::Frame& frame);

/// The contact of a capsule, relative to a point near by, and a shape.
/// @pre requireShape() has passed
ShapeContact shapeContact(const geometry::Segment& capsule, const geometry::Vec3d& origin,
                          FiberSegment place, const Shape& shape);

}  // namespace fcl_fibers::arrays
