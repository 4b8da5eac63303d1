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
constexpr std::size_t kTrySmallerFromSegments = 200'000;
constexpr int kTryPart = 4;

/// One of FCL's other managers that is so many times slower than the fastest of its trees is run
/// once: its rank is certain.
constexpr double kFarBehind = 8;

/// How often those that may be fastest are tried.
constexpr int kTries = 3;

/// Bullet is run once where a frame takes longer.
constexpr double kLongFrame = 2;

/// A frame that takes longer is timed by the check alone.
constexpr double kCheckedOnlySeconds = 60;

/// Who is timed, how far a run goes, and what else is done with its pairs.
template <typename S>
struct Chosen {
  BasicContender<S> contender;
  Phase last = Phase::kDetection;
  std::vector<PairWork> pair_work = {};
};

template <typename S>
using Tried = std::vector<std::pair<BasicContender<S>, Preflight>>;

/// All that may be fastest, those that ended in time, with the least seconds of a few runs. In one
/// of them the machine may be slow for the one that is fastest.
template <typename S>
Tried<S> tryAll(const std::vector<BasicContender<S>>& contenders, double phase_limit,
                BasicMovingFibers<S>& fibers) {
  PreflightLimits limits;
  limits.phase_seconds = phase_limit;
  limits.check = false;
  std::vector<Preflight> results = preflightAll(contenders, fibers, limits);
  for (int tries = 1; tries < kTries; ++tries) {
    const std::vector<Preflight> more = preflightAll(contenders, fibers, limits);
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      if (!results[i].right() || !more[i].right()) continue;
      for (std::size_t p = 0; p < kPhases; ++p) {
        results[i].seconds[p] = std::min(results[i].seconds[p], more[i].seconds[p]);
      }
    }
  }
  Tried<S> tried;
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    if (results[i].right()) tried.emplace_back(contenders[i], results[i]);
    Numbers numbers = {{"segments", static_cast<double>(fibers.segmentCount())}};
    for (std::size_t p = 0; p < kPhases; ++p) {
      numbers[phaseName(static_cast<Phase>(p))] = results[i].seconds[p];
    }
    registerNumbers("Tried/" + contenders[i].name(), numbers, results[i].note);
  }
  return tried;
}

/// Adds the fastest unless it is there. A tree that is fast only in what comes early is not timed
/// further.
template <typename S, typename SecondsOf>
void addFastest(std::vector<Chosen<S>>& chosen, const Tried<S>& tried, Chosen<S> how,
                SecondsOf&& seconds_of) {
  const auto fastest =
      std::min_element(tried.begin(), tried.end(), [&](const auto& one, const auto& other) {
        return seconds_of(one.second) < seconds_of(other.second);
      });
  if (fastest == tried.end()) return;
  how.contender = fastest->first;
  const bool is_there = std::any_of(chosen.begin(), chosen.end(), [&](const Chosen<S>& other) {
    return other.contender.name() == how.contender.name();
  });
  if (!is_there) chosen.push_back(std::move(how));
}

/// The fastest of each library in a frame and in detection on each kind of boxes, and in update and
/// set-up on any.
template <typename S>
std::vector<Chosen<S>> fastest(const BasicAgainst<S>& against, double phase_limit,
                               BasicMovingFibers<S>& fibers) {
  std::vector<Chosen<S>> chosen;
  const Tried<S> tried = tryAll(against.tried, phase_limit, fibers);
  const auto add = [&](const Tried<S>& among, Phase phase) {
    addFastest(chosen, among, {{}, phase},
               [phase](const Preflight& result) { return result.phaseSeconds(phase); });
  };
  for (const Group group : {Group::kFclTuned, Group::kForeignTuned}) {
    Tried<S> all;
    for (const char* const boxes : {"tight", "stock"}) {
      Tried<S> alike;
      for (const auto& [contender, result] : tried) {
        const bool fits = contender.group == group && contender.variant.rfind(boxes, 0) == 0;
        if (fits) alike.emplace_back(contender, result);
      }
      addFastest(chosen, alike, {{}, Phase::kDetection, against.pair_work},
                 [](const Preflight& result) { return result.frameSeconds(); });
      add(alike, Phase::kDetection);
      all.insert(all.end(), alike.begin(), alike.end());
    }
    add(all, Phase::kUpdate);
    add(all, Phase::kSetUp);
  }
  return chosen;
}

