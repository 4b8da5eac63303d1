// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "contenders/moving_fibers.h"
#include "tools/commands.h"

namespace fcl_fibers::tools {

/// Who finds the pairs of a segment and a mesh that touch, and how.
struct MeshFinderResult {
  std::string finder;
  bool ours;
  std::optional<std::size_t> candidates;  ///< pairs that were tested, if that can be told
  std::size_t touching = 0;
  std::size_t missed = 0;     ///< touching pairs
  std::size_t extra = 0;      ///< pairs that do not touch
  std::size_t undecided = 0;  ///< pairs that only one side found, within 1e-9 of contact
  double set_up_seconds = 0;  ///< medians
  double query_seconds = 0;

  bool right() const { return missed == 0 && extra == 0; }
};

/// Compares ours with FCL's tree and fcl::collide. Everyone is judged before anyone is timed.
/// @param fibers  of the scene; they are in frame 0 afterwards, with tight boxes
std::vector<MeshFinderResult> benchMeshes(const FiberPolylines& scene,
                                          benchmarks::MovingFibers& fibers,
                                          const std::vector<MeshFile>& meshes,
                                          const BenchRequest& request);

}  // namespace fcl_fibers::tools
