// SPDX-License-Identifier: BSD-3-Clause
#include <string>
#include <vector>

#include "scenes/hair.h"
#include "scenes/paper_scenes.h"

#include "harness/runs.h"
#include "measures.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

/// Of a hair of the dynamic assembly, bent half way to the loop.
/// @param warm  from the shape under a load that differs by 2 %, as in a motion or an assembly
void registerRod(int segments, bool warm) {
  const std::string name =
      std::string("Rod/") + (warm ? "warm" : "cold") + "/segments:" + std::to_string(segments);
  tools::progress("rods: " + name);
  const scenes::CosseratRod rod = scenes::hair(15);
  const scenes::RodLoad load = scenes::loopTrajectory()[50];
  const scenes::RodShape guess = scenes::solveRod(rod, scenes::scaled(load, 1.02), segments);
  registerRuns(name, 5, [=](Numbers& numbers) {
    const double taken = secondsOfCall([&] {
      numbers["iterations"] =
          scenes::solveRod(rod, load, segments, warm ? &guess : nullptr).iterations;
    });
    numbers["segments"] = segments;
    return taken;
  });
}

void registerScene(const std::string& name) {
  constexpr int kRuns = 3;
  registerRuns("Make/" + name, kRuns, [name](Numbers& numbers) {
    FiberPolylines scene;
    const double taken = seconds([&] { scene = openScene(name, {}).scene(); });
    numbers["fibers"] = static_cast<double>(scene.fiberCount());
    numbers["segments"] = static_cast<double>(scene.segmentCount());
    return taken;
  });
}

bool measureRods(const Request&) {
  for (const int segments : {25, 50, 100, 200, 400}) {
    registerRod(segments, true);
    registerRod(segments, false);
  }
  for (const char* scene : {"paper-static", "paper-half-scalp", "paper-strand"}) {
    registerScene(scene);
  }
  return runRegistered();
}

const AddMeasure kMeasure("rods", measureRods);

}  // namespace

}  // namespace fcl_fibers::benchmarks
