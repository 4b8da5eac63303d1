// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <fcl_fibers/scenes/fiber_scene.h>

namespace fcl_fibers::scenes {

/// Reads the strands of a TressFX hair file (.tfx, versions 3 and 4), in the file's unit of length
/// and frame, as one fiber of at least two points each. Points may coincide. Arrays other than the
/// points, and the fourth number of a version 4 point, are not read.
///
/// Throws std::runtime_error naming file, byte offset and reason where the file is malformed, and
/// file and reason where it cannot be read; std::invalid_argument if radius is not finite or
/// negative. Sizes are checked against the file's before memory is taken for them.
FCL_FIBERS_SCENES_EXPORT FiberScene readTfx(const std::string& path, double radius);

}  // namespace fcl_fibers::scenes
