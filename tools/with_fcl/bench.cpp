// SPDX-License-Identifier: BSD-3-Clause
#include "bench.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "bench_meshes.h"
#include "contenders/contender.h"
#include "judge/preflight.h"
#include "scenes.h"
#include "tools/commands.h"

namespace fcl_fibers::tools {
namespace {

using benchmarks::Contender;
using benchmarks::MovingFibers;
using benchmarks::Phase;
using benchmarks::Preflight;

/// Our managers and FCL's. FCL's slow ones, the paper's trees and threads come only with --all.
std::vector<Contender> contenders(bool all) {
  std::vector<Contender> chosen;
  const auto add = [&](const std::vector<Contender>& more, auto&& isUsual) {
    std::copy_if(more.begin(), more.end(), std::back_inserter(chosen),
                 [&](const Contender& contender) { return all || isUsual(contender); });
  };
  add(benchmarks::ourContenders(), [](const Contender& contender) {
    return contender.variant == "boxes" || contender.variant == "spheres" ||
           contender.variant == "capsules";
  });
  for (const auto boxes : {benchmarks::Boxes::kStock, benchmarks::Boxes::kTight}) {
    add(benchmarks::fclManagers(boxes),
        [](const Contender& contender) { return contender.manager.find("DynamicAABBTree") == 0; });
  }
  return chosen;
}

struct Result {
  Contender contender;
  Preflight preflight;
  std::array<std::vector<double>, benchmarks::kPhases> seconds;

  double median(std::size_t phase) const {
    std::vector<double> sorted = seconds[phase];
    if (sorted.empty()) return std::numeric_limits<double>::quiet_NaN();
    std::sort(sorted.begin(), sorted.end());
    return sorted[sorted.size() / 2];
  }
};

/// Times the managers in random order, so that a slow phase of the machine does not hit one of them
/// only.
void timeAll(std::vector<Result>& results, MovingFibers& fibers, int repetitions) {
  std::vector<Result*> order;
  for (Result& result : results) {
    if (result.preflight.right()) order.push_back(&result);
  }
  std::mt19937 random(1);
  for (int repetition = 0; repetition < repetitions; ++repetition) {
    std::shuffle(order.begin(), order.end(), random);
    for (Result* result : order) {
      const Contender& contender = result->contender;
      progress(fmt::format("timing {} of {}: {}", repetition + 1, repetitions, contender.title()));
      std::unique_ptr<benchmarks::Manager> manager;
      fibers.setPoses(0);
      const auto time = [&](Phase phase, auto&& work) {
        result->seconds[static_cast<std::size_t>(phase)].push_back(benchmarks::seconds(work));
      };
      time(Phase::kSetUp, [&] {
        fibers.computeBoxes(contender.boxes);
        manager = contender.setUp(fibers);
      });
      fibers.setPoses(1);
      time(Phase::kUpdate, [&] { benchmarks::update(contender, fibers, *manager); });
      time(Phase::kDetection, [&] { benchmarks::countPairs(*manager); });
    }
  }
}

std::string milliseconds(double seconds) {
  return std::isnan(seconds) ? "-" : fmt::format("{:.{}f}", 1e3 * seconds, seconds < 0.1 ? 2 : 0);
}

/// The processor's name, where Linux tells it.
std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(": ") + 2);
  }
  return "unknown processor";
}

std::string compiler() {
#ifdef __clang__
  return "clang " __clang_version__;
#else
  return "gcc " __VERSION__;
#endif
}

/// The most pairs that a manager reported and nobody can judge.
std::size_t undecided(const std::vector<Result>& results) {
  std::size_t most = 0;
  for (const Result& result : results) {
    most = std::max(most, result.preflight.frames[0].undecided);
  }
  return most;
}

nlohmann::ordered_json rowJson(const MeshFinderResult& result) {
  nlohmann::ordered_json row = {{"finder", result.finder}, {"touching", result.touching}};
  if (result.candidates) row["candidates"] = *result.candidates;
  row["missed"] = result.missed;
  row["extra"] = result.extra;
  row["undecided"] = result.undecided;
  row["set_up_s"] = result.set_up_seconds;
  row["query_s"] = result.query_seconds;
  return row;
}

std::string meshTable(const std::vector<MeshFile>& meshes,
                      const std::vector<MeshFinderResult>& finders) {
  std::string text;
  for (const MeshFile& mesh : meshes) {
    text += fmt::format("\nwith {}: {}", mesh.name, counted(mesh.mesh.triangleCount(), "triangle"));
  }
  text += fmt::format("\n\n{:<40}{:>12}{:>12}{:>14}{:>12}{:>10}{:>8}\n", "segments and meshes",
                      "set-up ms", "query ms", "candidates", "touching", "missed", "extra");
  for (const MeshFinderResult& result : finders) {
    text +=
        fmt::format("{:<40}{:>12}{:>12}{:>14}{:>12}{:>10}{:>8}\n", result.finder,
                    milliseconds(result.set_up_seconds), milliseconds(result.query_seconds),
                    result.candidates ? countText(*result.candidates) : "-",
                    countText(result.touching), countText(result.missed), countText(result.extra));
  }
  return text +
         "\nSet-up is without the trees of the meshes. FCL tests the candidates, whose boxes "
         "overlap, "
         "one by\none. Where it differs from ours, all triangles decide who is right.\n";
}

}  // namespace

