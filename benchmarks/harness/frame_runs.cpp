// SPDX-License-Identifier: BSD-3-Clause
#include "harness/frame_runs.h"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>

namespace fcl_fibers::benchmarks {
namespace {

// Seconds that the frames of a run are to take, and how many frames at most; from kSlowFrame
// seconds on, a run has one.
constexpr double kSecondsPerRun = 0.15;
constexpr double kMaxFrames = 10;
constexpr double kSlowFrame = 0.1;

// Seconds that all runs of one contender are to take, but a spread needs so many runs.
constexpr double kSecondsPerContender = 1;
constexpr double kLeastRuns = 5, kMostRuns = 9;
constexpr double kLeastRunsOfLarge = 3;
constexpr std::size_t kLargeFromSegments = 1'000'000;

/// Pairs that fcl::collide is called on in a frame, and at most in a run.
constexpr std::size_t kNarrowPairs = 50'000, kNarrowPairsOfRun = 200'000;

std::vector<int> framesOfRun(const Motion& motion, double seconds_per_frame) {
  std::vector<int> frames;
  if (motion.summed) {
    for (int frame = 1; frame < motion.fibers.frameCount(); ++frame) frames.push_back(frame);
    return frames;
  }
  if (!(seconds_per_frame <= kSlowFrame)) return {1};
  const double count = std::clamp(kSecondsPerRun / seconds_per_frame, 2.0, kMaxFrames);
  for (int i = 0; i < static_cast<int>(count) / 2 * 2; ++i) frames.push_back(1 - i % 2);
  return frames;
}

}  // namespace

void registerChecked(const Contender& contender, const Preflight& checked,
                     const MovingFibers& fibers) {
  Numbers numbers;
  const auto set = [&](const char* name, std::size_t value) {
    numbers[name] = static_cast<double>(value);
  };
  set("fibers", fibers.fiberCount());
  set("segments", fibers.segmentCount());
  // A killed contender leaves counts of zero, which are not what it would have counted.
  if (checked.frames[0].checked) {
    set("pairs", checked.frames[0].reported);
    set("touching", checked.frames[0].touching);
  }
  if (checked.bytes > 0) set("bytes", checked.bytes);
  if (checked.bytes_after_frames > 0) set("bytes_after_frames", checked.bytes_after_frames);
  if (checked.bytes_stated > 0) set("bytes_stated", checked.bytes_stated);
  for (std::size_t p = 0; p < kPhases; ++p) {
    numbers[phaseName(static_cast<Phase>(p))] = checked.seconds[p];
  }
  std::string label = checked.note;
  if (!label.empty()) label += std::string(" in ") + phaseName(checked.phase);
  if (!checked.detail.empty()) label += ": " + checked.detail;
  registerNumbers("Checked/" + contender.name(), numbers, label);
}

FrameRuns::FrameRuns(const Contender& contender, const Preflight& checked, Motion& motion,
                     Phase last)
    : contender_(contender),
      checked_(checked),
      motion_(motion),
      last_(last),
      frames_(framesOfRun(motion, checked.frameSeconds())) {
  if (last == Phase::kSetUp) frames_.clear();
}

int FrameRuns::runCount() const {
  const bool large = motion_.fibers.segmentCount() >= kLargeFromSegments;
  // What was not checked to its end has no seconds of a frame, and is slow.
  const double frames = static_cast<double>(frames_.size()) * checked_.frameSeconds();
  const double seconds = checked_.phaseSeconds(Phase::kSetUp) + (checked_.right() ? frames : 0);
  const double runs =
      std::clamp(kSecondsPerContender / seconds, large ? kLeastRunsOfLarge : kLeastRuns, kMostRuns);
  return static_cast<int>(runs) / 2 * 2 + 1;  // odd, for the median to be one of them
}

void FrameRuns::registerFrames(int runs, bool narrow_phase) {
  narrow_phase_ = narrow_phase;
  if (runs == 0) runs = runCount();
  const std::string name = "Frames/" + contender_.name();
  const auto plain = [this](Numbers& numbers) { return frame(numbers, false); };
  registerRuns(name, runs, plain, contender_.ours);
  if (!narrow_phase) return;
  const auto with_narrow_phase = [this](Numbers& numbers) { return frame(numbers, true); };
  registerRuns(name + "_and_collide", runs, with_narrow_phase, false);
}

double FrameRuns::frame(Numbers& numbers, bool with_narrow_phase) {
  std::deque<Numbers>& waiting = with_narrow_phase ? with_narrow_phase_ : plain_;
  if (waiting.empty()) run();
  numbers = std::move(waiting.front());
  waiting.pop_front();
  if (last_ == Phase::kSetUp) return numbers["set_up"];
  return numbers["update"] + (last_ == Phase::kUpdate ? 0 : numbers["detection"]);
}

void FrameRuns::run() {
  MovingFibers& fibers = motion_.fibers;
  fibers.bringTo(0, contender_.boxes);
  std::unique_ptr<Manager> manager;
  const double set_up = seconds([&] { manager = contender_.setUp(fibers); });
  double update_seconds = 0, detection_seconds = 0;
  PairCount count;
  NarrowPhase narrow;
  std::size_t sampled = 0;
  bool is_new = true;
  for (const int frame : frames_) {
    // FCL's trees become slower with every update: after the second on the cap, the array form's
    // detection (level 1) took more than four minutes instead of half a second. So they are set up
    // anew before each update, at no cost to them. All others live through all frames.
    if (contender_.boxes != Boxes::kNone && !is_new) {
      manager = nullptr;  // before the next one takes memory
      manager = contender_.setUp(fibers);
    }
    is_new = false;
    fibers.setPoses(frame);
    update_seconds += seconds([&] { update(contender_, fibers, *manager); });
    if (last_ != Phase::kDetection) continue;
    PairCount found;
    detection_seconds += seconds([&] { found = countPairs(*manager); });
    notePairs(frame, found.pairs);
    count.pairs += found.pairs;
    count.visited += found.visited;
    if (!narrow_phase_) continue;
    const PairSample& sample = sampleOf(frame, *manager);
    const NarrowPhase more = collide(sample);
    narrow = {narrow.seconds + more.seconds, narrow.touching + more.touching};
    sampled += sample.pairs.size();
  }

  // A sum over all frames, or the mean of the two that take turns.
  const auto perFrame = [&, frames = static_cast<double>(frames_.size())](auto sum) {
    return static_cast<double>(sum) / (motion_.summed ? 1 : frames);
  };
  const auto known = [&](Phase phase, auto sum) {
    return phase <= last_ ? perFrame(sum) : Preflight::kUnknown;
  };
  Numbers numbers = {{"set_up", set_up},
                     {"frames", static_cast<double>(frames_.size())},
                     {"update", known(Phase::kUpdate, update_seconds)},
                     {"detection", known(Phase::kDetection, detection_seconds)},
                     {"pairs", known(Phase::kDetection, count.pairs)},
                     {"visited", known(Phase::kDetection, count.visited)}};
  plain_.push_back(numbers);
  if (!narrow_phase_) return;
  numbers["detection"] = perFrame(detection_seconds + narrow.seconds);
  numbers["sampled"] = perFrame(sampled);
  numbers["of"] = numbers["pairs"];
  numbers["touching"] = perFrame(narrow.touching);
  with_narrow_phase_.push_back(numbers);
}

/// A query by itself, which takes longer than fcl::collide on the sample: it is done once.
const PairSample& FrameRuns::sampleOf(int frame, const Manager& manager) {
  const auto [known, is_new] = samples_.try_emplace(frame);
  if (is_new) {
    const std::size_t frames = std::max<std::size_t>(frames_.size(), 1);
    known->second = samplePairs(manager, checked_.frames[0].reported,
                                std::min(kNarrowPairs, kNarrowPairsOfRun / frames));
  }
  return known->second;
}

/// What is timed is what was checked. Embree's trees are not the same each time, and some of them
/// have several boxes to a leaf.
void FrameRuns::notePairs(int frame, std::size_t pairs) {
  if (contender_.manager == "Embree") return;
  const auto [known, is_new] = pairs_.try_emplace(frame, pairs);
  if (is_new && !motion_.summed) {
    known->second = checked_.frames[static_cast<std::size_t>(frame)].reported;
  }
  if (pairs != known->second) {
    throw std::runtime_error("reports other pairs than when it was checked, or in another run");
  }
}

}  // namespace fcl_fibers::benchmarks
