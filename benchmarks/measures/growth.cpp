// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>

#include "harness/runs.h"
#include "measures.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {

namespace {

constexpr double kMemoryOfLargest = 20e9;

double memoryOfMachine() {
  return static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

bool measureGrowth(const Request& request) {
  constexpr int kRuns = 5, kRunsOfLarge = 3;
  std::vector<SceneRequest> requests = {request.scene};
  if (request.scene.text == SceneRequest().text) {
    requests.clear();
    for (const char* const fibers : {"1000", "10000", "100000", "1000000"}) {
      requests.emplace_back().text = std::string("helix:segments=100,fibers=") + fibers;
    }
    if (memoryOfMachine() < kMemoryOfLargest) {
      tools::progress("growth: too little memory for a hundred million segments");
      requests.pop_back();
    }
  }
  for (const SceneRequest& scene : requests) {
    tools::progress(scene.text + ": make the scene");
    const auto scenes = std::make_shared<std::array<FiberPolylines, 2>>(twoFrames(scene));
    const auto tree =
        makeTree(fiberArrays(scenes->front()), FiberOptions{Topology::kBundle, Report::kVolumes});
    const auto segments = static_cast<double>(tree->segmentCount());
    const auto run = [=, frame = std::size_t{0}](Numbers& numbers) mutable {
      frame = 1 - frame;
      const double update = seconds([&] { tree->update(fiberArrays((*scenes)[frame])); });
      double pairs = 0;
      const double detection = secondsOfCount(*tree, Pairs{}, pairs);
      numbers = {{"segments", segments},
                 {"update", update / segments},
                 {"detection", detection / segments},
                 {"answer", pairs / segments},
                 {"bytes", static_cast<double>(tree->memoryUsage()) / segments}};
      return update + detection;
    };
    registerRuns("Growth/" + std::to_string(tree->segmentCount()),
                 segments > 2e6 ? kRunsOfLarge : kRuns, run);
  }
  return runRegistered();
}

const AddMeasure kMeasure("growth", measureGrowth);

}  // namespace

}  // namespace fcl_fibers::benchmarks
