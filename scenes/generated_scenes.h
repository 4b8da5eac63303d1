// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "tools/scene_source.h"

namespace fcl_fibers::scenes {

using tools::SceneSource;

/// Helices, heads of hair and the paper's assemblies, by name.
/// @param part  generates only one of so many fibers, at the same density
tools::GeneratedScenes generatedScenes(int part = 1);

/// tools::SceneName::open() with these.
SceneSource openScene(const std::string& text, std::optional<double> radius, int part = 1);

}  // namespace fcl_fibers::scenes