template <typename S>
std::vector<Chosen<S>> choose(const Request& request, const BasicAgainst<S>& against,
                              BasicMotion<S>& motion) {
  std::vector<Chosen<S>> chosen;
  if (!against.tried.empty()) {
    const bool smaller = !motion.tried && motion.fibers.segmentCount() >= kTrySmallerFromSegments;
    std::optional<BasicMotion<S>> part;
    if (smaller) part = makeMotion<S>(request.scene, kTryPart);
    BasicMovingFibers<S>& fibers = smaller        ? part->fibers
                                   : motion.tried ? *motion.tried
                                                  : motion.fibers;
    chosen = fastest(against, request.limit, fibers);
  }
  for (const BasicContender<S>& contender : against.contenders) {
    chosen.push_back({contender});
    // Their own narrow phase is FCL's, and several threads would wait for each other's callbacks.
    const bool tests = contender.group == Group::kForeign && !against.pair_work.empty() &&
                       contender.variant.find("_threads") == std::string::npos;
    if (tests) chosen.back().pair_work = {PairWork::kTest};
  }
  return chosen;
}

/// Times and counts are those of the last frames, where there are most pairs.
template <typename S>
std::vector<Preflight> checkMotion(const std::vector<Chosen<S>>& chosen, bool quick,
                                   double phase_limit, BasicMotion<S>& motion) {
  std::vector<BasicContender<S>> contenders;
  for (const Chosen<S>& one : chosen) contenders.push_back(one.contender);
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
template <typename S>
S readObjects(const BasicMovingFibers<S>& fibers) {
  S sum = 0;
  for (const auto* const object : fibers.objects()) {
    const fcl::Transform3<S>& pose = object->getTransform();
    const auto& capsule = static_cast<const fcl::Capsule<S>&>(*object->collisionGeometry());
    const fcl::AABB<S>& box = object->getAABB();
    sum += pose.translation().sum() + pose.linear().col(2).sum() + capsule.lz + capsule.radius +
           box.min_.sum() + box.max_.sum();
  }
  return sum;
}

template <typename S>
void registerFloor(BasicMotion<S>& motion) {
  constexpr int kRuns = 9, kMostFrames = 4;
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

template <typename S>
bool measure(const Request& request) {
  BasicMotion<S> motion = makeMotion<S>(request.scene);
  const auto against = readAgainst<S>(request.against);
  const std::vector<Chosen<S>> chosen = choose(request, against, motion);
  const std::vector<Preflight> checked = checkMotion(chosen, against.quick, request.limit, motion);

  double fastest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < checked.size(); ++i) {
    if (chosen[i].contender.group == Group::kFclTuned && checked[i].right()) {
      fastest = std::min(fastest, checked[i].frameSeconds());
    }
  }

  std::deque<BasicFrameRuns<S>> runs;
  std::vector<BasicContender<S>> contenders;
  for (std::size_t i = 0; i < checked.size(); ++i) {
    const BasicContender<S>& contender = chosen[i].contender;
    contenders.push_back(contender);
    registerChecked(contender, checked[i], motion.fibers);
    const double frame = checked[i].frameSeconds();
    // Ours whose detection takes too long still have a set-up and an update worth knowing.
    if (contender.ours && checked[i].verdict == Preflight::Verdict::kTooSlow &&
        checked[i].phase == Phase::kDetection) {
      runs.emplace_back(contender, checked[i], motion, Phase::kUpdate).registerFrames();
    }
    if (!checked[i].right() || frame > kCheckedOnlySeconds) continue;
    BasicFrameRuns<S>& frame_runs =
        runs.emplace_back(contender, checked[i], motion, chosen[i].last);
    const bool far_behind =
        (contender.group == Group::kFclOthers && frame > kFarBehind * fastest) ||
        (contender.manager == "Bullet" && frame > kLongFrame);
    frame_runs.registerFrames(far_behind ? 1 : 0, chosen[i].pair_work);
  }
  registerFloor(motion);
  return runRegistered() && oursAreRight(contenders, checked);
}

bool measureFrames(const Request& request) {
  return request.scalar == "float" ? measure<float>(request) : measure<double>(request);
}

const AddMeasure kMeasure("frames", measureFrames);

}  // namespace

}  // namespace fcl_fibers::benchmarks
