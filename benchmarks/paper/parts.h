// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "paper_scene.h"

namespace fcl_fibers::benchmarks {

/// What a part is told. Each part writes through Google Benchmark, which has to be initialised.
struct PartRequest {
  PaperSceneRequest scene;
  double limit = 10;  ///< seconds that a phase may take
  bool all_of_fcl = false;
  bool rows = false;             ///< fibers in the order of rowsOfRoots()
  std::string chain = "random";  ///< see makeChain
  int edge = 16;
  std::string only;     ///< names of the only contenders to be timed, if any: `A/b,A/c`
  std::string out_dir;  ///< of files that are not Google Benchmark's
};

/// Runs what is registered. Results go to --benchmark_out only: a page is made of them.
void runRegistered();

/// One static scene: `SetUp/...`, `Update/...`, `SelfCollision/...` and `Checked/...`. Returns
/// whether all of ours are right.
bool timeScene(const PartRequest& request);

/// The dynamic assembly: `Replay/...`, with counters per step. Returns whether all of ours are
/// right.
bool timeDynamicAssembly(const PartRequest& request);

/// One self-colliding chain: `Chain/...` and `Checked/...`. Returns whether all of ours are right.
bool countChain(const PartRequest& request);

/// Layered against wrapped spheres, and the bytes of the trees: `Radii/...`.
void compareRadii(const PartRequest& request);

/// What one rod costs, and the scenes made of many: `Rod/...` and `Make/...`.
void timeRods(const PartRequest& request);

/// What pictures are drawn from, as files in out_dir.
void writePictures(const PartRequest& request);

}  // namespace fcl_fibers::benchmarks
