// SPDX-License-Identifier: BSD-3-Clause
#include "harness/frame_runs.h"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>

namespace fcl_fibers::benchmarks {
namespace {

/// Segments that the frames of a run have together, and how many frames at most. All contenders of
/// a scene have as many, because the first frame after a set-up takes longest.
constexpr std::size_t kSegmentsOfRun = 300'000, kMaxFrames = 10;

// Seconds that all runs of one contender are to take, but an interval needs so many runs: of five,
// one that another program has disturbed widens it as far as itself.
constexpr double kSecondsPerContender = 10;
constexpr double kLeastRuns = 9, kMostRuns = 25;
constexpr double kLeastRunsOfLarge = 7;
constexpr std::size_t kLargeFromSegments = 1'000'000;

/// fcl::collide is called on kNarrowPairs pairs of a frame, and on kNarrowPairsOfRun of a run at
/// most. kSamples runs in a row take different pairs, for the spread of runs to contain the spread
/// of samples.
constexpr std::size_t kNarrowPairs = 50'000, kNarrowPairsOfRun = 200'000, kSamples = 4;

template <typename S>
std::vector<int> framesOfRun(const BasicMotion<S>& motion, bool is_renewed) {
  std::vector<int> frames;
  if (motion.summed) {
    for (int frame = 1; frame < motion.fibers.frameCount(); ++frame) frames.push_back(frame);
    return frames;
  }
  const std::size_t count = std::min(kSegmentsOfRun / motion.fibers.segmentCount(), kMaxFrames);
  if (count < 2) return {1};
  for (std::size_t i = 0; i < count / 2 * 2; ++i) {
    frames.push_back(is_renewed || i % 2 == 0 ? 1 : 0);
  }
  return frames;
}

}  // namespace

template <typename S>
void registerChecked(const BasicContender<S>& contender, const Preflight& checked,
                     const BasicMovingFibers<S>& fibers, const std::string& name) {
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
  registerNumbers(name.empty() ? "Checked/" + contender.name() : name, numbers,
                  checked.whyNotTimed());
}

template <typename S>
BasicFrameRuns<S>::BasicFrameRuns(const BasicContender<S>& contender, const Preflight& checked,
                                  BasicMotion<S>& motion, Phase last)
    : contender_(contender),
      checked_(checked),
      motion_(motion),
      last_(last),
      frames_(framesOfRun(motion, contender.is_renewed)) {
  if (last == Phase::kSetUp) frames_.clear();
}

template <typename S>
int BasicFrameRuns<S>::runCount() const {
  const bool large = motion_.fibers.segmentCount() >= kLargeFromSegments;
  // What was not checked to its end has no seconds of a frame, and is slow.
  const double frames = static_cast<double>(frames_.size()) * checked_.frameSeconds();
  const double seconds = checked_.phaseSeconds(Phase::kSetUp) + (checked_.right() ? frames : 0);
  const double runs =
      std::clamp(kSecondsPerContender / seconds, large ? kLeastRunsOfLarge : kLeastRuns, kMostRuns);
  return runsOf(contender_.ours, static_cast<int>(runs) / 2 * 2 + 1);  // odd: one is the median
}

template <typename S>
void BasicFrameRuns<S>::registerFrames(int runs, const std::vector<PairWork>& more) {
  if (runs == 0) runs = runCount();
  const auto secondsOfFrame = [this](const Numbers& numbers) {
    if (last_ == Phase::kSetUp) return numbers.at("set_up");
    return numbers.at("update") + (last_ == Phase::kUpdate ? 0 : numbers.at("detection"));
  };
  const std::string name = "Frames/" + contender_.name();
  registerEntry(name, runs, PairWork::kCount, secondsOfFrame);
  for (const PairWork work : more) {
    const char* const suffix = work == PairWork::kTest ? "_and_test" : "_and_collide";
    registerEntry(name + suffix, runs, work, secondsOfFrame);
  }
}

template <typename S>
void BasicFrameRuns<S>::registerPhases(const std::string& name) {
  const auto add = [&](const char* entry, PairWork work, const char* phase) {
    registerEntry(name + "/" + entry, runCount(), work,
                  [phase](const Numbers& numbers) { return numbers.at(phase); });
  };
  add("construction", PairWork::kCount, "set_up");
  add("update", PairWork::kCount, "update");
  add("detection", PairWork::kCount, "detection");
  const bool tests = contender_.reported != Reported::kTouching;
  add("touching", tests ? PairWork::kTest : PairWork::kCount, "detection");
}

template <typename S>
void BasicFrameRuns<S>::registerEntry(const std::string& name, int runs, PairWork work,
                                      std::function<double(const Numbers&)> seconds) {
  Entry& entry = entries_.emplace_back(Entry{work, std::move(seconds)});
  const auto next = [this, &entry](Numbers& numbers) {
    if (entry.waiting.empty()) run();
    numbers = std::move(entry.waiting.front());
    entry.waiting.pop_front();
    return entry.seconds(numbers);
  };
  registerRuns(name, runs, next, contender_.ours && work == PairWork::kCount);
}

template <typename S>
bool BasicFrameRuns<S>::does(PairWork work) const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [work](const Entry& entry) { return entry.work == work; });
}

