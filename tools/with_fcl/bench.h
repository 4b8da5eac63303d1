// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tools/commands.h"

namespace fcl_fibers::tools {

/// Times our managers and FCL's. Returns 1 if a manager misses a touching pair, or if ours is wrong
/// with a mesh.
int bench(const SceneSource& source, const BenchRequest& request);

}  // namespace fcl_fibers::tools
