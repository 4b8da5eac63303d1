// SPDX-License-Identifier: BSD-3-Clause
//
// What accuracy costs: dials that are no manager's option, or were not made one, measured on one
// scene. `benchmarks/run.sh --trade` runs all parts, and fcl_fibers_benchmark for the managers.
//
//   fcl_fibers_trade --part=leaves|bounds|spheres|kdops
//                    [--scene=static|strand|half_scalp|dynamic] [--hair=FILE [--radius=R]]
//   fcl_fibers_trade --part=sampling
//   fcl_fibers_trade --part=lazy
//   fcl_fibers_trade --part=costs
//
//   Leaves    leaves of 1, 2, 4, 8 segments: the tree is built over runs of segments, each in a
//             capsule about its chord, and every pair of runs that touch is tried segment by
//             segment; touching capsules, as Report::kCapsules finds them
//   Bound     FiberTree::visitPairs with a SearchBound
//   Spheres   a wrapped sphere tree's cages, exact or approximate, from the centroid (Ritter, An
//             efficient bounding sphere, 1990, and Badoiu and Clarkson, Smaller core-sets for
//             balls, 2003)
//   KDops     bundles of 14-, 18- and 26-DOPs beside boxes, with bounds in float and in double
//   Sampling  the strand cut into 25 to 2,000 segments: contacts found and missed
//   Lazy      boxes fattened by a part of the radius, refitted only where a segment has left its
//             own: the share that leaves, and detection with such boxes; the dynamic assembly
//   Costs     bytes and nanoseconds a segment of every combination of what may be asked for
//
// Runs are in random order; the report takes medians.

#include <benchmark/benchmark.h>

#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/scenes/cap.h>
#include <fcl_fibers/scenes/helix.h>
#include <fcl_fibers/scenes/paper_scenes.h>

#include "arguments.h"
#include "parts.h"
#include "progress.h"
#include "table.h"

namespace fcl_fibers::benchmarks {
namespace {

void addOptions(CLI::App& app, std::string& part, PartRequest& request) {
  app.allow_extras();
  app.add_option("--part", part)
      ->check(CLI::IsMember({"leaves", "bounds", "spheres", "kdops", "sampling", "lazy", "costs"}))
      ->required();
  app.add_option("--scene", request.scene)
      ->check(CLI::IsMember({"static", "strand", "half_scalp", "dynamic"}));
  app.add_option("--seed", request.seed);
  addHairOptions(app, request.hair);
}

/// Prints nothing but errors, for the page is made of the file.
class SilentReporter : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (!run.error_occurred) continue;
      failed = true;
      endProgress();
      std::fprintf(stderr, "%s: %s\n", run.benchmark_name().c_str(), run.error_message.c_str());
    }
  }

  bool failed = false;
};

int run(int argc, char** argv) {
  std::string part;
  PartRequest request;
  CLI::App app("Measures what accuracy costs. Other flags are Google Benchmark's.");
  addOptions(app, part, request);
  CLI11_PARSE(app, argc, argv);
  const Circumstances where = circumstances(argc, argv);

  BenchmarkArguments others(app, argv[0], {"--benchmark_enable_random_interleaving=true"});
  benchmark::Initialize(&others.count, others.values());
  if (benchmark::ReportUnrecognizedArguments(others.count, others.values())) return 1;
  benchmark::AddCustomContext("machine", where.machine);
  benchmark::AddCustomContext("compiler", where.compiler);
  benchmark::AddCustomContext("build_type", where.build_type);
  benchmark::AddCustomContext("commit", where.commit);
  benchmark::AddCustomContext("command", where.command);

  Frames frames;
  if (part == "sampling") {
    registerSampling();
  } else if (part == "costs") {
    registerCosts();
  } else if (part == "lazy") {
    registerLazy(request);
  } else {
    frames = makeFrames(request);
    if (part == "leaves") registerLeaves(frames);
    if (part == "bounds") registerBounds(frames);
    if (part == "spheres") registerSpheres(frames);
    if (part == "kdops") registerKDops(frames);
  }
  SilentReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::ClearRegisteredBenchmarks();
  endProgress();
  return reporter.failed ? 1 : 0;
}

}  // namespace

