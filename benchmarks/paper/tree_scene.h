// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <fcl_fibers/scenes/fiber_scene.h>

#include "geometry/segment.h"
#include "tree/topology.h"

namespace fcl_fibers::benchmarks {

/// A scene as the trees read it, without FCL's objects in between; the scene's own frame.
std::vector<geometry::Segment> treeSegments(const scenes::FiberScene& scene);
tree::Fibers treeFibers(const scenes::FiberScene& scene);

}  // namespace fcl_fibers::benchmarks