int bench(const SceneSource& source, const BenchRequest& request) {
  const std::vector<MeshFile> meshes = request.meshes.read();
  progress("reading " + source.title);
  MovingFibers fibers = benchmarks::movingFibers(source);
  const std::vector<Contender> chosen = contenders(request.all);
  benchmarks::PreflightLimits limits;
  limits.phase_seconds = request.limit;
  const std::vector<Preflight> preflights = benchmarks::preflightAll(chosen, fibers, limits);
  std::vector<Result> results;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    results.push_back({chosen[i], preflights[i], {}});
  }
  timeAll(results, fibers, request.repetitions);
  std::vector<MeshFinderResult> finders;
  if (!meshes.empty()) finders = benchMeshes(source.scene(), fibers, meshes, request);
  progress("");

  const bool wrong_with_meshes =
      std::any_of(finders.begin(), finders.end(),
                  [](const MeshFinderResult& result) { return result.ours && !result.right(); });
  const bool wrong =
      wrong_with_meshes || std::any_of(results.begin(), results.end(), [](const Result& result) {
        return result.preflight.verdict == Preflight::Verdict::kWrong;
      });
  if (request.output == Output::kJson) {
    nlohmann::ordered_json json = {
        {"version", FCL_FIBERS_VERSION},      {"compiler", compiler()},
        {"processor", processor()},           {"scene", source.title},
        {"fibers", fibers.fiberCount()},      {"segments", fibers.segmentCount()},
        {"repetitions", request.repetitions}, {"managers", nlohmann::ordered_json::array()}};
    for (const Result& result : results) {
      const Preflight& preflight = result.preflight;
      nlohmann::ordered_json row = {{"manager", result.contender.title()},
                                    {"pairs", preflight.frames[0].reported},
                                    {"touching", preflight.frames[0].touching},
                                    {"undecided", preflight.frames[0].undecided},
                                    {"right", preflight.right()}};
      if (!preflight.right()) row["why"] = preflight.note + preflight.when;
      for (std::size_t p = 0; p < benchmarks::kPhases; ++p) {
        constexpr const char* kKeys[] = {"set_up_s", "update_s", "self_collision_s"};
        if (preflight.right()) row[kKeys[p]] = result.median(p);
      }
      json["managers"].push_back(std::move(row));
    }
    for (const MeshFinderResult& result : finders) json["with_meshes"].push_back(rowJson(result));
    print(json.dump(2) + "\n");
    return wrong ? 1 : 0;
  }

  std::string text =
      fmt::format("fcl_fibers {}, {}, {}\n{}: {} of {}\n\n{:<36}{:>12}{:>12}{:>16}{:>14}{:>12}\n",
                  FCL_FIBERS_VERSION, compiler(), processor(), source.title,
                  counted(fibers.segmentCount(), "segment"), counted(fibers.fiberCount(), "fiber"),
                  "manager", "set-up ms", "update ms", "collision ms", "pairs", "touching");
  for (const Result& result : results) {
    text += fmt::format("{:<36}", result.contender.title());
    if (!result.preflight.right()) {
      text += fmt::format("{:>12}  in {}{}\n", result.preflight.note,
                          benchmarks::phaseName(result.preflight.phase), result.preflight.when);
      continue;
    }
    text += fmt::format("{:>12}{:>12}{:>16}{:>14}{:>12}\n", milliseconds(result.median(0)),
                        milliseconds(result.median(1)), milliseconds(result.median(2)),
                        countText(result.preflight.frames[0].reported),
                        countText(result.preflight.frames[0].touching));
  }
  if (const std::size_t pairs = undecided(results); pairs > 0) {
    text += fmt::format(
        "\nTouching pairs are without {} that are within 1e-9 of contact. Rounding decides these, "
        "so "
        "no\nmanager is judged by them.\n",
        countText(pairs));
  }
  text += fmt::format(
      "\nTimes are medians of {} runs, with the managers in random order. A manager is timed only "
      "if it\nfinds each touching pair once, before and after a motion. Pairs are volumes or "
      "boxes that overlap;\n\"capsules\" reports only capsules that touch. \"tight\" boxes are "
      "ours, \"stock\" boxes FCL's own.\nAdjacent segments count, because FCL knows no fibers. "
      "benchmarks/run.sh measures with more care.\n",
      request.repetitions);
  if (!finders.empty()) text += meshTable(meshes, finders);
  print(text);
  return wrong ? 1 : 0;
}

}  // namespace fcl_fibers::tools
