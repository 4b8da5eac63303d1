// SPDX-License-Identifier: BSD-3-Clause
//
// fcl_fibers: the library as a program, for people who have a file of fibers.
#include "bench.h"
#include "generated_scenes.h"
#include "replay.h"
#include "tools/program.h"

int main(int argc, char** argv) {
  using namespace fcl_fibers;
  tools::ProgramParts parts;
  parts.scenes = benchmarks::generatedScenes();
  parts.bench = tools::bench;
  parts.replay = tools::replay;
  return tools::runProgram({argv + 1, argv + argc}, parts);
}
