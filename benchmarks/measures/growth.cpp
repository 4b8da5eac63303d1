// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstddef>
#include <memory>
#include <string>

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>

#include "harness/progress.h"
#include "harness/runs.h"
#include "measures.h"

namespace fcl_fibers::benchmarks {

bool measureGrowth(const Request&) {
  constexpr int kLargest = 100'000;  // fibers of 100 segments
  constexpr int kRuns = 5, kRunsOfLargest = 3;
  for (const int fibers : {1'000, 10'000, kLargest}) {
    SceneRequest helix;
    helix.text = "helix:segments=100,fibers=" + std::to_string(fibers);
    showProgress(helix.text + ": make the scene");
    const auto scenes = std::make_shared<std::array<FiberPolylines, 2>>(twoFrames(helix));
    const auto tree = std::make_shared<FiberTree>();
    tree->build(fiberArrays(scenes->front()));
    const auto segments = static_cast<double>(tree->segmentCount());
    const auto run = [=, frame = std::size_t{0}](Numbers& numbers) mutable {
      frame = 1 - frame;
      const double update = seconds([&] { tree->update(fiberArrays((*scenes)[frame])); });
      std::size_t pairs = 0;
      const double detection = seconds([&] { tree->visitPairs([&](SegmentPair) { ++pairs; }); });
      numbers = {{"segments", segments},
                 {"update", update / segments},
                 {"detection", detection / segments},
                 {"answer", static_cast<double>(pairs) / segments},
                 {"bytes", static_cast<double>(tree->memoryUsage()) / segments}};
      return update + detection;
    };
    registerRuns("Growth/" + std::to_string(tree->segmentCount()),
                 fibers == kLargest ? kRunsOfLargest : kRuns, run);
  }
  return runRegistered();
}

}  // namespace fcl_fibers::benchmarks
