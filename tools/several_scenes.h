// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "scene_source.h"

namespace fcl_fibers::tools {

/// Several scenes as one, in which each is a group. It moves as the first one does, and the others
/// rest. Throws std::invalid_argument if there is one only.
SceneSource asGroups(std::vector<SceneSource> sources);

/// Several scenes as the frames of one. Throws std::invalid_argument if there is one only, or if a
/// frame has other numbers of points than the first.
SceneSource asFrames(std::vector<SceneSource> sources);

}  // namespace fcl_fibers::tools
