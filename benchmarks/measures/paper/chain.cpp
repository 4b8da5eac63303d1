// SPDX-License-Identifier: BSD-3-Clause
#include "measures/paper/chain_scenes.h"

#include <memory>
#include <vector>

#include <fcl_fibers/fiber_collision_manager.h>

#include "harness/frame_runs.h"
#include "measures.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 3;

double detect(const Contender& contender, MovingFibers& fibers, Numbers& numbers) {
  fibers.bringTo(0, contender.boxes);
  const std::unique_ptr<Manager> manager = contender.setUp(fibers);
  PairCount count;
  const double taken = seconds([&] { count = countPairs(*manager); });
  numbers["segments"] = static_cast<double>(fibers.segmentCount());
  numbers["pairs"] = static_cast<double>(count.pairs);
  if (const auto* ours = dynamic_cast<const FiberCollisionManager<double>*>(manager.get())) {
    numbers["volume_tests"] = static_cast<double>(ours->selfCollisionStatistics().volume_tests);
  }
  return taken;
}

}  // namespace

bool measureChain(const Request& request) {
  const scenes::FiberScene scene = makeChain(chainOfName(request.chain), request.edge);
  MovingFibers fibers(request.chain, scene, scene);
  std::vector<Contender> contenders = paperTrees();
  contenders.push_back(fclManagers(Boxes::kTight).front());
  PreflightLimits limits;
  limits.phase_seconds = request.limit;
  limits.update = false;
  const std::vector<Preflight> checked = preflightAll(contenders, fibers, limits);
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const Contender& contender = contenders[i];
    registerChecked(contender, checked[i], fibers);
    if (!checked[i].right()) continue;
    const auto run = [&](Numbers& numbers) { return detect(contender, fibers, numbers); };
    registerRuns("Chain/" + contender.name(), kRuns, run, contender.ours);
  }
  return runRegistered() && oursAreRight(contenders, checked);
}

}  // namespace fcl_fibers::benchmarks
