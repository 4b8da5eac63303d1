// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <fcl_fibers/scenes/fiber_scene.h>

#include "moving_fibers.h"

namespace fcl_fibers::benchmarks {

/// One of the paper's static test cases, or a file. 0 asks for the paper's own number of fibers or
/// segments.
struct PaperSceneRequest {
  std::string name = "strand";  ///< static, axis_parallel, axis_turned, half_scalp or strand
  int fibers = 0;
  int segments = 0;
  unsigned long long seed = 1;
  HairRequest hair = {};  ///< a file's fibers instead
};

/// Throws std::invalid_argument if there is no scene of that name.
scenes::FiberScene makePaperScene(const PaperSceneRequest& request, int frame);

}  // namespace fcl_fibers::benchmarks
