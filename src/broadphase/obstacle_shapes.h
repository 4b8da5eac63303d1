// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/fiber_manager_options.h>

#include "geometry/frame.h"
#include "geometry/obstacle.h"

namespace fcl_fibers::broadphase {

/// Reads an object that counts by its box as an obstacle in `frame`. A box, plane, half-space or
/// triangle is exact, and so is a capsule or sphere whose box the program has widened unevenly. Any
/// other bounded shape is inside its obstacle, which is the local box in the object's pose. A
/// margin that the program has added to the object's box is part of the obstacle's margin.
/// @return whether there is such an obstacle; if not, only the box of readSegment() counts, and the
///         obstacle is of Kind::kNone
/// @pre readSegment() accepts the object
template <typename S>
bool readObstacle(const fcl::CollisionObject<S>& object, const geometry::Frame& frame,
                  Bounds bounds, geometry::Obstacle& obstacle);

}  // namespace fcl_fibers::broadphase
