// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <fcl_fibers/scenes/fiber_scene.h>

namespace fcl_fibers::scenes {

/// The helical strand strand-325: lengths in cm.
struct StrandParameters {
  int fibers = 1000;
  int segments = 100;        ///< per fiber
  double radius = 0.0035;    ///< of a human hair
  std::uint64_t seed = 1;    ///< same seed, same scene
  int frame = 0;             ///< time step of the motion
};

FCL_FIBERS_SCENES_EXPORT FiberScene makeStrand(const StrandParameters& parameters);

}  // namespace fcl_fibers::scenes