template <typename S>
void BasicFrameRuns<S>::run() {
  BasicMovingFibers<S>& fibers = motion_.fibers;
  contender_.setPoses(fibers, 0);
  // A program writes its boxes before it hands its objects to a manager.
  const double boxes_seconds = seconds([&] { fibers.computeBoxes(contender_.boxes); });
  contender_.bringTo(fibers, 0);
  std::unique_ptr<BasicManager<S>> manager;
  const double set_up = seconds([&] { manager = contender_.setUp(fibers); });
  double update_seconds = 0, detection_seconds = 0, test_seconds = 0;
  PairCount count;
  std::size_t touching = 0, sampled = 0;
  NarrowPhase narrow;
  bool is_new = true;
  for (const int frame : frames_) {
    // FCL's trees become slower with every update: after the second on the cap, the array form's
    // detection (level 1) took more than four minutes instead of half a second. So the managers of
    // FCL and coal are set up anew before each update, at no cost to them, and go the way in which
    // they were tried. All others live through all frames.
    if (contender_.is_renewed && !is_new) {
      manager = nullptr;  // before the next one takes memory
      if (!motion_.summed) contender_.bringTo(fibers, 0);
      manager = contender_.setUp(fibers);
    }
    is_new = false;
    contender_.setPoses(fibers, frame);
    update_seconds += seconds([&] { update(contender_, fibers, *manager); });
    if (last_ != Phase::kDetection) continue;
    const auto test = [&] {
      if (!does(PairWork::kTest)) return;
      std::size_t found_touching = 0;
      test_seconds += seconds([&] { found_touching = countTouching(*manager, fibers.objects()); });
      checkTouching(frame, found_touching);
      touching += found_touching;
    };
    // The second of two queries finds the tree in the cache.
    is_test_first_ = !is_test_first_;
    if (is_test_first_) test();
    PairCount found;
    detection_seconds += seconds([&] { found = countPairs(*manager); });
    notePairs(frame, found.pairs);
    count.pairs += found.pairs;
    count.visited += found.visited;
    if (!is_test_first_) test();
    if (!does(PairWork::kCollide)) continue;
    const PairSample<S> sample = partOf(sampleOf(frame, *manager), runs_done_, kSamples);
    const NarrowPhase more = collide(*manager, sample);
    narrow = {narrow.seconds + more.seconds, narrow.touching + more.touching};
    sampled += sample.pairs.size();
  }

  ++runs_done_;
  // A sum over all frames, or the mean of the two that take turns.
  const auto perFrame = [&, frames = static_cast<double>(frames_.size())](auto sum) {
    return static_cast<double>(sum) / (motion_.summed ? 1 : frames);
  };
  const auto known = [&](Phase phase, auto sum) {
    return phase <= last_ ? perFrame(sum) : Preflight::kUnknown;
  };
  const Numbers numbers = {{kEnd, tools::secondsNow()},
                           {"boxes", boxes_seconds},
                           {"set_up", set_up},
                           {"frames", static_cast<double>(frames_.size())},
                           {"update", known(Phase::kUpdate, update_seconds)},
                           {"detection", known(Phase::kDetection, detection_seconds)},
                           {"pairs", known(Phase::kDetection, count.pairs)},
                           {"visited", known(Phase::kDetection, count.visited)}};
  for (Entry& entry : entries_) {
    Numbers& result = entry.waiting.emplace_back(numbers);
    if (entry.work == PairWork::kTest) {
      result["detection"] = perFrame(test_seconds);
      result["touching"] = perFrame(touching);
    } else if (entry.work == PairWork::kCollide) {
      result["detection"] = perFrame(detection_seconds + narrow.seconds);
      result["sampled"] = perFrame(sampled);
      result["of"] = result["pairs"];
      result["touching"] = perFrame(narrow.touching);
    }
  }
}

/// A query by itself, which takes longer than a narrow phase on the sample: it is done once.
template <typename S>
const PairSample<S>& BasicFrameRuns<S>::sampleOf(int frame, const BasicManager<S>& manager) {
  const auto [known, is_new] = samples_.try_emplace(frame);
  if (is_new) {
    const std::size_t frames = std::max<std::size_t>(frames_.size(), 1);
    known->second = samplePairs(manager, checked_.frames[0].reported,
                                kSamples * std::min(kNarrowPairs, kNarrowPairsOfRun / frames));
  }
  return known->second;
}

/// What is timed is what was checked, where it is fixed what a manager reports. Others may report
/// other pairs after another update.
template <typename S>
void BasicFrameRuns<S>::notePairs(int frame, std::size_t pairs) {
  if (contender_.reported == Reported::kTouchingAtLeast) return;
  const auto [known, is_new] = pairs_.try_emplace(frame, pairs);
  if (is_new && !motion_.summed) {
    known->second = checked_.frames[static_cast<std::size_t>(frame)].reported;
  }
  if (pairs != known->second) {
    throw std::runtime_error("reports other pairs than when it was checked, or in another run");
  }
}

/// The callback's test finds what the judge has found.
template <typename S>
void BasicFrameRuns<S>::checkTouching(int frame, std::size_t touching) const {
  if (motion_.summed) return;
  const PairCounts& due = checked_.frames[static_cast<std::size_t>(frame)];
  if (touching < due.touching || touching > due.touching + due.undecided) {
    throw std::runtime_error("the closed form finds other touching pairs than the judge");
  }
}

template void registerChecked(const BasicContender<float>&, const Preflight&,
                              const BasicMovingFibers<float>&, const std::string&);
template void registerChecked(const BasicContender<double>&, const Preflight&,
                              const BasicMovingFibers<double>&, const std::string&);
template class BasicFrameRuns<float>;
template class BasicFrameRuns<double>;

}  // namespace fcl_fibers::benchmarks
