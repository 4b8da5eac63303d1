// SPDX-License-Identifier: BSD-3-Clause
//
// How much faster than FCL and Embree our box tree is, against the figures that it is to reach. One
// run is one part, whose numbers go to a file of Google Benchmark's; report.py makes the tables:
//
//   fcl_fibers_full --part=scene --scene=static|strand|half_scalp|dynamic
//                   [--fibers=N] [--segments=N] [--seed=1] --benchmark_out=FILE.json
//   fcl_fibers_full --part=scene --hair=FILE [--radius=R] --benchmark_out=FILE.json
//   fcl_fibers_full --part=queries [--fibers=N] [--segments=N] [--seed=1] --benchmark_out=FILE.json
//   fcl_fibers_full --part=growth [--fibers=N] [--segments=N] [--seed=1] --benchmark_out=FILE.json
//
// `benchmarks/run.sh --full` runs all of them. What is measured in a scene:
//
//   Tried/...    FCL's dynamic tree and its array form with every tree_init_level, stock and tight
//                boxes, the faster of two times in a process of its own, large scenes with a
//                quarter of the fibers. The best of either kind of boxes goes on, and the second
//                best where it is close; FCL's other managers are 10 to 100 times slower here
//                (benchmarks/main.cpp).
//   Checked/...  pairs, touching pairs and bytes of each contender, which had to report every
//                touching pair, once, by the same exact test for all
//   Frames/...   set_up, and of a frame, after every pose was set anew by the scene's motion:
//                update (boxes included) and detection (a count of the pairs). Of the dynamic
//                assembly the sum over its steps. `_and_collide`: detection with fcl::collide on
//                each pair, or on a thousand out of every stride thousands and scaled by that.
//   Floor/read   a loop over the objects that reads their transforms and capsules
//
// Runs are in random order, and report.py takes medians. Of Embree's times, update is reading the
// boxes from the poses, as our manager does, and rtcCommitScene; detection is one rtcCollide,
// which counts a pair in one of its two orders.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

#include "arguments.h"
#include "foreign_tree.h"
#include "parts.h"
#include "progress.h"
#include "table.h"

namespace fcl_fibers::benchmarks {
namespace {

void addOptions(CLI::App& app, std::string& part, PartRequest& request) {
  app.allow_extras();
  app.add_option("--part", part)->check(CLI::IsMember({"scene", "queries", "growth"}));
  app.add_option("--scene", request.scene)
      ->check(CLI::IsMember({"static", "strand", "half_scalp", "dynamic"}));
  app.add_option("--fibers", request.fibers)->check(CLI::NonNegativeNumber);
  app.add_option("--segments", request.segments)->check(CLI::NonNegativeNumber);
  app.add_option("--seed", request.seed);
  addHairOptions(app, request.hair);
}

void initializeBenchmark(int argc, char** argv, const CLI::App& app) {
  BenchmarkArguments others(app, argv[0], {"--benchmark_enable_random_interleaving=true"});
  benchmark::Initialize(&others.count, others.values());
  if (benchmark::ReportUnrecognizedArguments(others.count, others.values())) {
    throw std::invalid_argument("see the head of benchmarks/full/main.cpp");
  }
  const Circumstances where = circumstances(argc, argv);
  benchmark::AddCustomContext("machine", where.machine);
  benchmark::AddCustomContext("compiler", where.compiler);
  benchmark::AddCustomContext("build_type", where.build_type);
  benchmark::AddCustomContext("commit", where.commit);
  benchmark::AddCustomContext("command", where.command);
  std::string missing;
  for (const std::string& library : missingLibraries()) {
    missing += (missing.empty() ? "" : ", ") + library;
  }
  benchmark::AddCustomContext("left_out", missing);
}

bool runPart(const std::string& part, const PartRequest& request) {
  if (part == "scene") return timeScene(request);
  if (!request.hair.path.empty()) {
    throw std::invalid_argument("--hair: the part " + part +
                                " is of strands that are made; --part=scene");
  }
  return part == "growth" ? timeGrowth(request) : timeQueries(request);
}

/// Prints nothing, for the tables are made of the file.
class SilentReporter : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (!run.error_occurred) continue;
      if (run.benchmark_name().find("LayeredAABBTree") != std::string::npos) ours_failed = true;
      endProgress();
      std::fprintf(stderr, "%s: %s\n", run.benchmark_name().c_str(), run.error_message.c_str());
    }
  }

  bool ours_failed = false;
};

int run(int argc, char** argv) {
  std::string part = "scene";
  PartRequest request;
  CLI::App app("Times ours against FCL and Embree. Other flags are Google Benchmark's.");
  addOptions(app, part, request);
  CLI11_PARSE(app, argc, argv);
  initializeBenchmark(argc, argv, app);
  const bool right = runPart(part, request);
  endProgress();
  if (!right) std::fprintf(stderr, "fcl_fibers_full: a manager of ours is wrong\n");
  return right ? 0 : 1;
}

}  // namespace

bool runRegistered() {
  SilentReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::ClearRegisteredBenchmarks();
  endProgress();
  return !reporter.ours_failed;
}

}  // namespace fcl_fibers::benchmarks

int main(int argc, char** argv) {
  try {
    return fcl_fibers::benchmarks::run(argc, argv);
  } catch (const std::exception& error) {
    fcl_fibers::benchmarks::endProgress();
    std::fprintf(stderr, "fcl_fibers_full: %s\n", error.what());
    return 1;
  }
}
