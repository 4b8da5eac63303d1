// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

#include "mesh_file.h"

namespace fcl_fibers::tools {

/// Warns, in one line, if fibers and meshes are probably not in the same unit or frame: one is a
/// hundred times as large as the other, or a box around the fibers does not meet one around the
/// meshes. Does nothing if there is no mesh.
/// @param margin  within which they would touch
/// @param name    of the fibers
void warnOfMeshSize(const FiberPolylines& fibers, const std::vector<MeshFile>& meshes,
                    double margin, const std::string& name);

}  // namespace fcl_fibers::tools
