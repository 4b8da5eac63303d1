// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <fcl_fibers/scenes/fiber_scene.h>

namespace fcl_fibers::scenes {

/// Reads a TressFX hair file (.tfx, versions 3 and 4), in the file's unit of length. Anything
/// malformed throws std::runtime_error naming file, offset and reason.
FCL_FIBERS_SCENES_EXPORT FiberScene readTfx(const std::string& path, double radius);

}  // namespace fcl_fibers::scenes
