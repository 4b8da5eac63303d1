// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "moving_fibers.h"
#include "preflight.h"

namespace fcl_fibers::benchmarks {

/// What a part is told. Each part writes through Google Benchmark, which has to be initialised.
struct PartRequest {
  std::string scene = "static";  ///< static, strand, half_scalp or dynamic
  int fibers = 0;                ///< 0: as the scene has them
  int segments = 0;              ///< likewise
  unsigned long long seed = 1;
  HairRequest hair;  ///< instead of the scene
};

/// One scene: `Tried/...`, `Checked/...`, `Frames/...` and `Floor/...`. Returns whether all of ours
/// are right.
bool timeScene(const PartRequest& request);

/// Queries of other kinds, and objects that are no fibers: `Query/...`. Returns whether ours give
/// FCL's answers.
bool timeQueries(const PartRequest& request);

/// The tree over plain arrays at two sizes of one density: `Growth/<segments>`.
bool timeGrowth(const PartRequest& request);

/// Runs what is registered, in random order. Results go to --benchmark_out only. Returns whether
/// no run of ours has ended in an error.
bool runRegistered();

}  // namespace fcl_fibers::benchmarks
