// SPDX-License-Identifier: BSD-3-Clause
//
// What Sobottka, Varnik and Weber measured in section 4, measured again. One run is one part:
//
//   fcl_fibers_paper --part=scene --scene=static|axis_parallel|half_scalp|strand
//                    [--fibers=N] [--segments=N] [--all_of_fcl] [--only=NAME,...] [--limit=10]
//   fcl_fibers_paper --part=dynamic
//   fcl_fibers_paper --part=chain --chain=random|snake --edge=N
//   fcl_fibers_paper --part=radii [--full]
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

#include "parts.h"
#include "progress.h"
#include "table.h"

namespace fcl_fibers::benchmarks {
namespace {

struct Arguments {
  std::string part;
  PartRequest request;
  std::vector<char*> others;  ///< program name and Google Benchmark's flags
};

double parseNumber(const std::string& argument, const std::string& value, double least) {
  std::size_t end = 0;
  double number = least - 1;
  try {
    number = std::stod(value, &end);
  } catch (const std::logic_error&) {
  }
  if (value.empty() || end != value.size() || !(number >= least)) {
    throw std::invalid_argument(argument + ": give a number of at least " + std::to_string(least));
  }
  return number;
}

/// False if the argument is not one of ours.
bool parseArgument(const std::string& argument, Arguments& arguments) {
  const std::size_t equals = std::min(argument.find('='), argument.size());
  const std::string flag = argument.substr(0, equals);
  const std::string value = equals < argument.size() ? argument.substr(equals + 1) : std::string();
  PartRequest& request = arguments.request;
  if (flag == "--part") {
    arguments.part = value;
  } else if (flag == "--scene") {
    request.scene.name = value;
  } else if (flag == "--fibers") {
    request.scene.fibers = static_cast<int>(parseNumber(argument, value, 1));
  } else if (flag == "--segments") {
    request.scene.segments = static_cast<int>(parseNumber(argument, value, 1));
  } else if (flag == "--seed") {
    request.scene.seed = static_cast<unsigned long long>(parseNumber(argument, value, 0));
  } else if (flag == "--limit") {
    request.limit = parseNumber(argument, value, 0.01);
  } else if (flag == "--chain") {
    request.chain = value;
  } else if (flag == "--edge") {
    request.edge = 2 * static_cast<int>(parseNumber(argument, value, 2) / 2);
  } else if (flag == "--only") {
    request.only = value;
  } else if (flag == "--out_dir") {
    request.out_dir = value;
  } else if (argument == "--all_of_fcl") {
    request.all_of_fcl = true;
  } else if (argument == "--full") {
    request.full = true;
  } else {
    return false;
  }
  return true;
}

void initializeBenchmark(int argc, char** argv, const Arguments& arguments) {
  // Before the user's flags, so that theirs win. A frame is an update and a self-collision, which
  // are timed apart.
  std::string interleaving = "--benchmark_enable_random_interleaving=true";
  std::string filter = "--benchmark_filter=-^Frame/";
  std::vector<char*> flags = arguments.others;
  flags.insert(flags.begin() + 1, {interleaving.data(), filter.data()});
  int count = static_cast<int>(flags.size());
  benchmark::Initialize(&count, flags.data());
  if (benchmark::ReportUnrecognizedArguments(count, flags.data())) {
    throw std::invalid_argument("see the head of benchmarks/paper/main.cpp");
  }
  const Circumstances where = circumstances(argc, argv);
  benchmark::AddCustomContext("machine", where.machine);
  benchmark::AddCustomContext("compiler", where.compiler);
  benchmark::AddCustomContext("build_type", where.build_type);
  benchmark::AddCustomContext("commit", where.commit);
  benchmark::AddCustomContext("command", where.command);
  benchmark::AddCustomContext("seed", std::to_string(arguments.request.scene.seed));
  benchmark::AddCustomContext("limit", std::to_string(arguments.request.limit));
}

/// Returns whether all of ours are right.
bool runPart(const std::string& part, const PartRequest& request) {
  if (part == "scene") return timeScene(request);
  if (part == "dynamic") return timeDynamicAssembly(request);
  if (part == "chain") return countChain(request);
  if (part == "radii") {
    compareRadii(request);
  } else if (part == "rods") {
    timeRods(request);
  } else if (part == "pictures") {
    writePictures(request);
  } else {
    throw std::invalid_argument("--part=" + part +
                                ": there are scene, dynamic, chain, radii, rods and pictures");
  }
  return true;
}

class SilentReporter : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>&) override {}
};

int run(int argc, char** argv) {
  Arguments arguments;
  for (int i = 0; i < argc; ++i) {
    if (i == 0 || !parseArgument(argv[i], arguments)) arguments.others.push_back(argv[i]);
  }
  initializeBenchmark(argc, argv, arguments);
  const bool right = runPart(arguments.part, arguments.request);
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
