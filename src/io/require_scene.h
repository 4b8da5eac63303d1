// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include <fcl_fibers/fiber_polylines.h>

#include "arguments.h"

namespace fcl_fibers::io {

/// Throws std::invalid_argument if the scene is not as FiberPolylines requires, because files would
/// be refused, or hold other fibers.
inline void requireScene(const char* call, const FiberPolylines& scene) {
  requireFiberRanges(call, scene);
  requireRadii<double>(call, scene);
  requireCoordinates(call, scene, std::numeric_limits<double>::max(), "give finite numbers");
  requireCount(call, "closed", scene.closed, scene.fiberCount(), "fiber");
  requireCount(call, "groups", scene.groups, scene.fiberCount(), "fiber");
  requireCount(call, "samples", scene.samples, scene.points.size(), "point");
  requireCount(call, "types", scene.types, scene.points.size(), "point");
  requireBranches(call, scene);
}

}  // namespace fcl_fibers::io
