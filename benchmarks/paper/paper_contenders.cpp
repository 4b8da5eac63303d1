// SPDX-License-Identifier: BSD-3-Clause
#include "paper_contenders.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <memory>
#include <utility>

#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "progress.h"

namespace fcl_fibers::benchmarks {
namespace {

/// Bounds are rounded outward, so that ours may report a few more pairs of boxes, and none less.
constexpr double kRoundingExcess = 0.01;

template <typename FiberManager>
std::unique_ptr<Manager> setUpOurs(const MovingFibers& fibers, const FiberManagerOptions& options) {
  auto manager = std::make_unique<FiberManager>(options);
  for (const MovingFibers::Fiber& fiber : fibers.fibers()) {
    manager->registerFiber(fiber.objects, fiber.ends);
  }
  manager->setup();
  return manager;
}

template <typename FiberManager>
Contender ours(const char* manager, const char* variant, Topology topology, Report report,
               Reported reported) {
  FiberManagerOptions options;
  options.topology = topology;
  options.report = report;
  options.ignored_neighbors = 1;
  return {manager, variant, true, Boxes::kNone, reported, [options](const MovingFibers& fibers) {
            return setUpOurs<FiberManager>(fibers, options);
          }};
}

/// Pairs of adjacent segments, which ours leave out: each overlaps and touches.
std::size_t adjacentPairs(const MovingFibers& fibers) {
  std::size_t pairs = 0;
  for (const MovingFibers::Fiber& fiber : fibers.fibers()) {
    const std::size_t segments = fiber.objects.size();
    if (segments > 1) pairs += segments - 1;
    if (segments > 2 && fiber.ends == FiberEnds::kClosed) ++pairs;
  }
  return pairs;
}

/// What a contender would have counted with adjacent segments.
std::size_t withAdjacent(const Contender& contender, const MovingFibers& fibers,
                         std::size_t pairs) {
  return pairs + (contender.ours ? adjacentPairs(fibers) : 0);
}

void judgeWrong(Preflight& result, std::size_t pairs, std::size_t due, const char* kind) {
  result.verdict = Preflight::Verdict::kWrong;
  result.phase = Phase::kSelfCollision;
  result.note =
      "wrong: " + std::to_string(pairs) + kind + " pairs instead of " + std::to_string(due);
}

/// A contender that ended too late is judged by what it did report.
bool isJudged(const Preflight& result, std::size_t frame) {
  return result.frames[frame].checked && result.verdict != Preflight::Verdict::kWrong;
}

void judgeTouching(const std::vector<Contender>& contenders, const MovingFibers& fibers,
                   std::size_t frame, std::vector<Preflight>& results) {
  std::size_t due = 0;
  const auto touching = [&](std::size_t i) {
    return withAdjacent(contenders[i], fibers, results[i].frames[frame].touching);
  };
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    if (isJudged(results[i], frame)) due = std::max(due, touching(i));
  }
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    if (isJudged(results[i], frame) && touching(i) < due) {
      judgeWrong(results[i], touching(i), due, " touching");
    }
  }
}

void judgeVolumes(const std::vector<Contender>& contenders, const MovingFibers& fibers,
                  Reported group, std::size_t frame, std::vector<Preflight>& results) {
  std::vector<std::size_t> judged;
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    if (contenders[i].reported == group && isJudged(results[i], frame)) judged.push_back(i);
  }
  if (judged.empty()) return;
  const auto reported = [&](std::size_t i) {
    return withAdjacent(contenders[i], fibers, results[i].frames[frame].reported);
  };
  // FCL's is what the group is held to, if there is one, or else the fewest pairs.
  const std::size_t reference =
      *std::min_element(judged.begin(), judged.end(), [&](std::size_t i, std::size_t j) {
        return std::make_pair(contenders[i].ours, reported(i)) <
               std::make_pair(contenders[j].ours, reported(j));
      });
  const std::size_t due = reported(reference);
  for (const std::size_t i : judged) {
    const bool more = static_cast<double>(reported(i)) > (1 + kRoundingExcess) * double(due);
    if (reported(i) < due || more) judgeWrong(results[i], reported(i), due, "");
  }
}

}  // namespace

