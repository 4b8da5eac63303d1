// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl/math/motion/motion_base.h>

#include "broadphase/motion_samples.h"
#include "geometry/moving_segment.h"

namespace fcl_fibers::broadphase {

/// Bounds a shape by the Taylor model of its motion, as readMoving() does.
/// @return nullptr, or why the motion is refused and the remedy
template <typename S>
const char* boundTaylorModel(const ShapeCore& core, const fcl::MotionBase<S>& motion,
                             geometry::MovingSegment& moving);

}  // namespace fcl_fibers::broadphase
