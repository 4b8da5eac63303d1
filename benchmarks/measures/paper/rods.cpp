// SPDX-License-Identifier: BSD-3-Clause
#include <string>
#include <vector>

#include "scenes/cosserat_rod.h"
#include "scenes/load_trajectory.h"

#include "harness/runs.h"
#include "measures.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

/// A hair of the dynamic assembly, bent half way to the loop.
struct Hair {
  scenes::CosseratRod rod;
  scenes::RodLoad load;

  Hair() {
    constexpr double kBending = 4.7, kTwist = 3.5;
    rod.length = 15;
    rod.bending_stiffness = {kBending, kBending, kTwist};
    const std::vector<scenes::TipLoad> trajectory = scenes::loopTrajectory();
    const scenes::TipLoad& state = trajectory[trajectory.size() / 2];
    load.tip_force = state.force;
    load.tip_torque = state.torque;
  }
};

/// @param warm  from the shape under a load that differs by 2 %, as in a motion or an assembly
void registerRod(int segments, bool warm) {
  const std::string name =
      std::string("Rod/") + (warm ? "warm" : "cold") + "/segments:" + std::to_string(segments);
  tools::progress("rods: " + name);
  const Hair hair;
  scenes::RodLoad other = hair.load;
  other.tip_force *= 1.02;
  other.tip_torque *= 1.02;
  const scenes::RodShape guess = scenes::solveRod(hair.rod, other, segments);
  registerRuns(name, 5, [=](Numbers& numbers) {
    const double taken = secondsOfCall([&] {
      numbers["iterations"] =
          scenes::solveRod(hair.rod, hair.load, segments, warm ? &guess : nullptr).iterations;
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
