// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include <array>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <fcl_fibers/scenes/paper_scenes.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "moving_fibers.h"
#include "paper_contenders.h"
#include "parts.h"
#include "progress.h"

namespace fcl_fibers::benchmarks {
namespace {

using Poses = std::vector<fcl::Transform3d>;

constexpr int kReplays = 5;
// One of FCL's managers that takes more seconds for one step is replayed once, or not at all.
constexpr double kSlowStep = 0.05;
constexpr double kHopelessStep = 0.3;

/// `update:007`
std::string stepCounter(const char* name, std::size_t step) {
  std::array<char, 64> text;
  std::snprintf(text.data(), text.size(), "%s:%03zu", name, step);
  return text.data();
}

/// One contender that lives through all steps, from set-up on.
class Replay {
 public:
  /// Bending shortens the chords of a fiber by less than a thousandth; capsules keep the lengths
  /// they have in the first state.
  Replay(const Contender& contender, MovingFibers& fibers, const std::vector<Poses>& poses)
      : contender_(contender), fibers_(fibers), poses_(poses) {}

  void run(benchmark::State& state) {
    showProgress("replay " + contender_.title());
    for ([[maybe_unused]] auto _ : state) {
      moveTo(0);
      fibers_.computeBoxes(contender_.boxes);
      const std::unique_ptr<Manager> manager = contender_.set_up(fibers_);
      double total = detect(*manager, 0, state);
      for (std::size_t step = 1; step < poses_.size(); ++step) {
        moveTo(step);
        const double taken = seconds([&] { update(contender_, fibers_, *manager); });
        state.counters[stepCounter("update", step)] = taken;
        countCages(*manager, step, state);
        total += taken + detect(*manager, step, state);
      }
      state.SetIterationTime(total);
    }
  }

 private:
  void moveTo(std::size_t step) {
    for (std::size_t i = 0; i < poses_[step].size(); ++i) {
      fibers_.objects()[i]->setTransform(poses_[step][i]);
    }
  }

  static double detect(const Manager& manager, std::size_t step, benchmark::State& state) {
    std::size_t pairs = 0;
    const double taken = seconds([&] { pairs = countPairs(manager); });
    state.counters[stepCounter("detection", step)] = taken;
    state.counters[stepCounter("pairs", step)] = static_cast<double>(pairs);
    return taken;
  }

  static void countCages(const Manager& manager, std::size_t step, benchmark::State& state) {
    const auto* spheres = dynamic_cast<const WrappedSphereTreeCollisionManagerd*>(&manager);
    if (spheres == nullptr) return;
    const CascadeStatistics cages = spheres->cascadeStatistics();
    state.counters[stepCounter("cages_kept", step)] = static_cast<double>(cages.cages_kept);
    state.counters[stepCounter("cages_recomputed", step)] =
        static_cast<double>(cages.cages_recomputed);
  }

  const Contender& contender_;
  MovingFibers& fibers_;
  const std::vector<Poses>& poses_;
};

std::vector<Poses> posesOfAllSteps(const scenes::PaperDynamic& assembly) {
  std::vector<Poses> poses;
  for (int step = 0; step < assembly.steps(); ++step) {
    if (progressOverwrites()) {
      showProgress("dynamic assembly: make step " + std::to_string(step));
    }
    poses.push_back(scenes::segmentPoses<double>(assembly.scene(step)));
  }
  endProgress();
  return poses;
}

int replaysOf(const Contender& contender, const Preflight& preflight) {
  if (!preflight.right()) return 0;
  const double step = preflight.seconds[static_cast<std::size_t>(Phase::kUpdate)] +
                      preflight.seconds[static_cast<std::size_t>(Phase::kSelfCollision)];
  if (contender.ours || step <= kSlowStep) return kReplays;
  return step <= kHopelessStep ? 1 : 0;
}

}  // namespace

bool timeDynamicAssembly(const PartRequest& request) {
  scenes::PaperDynamicParameters parameters;
  if (request.scene.fibers > 0) parameters.fibers = request.scene.fibers;
  if (request.scene.segments > 0) parameters.segments = request.scene.segments;
  parameters.seed = request.scene.seed;
  const scenes::PaperDynamic assembly(parameters);
  const scenes::FiberScene first = assembly.scene(0);
  const std::vector<Contender> contenders = paperContenders(Fcl::kAll);

  // What is checked are the middle of the motion and its end.
  const int last = assembly.steps() - 1;
  MovingFibers checked_fibers("dynamic", assembly.scene(last / 2), assembly.scene(last));
  PreflightLimits limits;
  limits.phase_seconds = request.limit;
  const std::vector<Preflight> preflights = checkContenders(contenders, checked_fibers, limits);
  registerChecked(contenders, preflights, checked_fibers);

  const std::vector<Poses> poses = posesOfAllSteps(assembly);
  MovingFibers fibers("dynamic", first, first);
  std::vector<Replay> replays;
  replays.reserve(contenders.size());
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const int count = replaysOf(contenders[i], preflights[i]);
    if (count == 0) continue;
    Replay& replay = replays.emplace_back(contenders[i], fibers, poses);
    const std::string name = "Replay/" + shortName(contenders[i]) + "/" + fibers.name();
    benchmark::RegisterBenchmark(name.c_str(),
                                 [&replay](benchmark::State& state) { replay.run(state); })
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond)
        ->Iterations(1)
        ->Repetitions(count);
  }
  runRegistered();
  return oursAreRight(contenders, preflights);
}

}  // namespace fcl_fibers::benchmarks
