// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include <algorithm>
#include <deque>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/capsule.h>

#include "harness/frame_runs.h"
#include "measures.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

/// From so many segments on, FCL's trees are tried on a scene of a quarter of the fibers.
constexpr std::size_t kTrySmallerFromSegments = 100'000;
constexpr int kTryPart = 4;

/// One of FCL's other managers that is so many times slower than the fastest of its trees is run
/// once: its rank is certain.
constexpr double kFarBehind = 8;

/// Bullet is in no ratio. It is run once where a frame takes longer.
constexpr double kLongFrame = 2;

/// A frame that takes longer is timed by the check alone.
constexpr double kCheckedOnlySeconds = 60;

/// Who is timed, how far a run goes, and whether with tests of its pairs as well.
struct Chosen {
  Contender contender;
  Phase last = Phase::kDetection;
  bool narrow_phase = false;
  bool fcl_tree = false;  ///< chosen among those that were tried
};

using Tried = std::vector<std::pair<Contender, Preflight>>;

/// FCL's trees, each run once, those that ended in time.
Tried tryFclTrees(Boxes boxes, double phase_limit, MovingFibers& fibers) {
  PreflightLimits limits;
  limits.phase_seconds = phase_limit;
  limits.check = false;
  const std::vector<Contender> trees = fclTrees(boxes);
  const std::vector<Preflight> results = preflightAll(trees, fibers, limits);
  Tried tried;
  for (std::size_t i = 0; i < trees.size(); ++i) {
    if (results[i].right()) tried.emplace_back(trees[i], results[i]);
    Numbers numbers = {{"segments", static_cast<double>(fibers.segmentCount())}};
    for (std::size_t p = 0; p < kPhases; ++p) {
      numbers[phaseName(static_cast<Phase>(p))] = results[i].seconds[p];
    }
    registerNumbers("Tried/" + trees[i].name(), numbers, results[i].note);
  }
  return tried;
}

/// Adds the fastest unless it is there. A tree that is fast only in what comes early is not timed
/// further.
template <typename SecondsOf>
void addFastest(std::vector<Chosen>& chosen, const Tried& tried, Chosen how,
                SecondsOf&& seconds_of) {
  const auto fastest =
      std::min_element(tried.begin(), tried.end(), [&](const auto& one, const auto& other) {
        return seconds_of(one.second) < seconds_of(other.second);
      });
  if (fastest == tried.end()) return;
  how.contender = fastest->first;
  const bool is_there = std::any_of(chosen.begin(), chosen.end(), [&](const Chosen& other) {
    return other.contender.name() == how.contender.name();
  });
  if (!is_there) chosen.push_back(std::move(how));
}

/// The fastest in a frame and in detection on each kind of boxes, and in update and set-up on any.
std::vector<Chosen> fastestFclTrees(const Against& against, double phase_limit,
                                    MovingFibers& fibers) {
  std::vector<Chosen> chosen;
  const auto add = [&](const Tried& tried, Phase phase) {
    addFastest(chosen, tried, {{}, phase, false, true},
               [phase](const Preflight& result) { return result.phaseSeconds(phase); });
  };
  Tried all;
  for (const Boxes boxes : against.fcl_trees) {
    const Tried tried = tryFclTrees(boxes, phase_limit, fibers);
    addFastest(chosen, tried, {{}, Phase::kDetection, against.narrow_phase, true},
               [](const Preflight& result) { return result.frameSeconds(); });
    add(tried, Phase::kDetection);
    all.insert(all.end(), tried.begin(), tried.end());
  }
  add(all, Phase::kUpdate);
  add(all, Phase::kSetUp);
  return chosen;
}

std::vector<Chosen> choose(const Request& request, const Against& against, Motion& motion) {
  std::vector<Chosen> chosen;
  if (!against.fcl_trees.empty()) {
    const bool smaller =
        motion.checked.empty() && motion.fibers.segmentCount() >= kTrySmallerFromSegments;
    std::optional<Motion> part;
    if (smaller) part = makeMotion(request.scene, kTryPart);
    MovingFibers& fibers = smaller                  ? part->fibers
                           : motion.checked.empty() ? motion.fibers
                                                    : motion.checked.back();
    chosen = fastestFclTrees(against, request.limit, fibers);
  }
  for (const Contender& contender : against.contenders) chosen.push_back({contender});
  return chosen;
}

