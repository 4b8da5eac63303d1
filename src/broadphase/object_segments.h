// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/fiber_manager_options.h>

#include "geometry/frame.h"
#include "geometry/segment.h"

namespace fcl_fibers::broadphase {

/// Reads an object as a segment in `frame`. A sphere is a capsule of length zero. Other shapes, and
/// under Bounds::kObjects all shapes, are boxes, whose unbounded sides are at infinity. A margin
/// that the program has added to the box of a capsule or sphere is part of the radius.
/// @return nullptr, or why the object is refused and the remedy
template <typename S>
const char* readSegment(const fcl::CollisionObject<S>& object, const geometry::Frame& frame,
                        Bounds bounds, geometry::Segment& segment);

}  // namespace fcl_fibers::broadphase
