// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <fcl/narrowphase/collision_object.h>

#include "geometry/frame.h"
#include "geometry/segment.h"

namespace fcl_fibers::broadphase {

/// Reads an object as a segment in `frame`: a capsule as it is; a sphere as a capsule of length
/// zero; anything else as its `getAABB()`, unbounded sides at infinity.
/// @return why the object is refused and what to do, or nullptr if it was read
template <typename S>
const char* readSegment(const fcl::CollisionObject<S>& object, const geometry::Frame& frame,
                        geometry::Segment& segment);

/// A frame for these objects, found from a sample of them. Null pointers and objects that cannot be
/// read are passed over.
template <typename S>
geometry::Frame sceneFrame(const std::vector<fcl::CollisionObject<S>*>& objects);

}  // namespace fcl_fibers::broadphase