Frames makeFrames(const PartRequest& request) {
  Frames frames;
  const auto fill = [&](const std::string& name, auto&& make) {
    showProgress(name + ": make the scene");
    frames.name = name;
    for (int frame : {0, 1}) frames.frame[frame] = make(frame);
  };
  if (!request.hair.path.empty()) {
    fill(hairName(request.hair), [&](int frame) { return readHair(request.hair, frame); });
  } else if (request.scene == "static" || request.scene == "strand") {
    fill(request.scene, [&](int frame) {
      scenes::HelixParameters parameters;
      parameters.segments = request.scene == "static" ? 100 : 2000;
      parameters.seed = request.seed;
      parameters.frame = frame;
      return scenes::makeHelix(parameters);
    });
  } else if (request.scene == "half_scalp") {
    fill(request.scene, [&](int frame) {
      scenes::CapParameters parameters;
      parameters.fibers = 5000;
      parameters.seed = request.seed;
      parameters.frame = frame;
      return scenes::makeCap(parameters);
    });
  } else if (request.scene == "dynamic") {
    scenes::PaperDynamicParameters parameters;
    parameters.seed = request.seed;
    const scenes::PaperDynamic assembly(parameters);
    const int middle = assembly.steps() / 2;
    fill(request.scene, [&](int frame) { return assembly.scene(middle - 1 + frame); });
  } else {
    throw std::invalid_argument("--scene=" + request.scene +
                                ": there are static, strand, half_scalp and dynamic");
  }
  return frames;
}

std::vector<geometry::Segment> segmentsOf(const scenes::FiberScene& scene) {
  std::vector<geometry::Segment> segments;
  const auto vec = [](const scenes::Point& p) { return geometry::Vec3d{p[0], p[1], p[2]}; };
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    for (std::size_t i = scene.point_begin[f]; i + 1 < scene.point_begin[f + 1]; ++i) {
      segments.push_back({vec(scene.points[i]), vec(scene.points[i + 1]), scene.radiusAt(i)});
    }
  }
  return segments;
}

tree::Fibers fibersOf(const scenes::FiberScene& scene) {
  tree::Fibers fibers;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t count = scene.point_begin[f + 1] - scene.point_begin[f] - 1;
    for (std::size_t i = 0; i < count; ++i) {
      fibers.ids.push_back(static_cast<tree::SegmentId>(fibers.ids.size()));
    }
    fibers.endFiber();
  }
  return fibers;
}

void registerRuns(const std::string& name, int runs, std::function<double(Numbers&)> run) {
  benchmark::RegisterBenchmark(name.c_str(),
                               [name, run = std::move(run)](benchmark::State& state) {
                                 showProgress(name);
                                 for ([[maybe_unused]] auto _ : state) {
                                   Numbers numbers;
                                   try {
                                     state.SetIterationTime(run(numbers));
                                   } catch (const std::runtime_error& error) {
                                     state.SkipWithError(error.what());
                                     return;
                                   }
                                   for (const auto& [key, value] : numbers)
                                     state.counters[key] = value;
                                 }
                               })
      ->UseManualTime()
      ->Unit(benchmark::kMillisecond)
      ->Iterations(1)
      ->Repetitions(runs);
}

}  // namespace fcl_fibers::benchmarks

int main(int argc, char** argv) {
  try {
    return fcl_fibers::benchmarks::run(argc, argv);
  } catch (const std::exception& error) {
    fcl_fibers::benchmarks::endProgress();
    std::fprintf(stderr, "fcl_fibers_trade: %s\n", error.what());
    return 1;
  }
}
