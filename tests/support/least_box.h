// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl/narrowphase/collision_object.h>

#include "support/exact_geometry.h"

namespace fcl_fibers::test {

/// The box by which an object counts that nobody has widened, from its farthest points. A mesh or
/// an octree counts by the box of its own axes and the ball around it, and what is unbounded by
/// getAABB(). Shares nothing with the library.
template <typename S>
ExactBox leastBox(const fcl::CollisionObject<S>& object);

extern template ExactBox leastBox(const fcl::CollisionObject<float>&);
extern template ExactBox leastBox(const fcl::CollisionObject<double>&);

}  // namespace fcl_fibers::test
