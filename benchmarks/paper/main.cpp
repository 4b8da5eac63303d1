// SPDX-License-Identifier: BSD-3-Clause
//
// What Sobottka, Varnik and Weber measured in section 4, measured again. One run is one part:
//
//   fcl_fibers_paper --part=scene --scene=static|axis_parallel|axis_turned|half_scalp|strand
//                    [--fibers=N] [--segments=N] [--rows] [--all_of_fcl] [--only=NAME,...]
//                    [--limit=10]
//   fcl_fibers_paper --part=scene --hair=FILE [--radius=R] and the rest of it
//   fcl_fibers_paper --part=dynamic
//   fcl_fibers_paper --part=chain --chain=random|snake --edge=N
//   fcl_fibers_paper --part=radii
//   fcl_fibers_paper --part=rods
//   fcl_fibers_paper --part=pictures --out_dir=DIR
//
// and --seed=1 and any flag of Google Benchmark, such as --benchmark_out=FILE.json: report.py makes
// a page of these files. `benchmarks/run.sh --paper` runs all of it.
//
// What is timed is what benchmarks/main.cpp says, but adjacent segments of a fiber are left out, as
// in the paper, but by FCL's managers, which cannot. All of FCL's managers read tight boxes.
//
//   Checked/...  nothing timed: pairs, touching, bytes, volume_tests, and the seconds that each
//   phase
//                took once; the label says why a manager is not timed
//   Replay/...   the dynamic assembly, all steps; counters update:007, detection:007, pairs:007,
//                cages_recomputed:007 are of step 7, in seconds
//   Chain/...    self-collision of one chain
//   Radii/...    nothing timed: radii of layered and wrapped spheres, bytes of the trees

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

#include "arguments.h"
#include "parts.h"
#include "progress.h"
#include "table.h"

namespace fcl_fibers::benchmarks {
namespace {

void addOptions(CLI::App& app, std::string& part, PartRequest& request) {
  PaperSceneRequest& scene = request.scene;
  app.allow_extras();
  app.add_option("--part", part)
      ->check(CLI::IsMember({"scene", "dynamic", "chain", "radii", "rods", "pictures"}))
      ->required();
  app.add_option("--scene", scene.name)
      ->check(CLI::IsMember({"static", "axis_parallel", "axis_turned", "half_scalp", "strand"}));
  app.add_option("--fibers", scene.fibers)->check(CLI::PositiveNumber);
  app.add_option("--segments", scene.segments)->check(CLI::PositiveNumber);
  app.add_option("--seed", scene.seed);
  addHairOptions(app, scene.hair);
  app.add_option("--limit", request.limit, "Seconds that a phase may take")
      ->check(CLI::Range(0.01, 1e6));
  app.add_option("--chain", request.chain)->check(CLI::IsMember({"random", "snake", "straight"}));
  app.add_option("--edge", request.edge)->check(CLI::Range(2, 1000));
  app.add_option("--only", request.only);
  app.add_option("--out_dir", request.out_dir);
  app.add_flag("--all_of_fcl", request.all_of_fcl);
  app.add_flag("--rows", request.rows, "Fibers in the order of rows of roots");
}

void initializeBenchmark(int argc, char** argv, const CLI::App& app, const PartRequest& request) {
  // A frame is an update and a self-collision, which are timed apart.
  BenchmarkArguments others(
      app, argv[0], {"--benchmark_enable_random_interleaving=true", "--benchmark_filter=-^Frame/"});
  benchmark::Initialize(&others.count, others.values());
  if (benchmark::ReportUnrecognizedArguments(others.count, others.values())) {
    throw std::invalid_argument("see the head of benchmarks/paper/main.cpp");
  }
  const Circumstances where = circumstances(argc, argv);
  benchmark::AddCustomContext("machine", where.machine);
  benchmark::AddCustomContext("compiler", where.compiler);
  benchmark::AddCustomContext("build_type", where.build_type);
  benchmark::AddCustomContext("commit", where.commit);
  benchmark::AddCustomContext("command", where.command);
  benchmark::AddCustomContext("seed", std::to_string(request.scene.seed));
  benchmark::AddCustomContext("limit", std::to_string(request.limit));
}

/// Returns whether all of ours are right.
bool runPart(const std::string& part, const PartRequest& request) {
  if (part == "scene") return timeScene(request);
  if (!request.scene.hair.path.empty()) {
    throw std::invalid_argument("--hair: the part " + part +
                                " is of fibers that are made; --part=scene");
  }
  if (part == "dynamic") return timeDynamicAssembly(request);
  if (part == "chain") return countChain(request);
  if (part == "radii") {
    compareRadii(request);
  } else if (part == "rods") {
    timeRods(request);
  } else {
    writePictures(request);
  }
  return true;
}

class SilentReporter : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>&) override {}
};

int run(int argc, char** argv) {
  std::string part;
  PartRequest request;
  CLI::App app("Measures again what the paper measured. Other flags are Google Benchmark's.");
  addOptions(app, part, request);
  CLI11_PARSE(app, argc, argv);
  request.edge -= request.edge % 2;
  initializeBenchmark(argc, argv, app, request);
  const bool right = runPart(part, request);
  endProgress();
  if (!right) std::fprintf(stderr, "fcl_fibers_paper: a manager of ours is wrong\n");
  return right ? 0 : 1;
}

}  // namespace

void runRegistered() {
  SilentReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::ClearRegisteredBenchmarks();
  endProgress();
}

}  // namespace fcl_fibers::benchmarks

int main(int argc, char** argv) {
  try {
    return fcl_fibers::benchmarks::run(argc, argv);
  } catch (const std::exception& error) {
    fcl_fibers::benchmarks::endProgress();
    std::fprintf(stderr, "fcl_fibers_paper: %s\n", error.what());
    return 1;
  }
}
