// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "moving_fibers.h"
#include "paper_contenders.h"
#include "parts.h"
#include "progress.h"
#include "row_order.h"
#include "timings.h"

namespace fcl_fibers::benchmarks {
namespace {

/// A phase that takes longer is timed once, by the check: repetitions would take most of the time.
constexpr double kOnceFromSeconds = 5;

/// The contenders that `only` names, and one that the others' counts are held against.
std::vector<Contender> chosenContenders(const PartRequest& request) {
  std::vector<Contender> contenders =
      paperContenders(request.all_of_fcl ? Fcl::kAll : Fcl::kDynamicTree);
  if (request.only.empty()) return contenders;
  const std::string names = "," + request.only + ",LayeredAABBTree/bundle,";
  contenders.erase(std::remove_if(contenders.begin(), contenders.end(),
                                  [&](const Contender& contender) {
                                    return names.find("," + shortName(contender) + ",") ==
                                           std::string::npos;
                                  }),
                   contenders.end());
  return contenders;
}

bool isTimed(const Preflight& preflight) {
  const auto& seconds = preflight.seconds;
  return preflight.right() && std::none_of(seconds.begin(), seconds.end(),
                                           [](double phase) { return phase > kOnceFromSeconds; });
}

/// Ours whose detection takes too long still have an update worth knowing: taken once.
void registerUpdate(const Contender& contender, MovingFibers& fibers) {
  const std::string name = "Update/" + shortName(contender) + "/" + fibers.name();
  benchmark::RegisterBenchmark(
      name.c_str(),
      [&contender, &fibers](benchmark::State& state) {
        fibers.bringTo(0, contender.boxes);
        const auto manager = contender.set_up(fibers);
        for ([[maybe_unused]] auto _ : state) {
          fibers.setPoses(1);
          state.SetIterationTime(seconds([&] { update(contender, fibers, *manager); }));
        }
      })
      ->UseManualTime()
      ->Unit(benchmark::kMillisecond)
      ->Iterations(1)
      ->Repetitions(1);
}

bool endedInDetection(const Preflight& preflight) {
  return preflight.verdict == Preflight::Verdict::kTooSlow &&
         preflight.phase == Phase::kSelfCollision;
}

}  // namespace

bool timeScene(const PartRequest& request) {
  const std::string name =
      request.scene.hair.path.empty() ? request.scene.name : hairName(request.scene.hair);
  showProgress(name + ": make the scene");
  const std::vector<Contender> contenders = chosenContenders(request);
  scenes::FiberScene scene = makePaperScene(request.scene, 0),
                     moved = makePaperScene(request.scene, 1);
  if (request.rows) {
    const std::vector<std::size_t> order = rowsOfRoots(scene);
    scene = reordered(scene, order);
    moved = reordered(moved, order);
  }
  MovingFibers fibers(name, std::move(scene), std::move(moved));

  PreflightLimits limits;
  limits.phase_seconds = request.limit;
  const std::vector<Preflight> checked = checkContenders(contenders, fibers, limits);
  registerChecked(contenders, checked, fibers);

  std::vector<Contender> timed;
  std::vector<Preflight> timed_preflights;
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    if (contenders[i].ours && endedInDetection(checked[i])) registerUpdate(contenders[i], fibers);
    if (!isTimed(checked[i])) continue;
    timed.push_back(contenders[i]);
    timed_preflights.push_back(checked[i]);
  }
  timeContenders(timed, timed_preflights, fibers, /*choose_repetitions=*/true);
  return oursAreRight(contenders, checked) && oursAreRight(timed, timed_preflights);
}

}  // namespace fcl_fibers::benchmarks
