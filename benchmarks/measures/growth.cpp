// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>

#include "harness/progress.h"
#include "harness/runs.h"
#include "measures.h"

namespace fcl_fibers::benchmarks {

bool measureGrowth(const Request& request) {
  constexpr int kRuns = 5, kRunsOfLarge = 3;
  std::vector<std::string> texts = {request.scene.text};
  if (texts[0].empty()) {
    texts.clear();
    for (const char* const fibers : {"1000", "10000", "100000"}) {
      texts.push_back(std::string("helix:segments=100,fibers=") + fibers);
    }
  }
  for (const std::string& text : texts) {
    SceneRequest helix;
    helix.text = text;
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
                 segments > 2e6 ? kRunsOfLarge : kRuns, run);
  }
  return runRegistered();
}

}  // namespace fcl_fibers::benchmarks