/// Times and counts are those of the last frames, where there are most pairs.
std::vector<Preflight> checkMotion(const std::vector<Chosen>& chosen, bool quick,
                                   double phase_limit, Motion& motion) {
  std::vector<Contender> contenders;
  for (const Chosen& one : chosen) contenders.push_back(one.contender);
  PreflightLimits limits;
  limits.phase_seconds = phase_limit;
  limits.at_once = quick ? 2 : 1;
  if (motion.checked.empty()) return preflightAll(contenders, motion.fibers, limits);
  std::vector<Preflight> results = preflightAll(contenders, motion.checked.front(), limits);
  for (std::size_t m = 1; m < motion.checked.size(); ++m) {
    const std::vector<Preflight> later = preflightAll(contenders, motion.checked[m], limits);
    for (std::size_t i = 0; i < results.size(); ++i) {
      if (results[i].right()) results[i] = later[i];
    }
  }
  return results;
}

/// What every update has to do at least: read each object's transform and capsule, and the box, to
/// which a program may have added a margin.
double readObjects(const MovingFibers& fibers) {
  double sum = 0;
  for (const Object* const object : fibers.objects()) {
    const fcl::Transform3d& pose = object->getTransform();
    const auto& capsule = static_cast<const fcl::Capsuled&>(*object->collisionGeometry());
    const fcl::AABBd& box = object->getAABB();
    sum += pose.translation().sum() + pose.linear().col(2).sum() + capsule.lz + capsule.radius +
           box.min_.sum() + box.max_.sum();
  }
  return sum;
}

void registerFloor(Motion& motion) {
  constexpr int kRuns = 5, kMostFrames = 4;
  registerRuns("Floor/read", kRuns, [&motion](Numbers&) {
    const int frames = motion.summed ? motion.fibers.frameCount() - 1 : kMostFrames;
    double taken = 0;
    for (int i = 1; i <= frames; ++i) {
      motion.fibers.setPoses(motion.summed ? i : i % 2);
      taken += seconds([&] { benchmark::DoNotOptimize(readObjects(motion.fibers)); });
    }
    return motion.summed ? taken : taken / frames;
  });
}

bool measureFrames(const Request& request) {
  Motion motion = makeMotion(request.scene);
  const Against against = readAgainst(request.against);
  const std::vector<Chosen> chosen = choose(request, against, motion);
  const std::vector<Preflight> checked = checkMotion(chosen, against.quick, request.limit, motion);

  double fastest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < checked.size(); ++i) {
    if (chosen[i].fcl_tree && checked[i].right()) {
      fastest = std::min(fastest, checked[i].frameSeconds());
    }
  }

  std::deque<FrameRuns> runs;
  std::vector<Contender> contenders;
  for (std::size_t i = 0; i < checked.size(); ++i) {
    const Contender& contender = chosen[i].contender;
    contenders.push_back(contender);
    registerChecked(contender, checked[i], motion.fibers);
    const double frame = checked[i].frameSeconds();
    // Ours whose detection takes too long still have a set-up and an update worth knowing.
    if (contender.ours && checked[i].verdict == Preflight::Verdict::kTooSlow &&
        checked[i].phase == Phase::kDetection) {
      runs.emplace_back(contender, checked[i], motion, Phase::kUpdate).registerFrames();
    }
    if (!checked[i].right() || frame > kCheckedOnlySeconds) continue;
    FrameRuns& frame_runs = runs.emplace_back(contender, checked[i], motion, chosen[i].last);
    const bool other_of_fcl = contender.boxes != Boxes::kNone && !chosen[i].fcl_tree;
    const bool far_behind = (other_of_fcl && frame > kFarBehind * fastest) ||
                            (contender.manager == "Bullet" && frame > kLongFrame);
    std::vector<PairWork> more;
    if (chosen[i].narrow_phase) more = {PairWork::kTest, PairWork::kCollide};
    frame_runs.registerFrames(far_behind ? 1 : 0, more);
  }
  registerFloor(motion);
  return runRegistered() && oursAreRight(contenders, checked);
}

const AddMeasure kMeasure("frames", measureFrames);

}  // namespace

}  // namespace fcl_fibers::benchmarks
