// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <fcl/narrowphase/collision_object.h>

#include <fcl_fibers/fiber_manager_options.h>

#include "geometry/frame.h"
#include "geometry/segment.h"

namespace fcl_fibers::broadphase {

/// Reads an object as a segment in `frame`: a capsule as it is; a sphere as a capsule of length
/// zero; anything else as a box, unbounded sides at infinity. A margin that a program has added to
/// the box of a capsule or sphere is part of the radius.
/// @return why the object is refused and what to do, or nullptr if it was read
template <typename S>
const char* readSegment(const fcl::CollisionObject<S>& object, const geometry::Frame& frame,
                        Bounds bounds, geometry::Segment& segment);

/// A frame for these objects, found from a sample of them. Null pointers and objects that cannot be
/// read are passed over.
template <typename S>
geometry::Frame sceneFrame(const std::vector<fcl::CollisionObject<S>*>& objects, Bounds bounds);

}  // namespace fcl_fibers::broadphase
