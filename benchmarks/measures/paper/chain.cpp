// SPDX-License-Identifier: BSD-3-Clause
#include "measures/paper/chain_scenes.h"

#include <memory>
#include <vector>

#include "harness/frame_runs.h"
#include "measures.h"
#include "measures/paper/tree_scene.h"
#include "tests/support/volume_tests.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 3;

double detect(const Contender& contender, MovingFibers& fibers, Numbers& numbers) {
  contender.bringTo(fibers, 0);
  const std::unique_ptr<Manager> manager = contender.setUp(fibers);
  PairCount count;
  const double taken = seconds([&] { count = countPairs(*manager); });
  numbers["segments"] = static_cast<double>(fibers.segmentCount());
  numbers["pairs"] = static_cast<double>(count.pairs);
  return taken;
}

bool measureChain(const Request& request) {
  const FiberPolylines scene = makeChain(chainOfName(request.chain), request.edge);
  MovingFibers fibers(request.chain, scene, scene);
  std::vector<Contender> contenders = paperTrees();
  contenders.push_back(allOf({Group::kFclTrees}, Boxes::kTight).front());
  PreflightLimits limits;
  limits.phase_seconds = request.limit;
  limits.update = false;
  const std::vector<Preflight> checked = preflightAll(contenders, fibers, limits);
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const Contender& contender = contenders[i];
    registerChecked(contender, checked[i], fibers);
    if (!checked[i].right()) continue;
    double volume_tests = 0;
    if (contender.ours) {
      withTree(contender, fibers, [&](const auto& tree) {
        volume_tests = static_cast<double>(test::countVolumeTests(tree).tests);
      });
    }
    const auto run = [&, volume_tests](Numbers& numbers) {
      if (contender.ours) numbers["volume_tests"] = volume_tests;
      return detect(contender, fibers, numbers);
    };
    registerRuns("Chain/" + contender.name(), kRuns, run, contender.ours);
  }
  return runRegistered() && oursAreRight(contenders, checked);
}

const AddMeasure kMeasure("chain", measureChain);

}  // namespace

}  // namespace fcl_fibers::benchmarks
