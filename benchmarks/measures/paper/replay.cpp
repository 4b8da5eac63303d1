// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "harness/frame_runs.h"
#include "measures.h"
#include "measures/paper/tree_scene.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kReplays = 5;
// One of FCL's managers that takes more seconds for one step is replayed once, or not at all.
constexpr double kSlowStep = 0.05;
constexpr double kHopelessStep = 0.3;

/// Whoever takes longer in any phase, which some never end, would not be replayed.
constexpr double kMostSeconds = 10;

/// `update:007`
std::string counterName(const char* what, int step) {
  const std::string number = std::to_string(1000 + step);
  return what + (":" + number.substr(1));
}

/// What cascade verification does at each step, in a tree that is built once.
void countCages(const Contender& contender, MovingFibers& fibers, Numbers& numbers) {
  fibers.setPoses(0);
  withTree(contender, fibers, [&](auto& tree) {
    if constexpr (std::is_same_v<decltype(tree.nodeVolume(0)), geometry::Sphere>) {
      for (int step = 1; step < fibers.frameCount(); ++step) {
        fibers.setPoses(step);
        tree.refit(TreeScene(fibers).segments, 0);
        const std::size_t recomputed = tree.hierarchy().cagesRecomputed();
        const std::size_t kept = tree.nodes().size() - recomputed;
        numbers[counterName("cages_kept", step)] = static_cast<double>(kept);
        numbers[counterName("cages_recomputed", step)] = static_cast<double>(recomputed);
      }
    }
  });
}

/// The contender lives through all steps. Returns the seconds of its updates and detections.
double replay(const Contender& contender, MovingFibers& fibers, Numbers& numbers) {
  contender.bringTo(fibers, 0);
  const std::unique_ptr<Manager> manager = contender.setUp(fibers);
  double total = 0;
  for (int step = 0; step < fibers.frameCount(); ++step) {
    const auto set = [&](const char* what, double value) {
      numbers[counterName(what, step)] = value;
    };
    if (step > 0) {
      contender.setPoses(fibers, step);
      const double taken = seconds([&] { update(contender, fibers, *manager); });
      set("update", taken);
      total += taken;
    }
    PairCount count;
    const double taken = seconds([&] { count = countPairs(*manager); });
    set("detection", taken);
    set("pairs", static_cast<double>(count.pairs));
    total += taken;
  }
  if (contender.manager == "WrappedSphereTree") countCages(contender, fibers, numbers);
  return total;
}

int replayCount(const std::vector<Contender>& contenders, const std::vector<Preflight>& checked,
                std::size_t i) {
  if (!checked[i].right()) return 0;
  if (contenders[i].ours) return kReplays;
  const double step = checked[i].frameSeconds();
  // Of each of FCL's trees only the level that was fastest in the check.
  for (std::size_t j = 0; j < contenders.size(); ++j) {
    const bool same = contenders[j].manager == contenders[i].manager;
    if (same && checked[j].right() && checked[j].frameSeconds() < step) return 0;
  }
  if (step > kHopelessStep) return 0;
  return step > kSlowStep ? 1 : kReplays;
}

bool measureReplay(const Request& request) {
  Motion motion = makeMotion(request.scene);
  if (!motion.summed) {
    throw std::invalid_argument("--measure=replay: give --scene=paper-dynamic, without a frame");
  }
  const std::vector<Contender> contenders = readAgainst(request.against).all();
  PreflightLimits limits;
  limits.phase_seconds = std::min(request.limit, kMostSeconds);
  // In the middle of the motion and at its end.
  MovingFibers& last = motion.checked.back();
  const std::vector<Preflight> checked = preflightAll(contenders, last, limits);
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const Contender& contender = contenders[i];
    registerChecked(contender, checked[i], last);
    const int runs = replayCount(contenders, checked, i);
    if (runs == 0) continue;
    const auto run = [&](Numbers& numbers) { return replay(contender, motion.fibers, numbers); };
    registerRuns("Replay/" + contender.name(), runs, run, contender.ours);
  }
  return runRegistered() && oursAreRight(contenders, checked);
}

const AddMeasure kMeasure("replay", measureReplay);

}  // namespace

}  // namespace fcl_fibers::benchmarks
