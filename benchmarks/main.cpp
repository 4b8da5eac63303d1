// SPDX-License-Identifier: BSD-3-Clause
//
// How long FCL's managers and ours take for the same fibers. One run is one scene:
//
//   fcl_fibers_benchmark --scene=strand --fibers=1000 --segments=100 [--seed=1] [--largest]
//   fcl_fibers_benchmark --scene=scalp [--fibers=50000] [--segments=50] [--seed=1]
//   fcl_fibers_benchmark --scene=dynamic [--fibers=150] [--segments=100] [--seed=1] [--step=50]
//   fcl_fibers_benchmark --hair=FILE [--radius=R]
//
// and any flag of Google Benchmark, such as --benchmark_filter=Update or --benchmark_out=FILE.json.
//
// What is measured, all managers on the same objects, one thread, no neighbours left out:
//
//   SetUp          construct the manager, register all objects, setup()
//   Update         after every pose was set anew: boxes as the manager reads them (computeAABB for
//                  FCL's "stock", end points +- radius for FCL's "tight", none for ours) + update()
//   SelfCollision  the query of all pairs, with a callback that counts
//   Frame          set every pose, update as above, self-collision
//
// Two frames of the scene's motion take turns; of the dynamic assembly, which has many, the one
// before --step and that one. Times are wall-clock medians over repetitions in
// random order; no manager has lived through more than ten updates, for FCL's trees become slower
// with each, and those of FCL's managers far behind are timed once. Before anything is timed, each
// manager has to show in a process of its own that it reports every touching pair, once; what is
// wrong, crashes or refuses has no time, and what takes longer than --limit=10 seconds in any phase
// shows so, beside times of its other phases taken once ("~"). The exit status is 1 if one of ours
// is wrong.
//
// How to read the table: pairs is what the manager reports, touching those of them whose capsules
// touch; the difference is what a narrow phase would try in vain. The rows "bundle" and "super
// thread" of LayeredAABBTree report what FCL's managers report on tight boxes, those of
// WrappedSphereTree the pairs of overlapping spheres, and the rows "capsules" do the narrow phase's
// work as well. Bytes are what malloc gave for one manager, the objects apart. "FCL's best" is
// FCL's manager with the smallest update + self-collision in this scene, and the ratio is its time
// to the row's.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

#include "arguments.h"
#include "contender.h"
#include "largest.h"
#include "moving_fibers.h"
#include "preflight.h"
#include "progress.h"
#include "table.h"
#include "timings.h"

namespace fcl_fibers::benchmarks {
namespace {

struct Arguments {
  std::string scene = "strand";
  int fibers = 0;    ///< 0: as many as are usual in the scene
  int segments = 0;  ///< likewise
  int step = 50;
  unsigned long long seed = 1;
  HairRequest hair;
  double limit = 10;
  bool largest = false;
};

void addOptions(CLI::App& app, Arguments& arguments) {
  app.allow_extras();
  app.add_option("--scene", arguments.scene)->check(CLI::IsMember({"strand", "scalp", "dynamic"}));
  app.add_option("--fibers", arguments.fibers)->check(CLI::PositiveNumber);
  app.add_option("--segments", arguments.segments)->check(CLI::PositiveNumber);
  app.add_option("--step", arguments.step)->check(CLI::PositiveNumber);
  app.add_option("--seed", arguments.seed);
  addHairOptions(app, arguments.hair);
  app.add_option("--limit", arguments.limit, "Seconds that a phase may take")
      ->check(CLI::Range(0.01, 1e6));
  app.add_flag("--largest", arguments.largest);
}

MovingFibers makeScene(const Arguments& arguments) {
  showProgress("make the scene");
  if (!arguments.hair.path.empty()) return readMovingHair(arguments.hair);
  const auto orUsual = [](int asked, int usual) { return asked > 0 ? asked : usual; };
  const int segments = orUsual(arguments.segments, arguments.scene == "scalp" ? 50 : 100);
  if (arguments.scene == "strand") {
    return makeMovingStrand(orUsual(arguments.fibers, 1000), segments, arguments.seed);
  }
  if (arguments.scene == "scalp") {
    return makeMovingScalp(orUsual(arguments.fibers, 50000), segments, arguments.seed);
  }
  scenes::PaperDynamicParameters parameters;
  parameters.fibers = orUsual(arguments.fibers, parameters.fibers);
  parameters.segments = segments;
  parameters.seed = arguments.seed;
  return makeMovingAssembly(scenes::PaperDynamic(parameters), {arguments.step - 1, arguments.step});
}

int run(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Times FCL's managers and ours on one scene. Other flags are Google Benchmark's.");
  addOptions(app, arguments);
  CLI11_PARSE(app, argc, argv);
  const Circumstances where = circumstances(argc, argv);

  BenchmarkArguments others(app, argv[0], {"--benchmark_enable_random_interleaving=true"});
  const bool choose_repetitions = !others.has("--benchmark_repetitions");
  benchmark::Initialize(&others.count, others.values());
  if (benchmark::ReportUnrecognizedArguments(others.count, others.values())) return 1;
  benchmark::AddCustomContext("machine", where.machine);
  benchmark::AddCustomContext("compiler", where.compiler);
  benchmark::AddCustomContext("build_type", where.build_type);
  benchmark::AddCustomContext("commit", where.commit);
  benchmark::AddCustomContext("command", where.command);

  const std::vector<Contender> contenders = allContenders();
  bool ours_right = true;
  {
    MovingFibers fibers = makeScene(arguments);
    PreflightLimits limits;
    limits.phase_seconds = arguments.limit;
    std::vector<Preflight> preflights = preflightAll(contenders, fibers, limits);
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      if (preflights[i].right()) continue;
      benchmark::AddCustomContext("not timed: " + contenders[i].title(), preflights[i].note);
    }
    const std::vector<Timing> timings =
        timeContenders(contenders, preflights, fibers, choose_repetitions);
    printScene(contenders, preflights, timings, fibers, where);
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      const bool slow = preflights[i].verdict == Preflight::Verdict::kTooSlow;
      if (contenders[i].ours && !preflights[i].right() && !slow) ours_right = false;
    }
  }
  if (arguments.largest) {
    printLargest(contenders, arguments.segments > 0 ? arguments.segments : 100, arguments.seed);
  }
  return ours_right ? 0 : 1;
}

}  // namespace
}  // namespace fcl_fibers::benchmarks

int main(int argc, char** argv) {
  try {
    return fcl_fibers::benchmarks::run(argc, argv);
  } catch (const std::exception& error) {
    fcl_fibers::benchmarks::endProgress();
    std::fprintf(stderr, "fcl_fibers_benchmark: %s\n", error.what());
    return 1;
  }
}
