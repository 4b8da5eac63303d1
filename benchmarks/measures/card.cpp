// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <deque>
#include <string>
#include <vector>

#include "harness/frame_runs.h"
#include "measures.h"

namespace fcl_fibers::benchmarks {
namespace {

/// Of one run: set-up, update and detection. Whoever takes longer is run once.
constexpr double kLongRun = 2;

/// Whoever would take longer for all steps of a motion is timed by the check alone.
constexpr double kLongestMotion = 20;

/// The paper's numbers of fibers, or the scene in parts, or the scene alone if it has a motion.
struct Size {
  SceneRequest scene;
  int part = 1;
};

std::vector<Size> sizesOf(const SceneRequest& scene) {
  if (scene.text == "paper-dynamic") return {{scene}};
  std::vector<Size> sizes;
  if (scene.text == "paper-static") {
    // Smaller ones, for some are out at the paper's least number.
    for (const char* const fibers :
         {"5", "10", "20", "50", "100", "200", "350", "500", "700", "1000"}) {
      sizes.push_back({scene});
      sizes.back().scene.text += std::string(":fibers=") + fibers;
    }
  } else {
    for (const int part : {64, 16, 4, 1}) sizes.push_back({scene, part});
  }
  return sizes;
}

/// Climbs the sizes. Who does not end in time, or is wrong, is left behind.
template <typename S>
bool measure(const Request& request) {
  using Contenders = std::vector<BasicContender<S>>;
  Contenders contenders = allOf<S>({Group::kFclTrees, Group::kFclOthers, Group::kPublished});
  PreflightLimits limits;
  limits.phase_seconds = request.limit;
  limits.at_once = 1;
  bool right = true;
  const std::vector<Size> sizes = sizesOf(request.scene);
  for (std::size_t s = 0; s < sizes.size(); ++s) {
    BasicMotion<S> motion = makeMotion<S>(sizes[s].scene, sizes[s].part);
    // Pairs are most at the end of a motion.
    BasicMovingFibers<S>& fibers = motion.checked.empty() ? motion.fibers : motion.checked.back();
    const std::vector<Preflight> checked = preflightAll(contenders, fibers, limits);
    right = right && oursAreRight(contenders, checked);
    Contenders left;
    std::vector<Preflight> left_checked;
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      registerChecked(contenders[i], checked[i], fibers,
                      "Card/" + contenders[i].name() + "/" + std::to_string(fibers.segmentCount()));
      if (!checked[i].right()) continue;
      left.push_back(contenders[i]);
      left_checked.push_back(checked[i]);
    }
    contenders = std::move(left);
    if (s + 1 < sizes.size()) continue;

    std::deque<BasicFrameRuns<S>> runs;
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      const double run =
          left_checked[i].phaseSeconds(Phase::kSetUp) + left_checked[i].frameSeconds();
      const auto steps = static_cast<double>(motion.fibers.frameCount() - 1);
      if (motion.summed && run * steps > kLongestMotion) continue;
      runs.emplace_back(contenders[i], left_checked[i], motion)
          .registerFrames(run > kLongRun || motion.summed ? 1 : 0);
    }
    right = runRegistered() && right;
  }
  return right;
}

bool measureCard(const Request& request) {
  return request.scalar == "float" ? measure<float>(request) : measure<double>(request);
}

const AddMeasure kMeasure("card", measureCard);

}  // namespace

}  // namespace fcl_fibers::benchmarks
