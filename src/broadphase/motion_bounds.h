// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl/narrowphase/continuous_collision_object.h>

#include "fibers/options.h"
#include "geometry/moving_segment.h"

namespace fcl_fibers::broadphase {

/// Bounds a shape during its motion, in the world. A capsule or sphere that does not turn is a
/// capsule with linearly moving ends; anything else is a box at the start and one at the end. At
/// each time from 0 to 1 the linear interpolation of the two contains the shape where the motion's
/// integrate() puts it, including the rounding of that function. Unbounded sides are at infinity,
/// at both times.
///
/// The object and its motion are not changed. FCL's four classes of motions are bounded by their
/// parameters, any other class by its getTaylorModel().
/// @return nullptr, or why the object is refused and the remedy
template <typename S>
const char* readMoving(const fcl::ContinuousCollisionObject<S>& object,
                       geometry::MovingSegment& moving);

/// Does the same. Throws std::invalid_argument with name() if the object cannot be read.
template <typename S, class Name>
geometry::MovingSegment readMoving(const char* call,
                                   const fcl::ContinuousCollisionObject<S>& object,
                                   const Name& name) {
  geometry::MovingSegment moving;
  if (const char* problem = readMoving(object, moving)) {
    fibers::throwInvalidArgument(call, name() + ": " + problem);
  }
  return moving;
}

}  // namespace fcl_fibers::broadphase
