// SPDX-License-Identifier: BSD-3-Clause
//
// How much faster than FCL and Embree our box tree is, against the figures that it is to reach. One
// run is one part, whose numbers go to a file of Google Benchmark's; report.py makes the tables:
//
//   fcl_fibers_full --part=scene --scene=static|strand|half_scalp|dynamic
//                   [--fibers=N] [--segments=N] [--seed=1] --benchmark_out=FILE.json
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

#include "foreign_tree.h"
#include "parts.h"
#include "progress.h"
#include "table.h"

namespace fcl_fibers::benchmarks {
namespace {

struct Arguments {
  std::string part = "scene";
  PartRequest request;
  std::vector<char*> others;  ///< program name and Google Benchmark's flags
};

int parseCount(const std::string& argument, const std::string& value) {
  std::size_t end = 0;
  int count = -1;
  try {
    count = std::stoi(value, &end);
  } catch (const std::logic_error&) {
  }
  if (value.empty() || end != value.size() || count < 0) {
    throw std::invalid_argument(argument + ": give a number of at least 0");
  }
  return count;
}

/// Whether the argument is one of ours.
bool parseArgument(const std::string& argument, Arguments& arguments) {
  const std::size_t equals = std::min(argument.find('='), argument.size());
  const std::string flag = argument.substr(0, equals);
  const std::string value = equals < argument.size() ? argument.substr(equals + 1) : std::string();
  PartRequest& request = arguments.request;
  if (flag == "--part") {
    arguments.part = value;
  } else if (flag == "--scene") {
    request.scene = value;
  } else if (flag == "--fibers") {
    request.fibers = parseCount(argument, value);
  } else if (flag == "--segments") {
    request.segments = parseCount(argument, value);
  } else if (flag == "--seed") {
    request.seed = static_cast<unsigned long long>(parseCount(argument, value));
  } else {
    return false;
  }
  return true;
}

void initializeBenchmark(int argc, char** argv, const Arguments& arguments) {
  // Before the user's flags, so that theirs win.
  std::string interleaving = "--benchmark_enable_random_interleaving=true";
  std::vector<char*> flags = arguments.others;
  flags.insert(flags.begin() + 1, interleaving.data());
  int count = static_cast<int>(flags.size());
  benchmark::Initialize(&count, flags.data());
  if (benchmark::ReportUnrecognizedArguments(count, flags.data())) {
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

bool runPart(const Arguments& arguments) {
  if (arguments.part == "scene") return timeScene(arguments.request);
  if (arguments.part == "queries") return timeQueries(arguments.request);
  if (arguments.part == "growth") return timeGrowth(arguments.request);
  throw std::invalid_argument("--part=" + arguments.part + ": there are scene, queries and growth");
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
  Arguments arguments;
  for (int i = 0; i < argc; ++i) {
    if (i == 0 || !parseArgument(argv[i], arguments)) arguments.others.push_back(argv[i]);
  }
  initializeBenchmark(argc, argv, arguments);
  const bool right = runPart(arguments);
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