std::vector<Contender> paperContenders(Fcl fcl) {
  using Boxes = LayeredAABBTreeCollisionManagerd;
  using Spheres = WrappedSphereTreeCollisionManagerd;
  constexpr auto kVolumes = Report::kVolumes;
  std::vector<Contender> contenders = {
      ours<Boxes>("LayeredAABBTree", "super_thread", Topology::kSuperThread, kVolumes,
                  Reported::kTightBoxes),
      ours<Spheres>("WrappedSphereTree", "super_thread", Topology::kSuperThread, kVolumes,
                    Reported::kSpheres),
      ours<Boxes>("LayeredAABBTree", "bundle", Topology::kBundle, kVolumes, Reported::kTightBoxes),
      ours<Spheres>("WrappedSphereTree", "bundle", Topology::kBundle, kVolumes, Reported::kSpheres),
      ours<Boxes>("LayeredAABBTree", "bundle_capsules", Topology::kBundle, Report::kCapsules,
                  Reported::kTouching),
  };
  for (Contender& contender : allContenders()) {
    const bool is_tree = contender.manager == "DynamicAABBTree";
    if (contender.ours || contender.variant != "tight" || (fcl != Fcl::kAll && !is_tree)) continue;
    contenders.push_back(std::move(contender));
  }
  return contenders;
}

std::string shortName(const Contender& contender) {
  return contender.manager + "/" + contender.variant;
}

std::vector<Preflight> checkContenders(const std::vector<Contender>& contenders,
                                       MovingFibers& fibers, const PreflightLimits& limits) {
  std::vector<Preflight> results;
  for (const Contender& contender : contenders) {
    showProgress(fibers.name() + ": check " + std::to_string(results.size() + 1) + "/" +
                 std::to_string(contenders.size()) + ": " + contender.title());
    results.push_back(preflight(contender, fibers, limits));
  }
  for (std::size_t frame = 0; frame < MovingFibers::kFrames; ++frame) {
    judgeTouching(contenders, fibers, frame, results);
    judgeVolumes(contenders, fibers, Reported::kTightBoxes, frame, results);
    judgeVolumes(contenders, fibers, Reported::kSpheres, frame, results);
  }
  endProgress();
  return results;
}

bool oursAreRight(const std::vector<Contender>& contenders,
                  const std::vector<Preflight>& preflights) {
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const bool slow = preflights[i].verdict == Preflight::Verdict::kTooSlow;
    if (contenders[i].ours && !preflights[i].right() && !slow) return false;
  }
  return true;
}

void registerChecked(const std::vector<Contender>& contenders,
                     const std::vector<Preflight>& preflights, const MovingFibers& fibers) {
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const std::string name = "Checked/" + shortName(contenders[i]) + "/" + fibers.name();
    const auto report = [result = preflights[i], fiber_count = fibers.fiberCount(),
                         segments = fibers.segmentCount()](benchmark::State& state) {
      for ([[maybe_unused]] auto _ : state) state.SetIterationTime(0);
      const auto count = [&](const char* counter, std::size_t value) {
        state.counters[counter] = static_cast<double>(value);
      };
      count("fibers", fiber_count);
      count("segments", segments);
      // A killed contender leaves counts of zero, which are not what it would have counted.
      if (result.frames[0].checked) {
        count("pairs", result.frames[0].reported);
        count("touching", result.frames[0].touching);
      }
      if (result.bytes > 0) count("bytes", result.bytes);
      if (result.bytes_stated > 0) count("bytes_stated", result.bytes_stated);
      if (result.volume_tests > 0) count("volume_tests", result.volume_tests);
      state.counters["seconds_set_up"] = result.seconds[0];
      state.counters["seconds_update"] = result.seconds[1];
      state.counters["seconds_self_collision"] = result.seconds[2];
      count("ended_in_phase", static_cast<std::size_t>(result.phase));
      state.SetLabel(result.note);
    };
    benchmark::RegisterBenchmark(name.c_str(), report)
        ->UseManualTime()
        ->Iterations(1)
        ->Repetitions(1);
  }
}

}  // namespace fcl_fibers::benchmarks
