// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include <memory>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_collision_manager.h>

#include "chain_scenes.h"
#include "moving_fibers.h"
#include "paper_contenders.h"
#include "parts.h"
#include "progress.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRepetitions = 3;

void detect(const Contender& contender, MovingFibers& fibers, benchmark::State& state) {
  fibers.bringTo(0, contender.boxes);
  const std::unique_ptr<Manager> manager = contender.set_up(fibers);
  std::size_t pairs = 0;
  for ([[maybe_unused]] auto _ : state) {
    state.SetIterationTime(seconds([&] { pairs = countPairs(*manager); }));
  }
  state.counters["segments"] = static_cast<double>(fibers.segmentCount());
  state.counters["pairs"] = static_cast<double>(pairs);
  if (const auto* ours = dynamic_cast<const FiberCollisionManager<double>*>(manager.get())) {
    state.counters["volume_tests"] =
        static_cast<double>(ours->selfCollisionStatistics().volume_tests);
  }
}

}  // namespace

bool countChain(const PartRequest& request) {
  const scenes::FiberScene scene =
      makeChain(chainOfName(request.chain), request.edge, request.scene.seed);
  MovingFibers fibers(request.chain, scene, scene);
  const std::vector<Contender> contenders = paperContenders(Fcl::kDynamicTree);
  PreflightLimits limits;
  limits.phase_seconds = request.limit;
  limits.update = false;
  const std::vector<Preflight> preflights = checkContenders(contenders, fibers, limits);
  registerChecked(contenders, preflights, fibers);
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    if (!preflights[i].right()) continue;
    const std::string name = "Chain/" + shortName(contenders[i]) + "/" + fibers.name();
    benchmark::RegisterBenchmark(name.c_str(),
                                 [&contender = contenders[i], &fibers](benchmark::State& state) {
                                   detect(contender, fibers, state);
                                 })
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond)
        ->Iterations(1)
        ->Repetitions(kRepetitions);
  }
  runRegistered();
  return oursAreRight(contenders, preflights);
}

}  // namespace fcl_fibers::benchmarks
