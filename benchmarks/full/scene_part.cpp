// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <map>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include <fcl/geometry/shape/capsule.h>
#include <fcl_fibers/scenes/paper_scenes.h>

#include "foreign_tree.h"
#include "narrow_phase.h"
#include "parts.h"
#include "progress.h"

namespace fcl_fibers::benchmarks {
namespace {

/// Nothing here is to take this long: what does is hopeless.
constexpr double kPhaseLimit = 120;

// FCL's trees become slower with every update, the array form's detection tenfold after ten on the
// dynamic assembly. So theirs, Embree's and Bullet's are set up anew after two, at no cost to them.
// Ours live through all.
constexpr int kUpdatesPerManager = 2;

constexpr double kMaxFrames = 10;

// Seconds that the frames of a run are to take, where they are so fast, and all runs of one.
constexpr double kSecondsPerRun = 0.3;
constexpr double kSecondsPerContender = 8;

/// Pairs that fcl::collide is tried on, in a frame and in a run: about one second and four.
constexpr double kNarrowPairsPerFrame = 5e6;
constexpr double kNarrowPairsPerRun = 2e7;

/// Where frames are fast, FCL's second best is timed as well if it was no slower than this when
/// tried: a single time is not certain.
constexpr double kNearBest = 1.15;
constexpr double kFastFrame = 1;

/// From so many segments on, FCL's trees are tried on a scene of a quarter of the fibers.
constexpr std::size_t kTrySmallerFromSegments = 500000;
constexpr int kTryPart = 4;

/// Seconds from which on a frame is not repeated within a run.
constexpr double kSlowFrame = 3;

/// A further row is timed once where a frame takes longer.
constexpr double kOnceFrame = 1;

/// A scene and how its motion is gone through.
struct Motion {
  MovingFibers fibers;
  bool summed = false;  ///< over all frames in their order; else two frames take turns

  /// Where contenders are checked, two frames each; those of `fibers` if there are none.
  std::vector<MovingFibers> checked;
};

int orUsual(int asked, int usual) { return asked > 0 ? asked : usual; }

Motion makeDynamicMotion(const PartRequest& request) {
  scenes::PaperDynamicParameters parameters;
  parameters.fibers = orUsual(request.fibers, parameters.fibers);
  parameters.segments = orUsual(request.segments, parameters.segments);
  parameters.seed = request.seed;
  const scenes::PaperDynamic assembly(parameters);
  std::vector<int> states(static_cast<std::size_t>(assembly.steps()));
  std::iota(states.begin(), states.end(), 0);
  Motion motion = {makeMovingAssembly(assembly, states), /*summed=*/true, {}};
  const int last = assembly.steps() - 1;
  motion.checked.push_back(makeMovingAssembly(assembly, {0, last / 4}));
  motion.checked.push_back(makeMovingAssembly(assembly, {last / 2, last}));
  return motion;
}

/// The scene with one out of `part` fibers: roots are as dense as with all of them, or a file's
/// first ones.
Motion makeMotion(const PartRequest& request, int part = 1) {
  if (!request.hair.path.empty()) {
    showProgress(request.hair.path + ": read the fibers");
    Motion motion = {readMovingHair(request.hair), false, {}};
    const std::size_t fiber_count = motion.fibers.fiberCount();
    motion.fibers.keepFirst(std::max<std::size_t>(1, fiber_count / static_cast<std::size_t>(part)));
    return motion;
  }
  showProgress(request.scene + ": make the scene");
  const auto fibers = [&](int usual) { return std::max(1, orUsual(request.fibers, usual) / part); };
  const auto segments = [&](int usual) { return orUsual(request.segments, usual); };
  if (request.scene == "static") {
    return {makeMovingStrand(fibers(1000), segments(100), request.seed), false, {}};
  }
  if (request.scene == "strand") {
    return {makeMovingStrand(fibers(1000), segments(2000), request.seed), false, {}};
  }
  if (request.scene == "half_scalp") {
    return {makeMovingScalp(fibers(50000), segments(50), request.seed), false, {}};
  }
  if (request.scene == "dynamic") return makeDynamicMotion(request);
  throw std::invalid_argument("--scene=" + request.scene +
                              ": there are static, strand, half_scalp and dynamic");
}

std::string shortName(const Contender& contender) {
  return contender.manager + "/" + contender.variant;
}

double phaseSeconds(const Preflight& preflight, Phase phase) {
  return preflight.seconds[static_cast<std::size_t>(phase)];
}

double frameSeconds(const Preflight& preflight) {
  return phaseSeconds(preflight, Phase::kUpdate) + phaseSeconds(preflight, Phase::kSelfCollision);
}

/// Numbers without a time.
void registerNumbers(const std::string& name, const std::map<std::string, double>& numbers,
                     const std::string& label) {
  benchmark::RegisterBenchmark(name.c_str(),
                               [numbers, label](benchmark::State& state) {
                                 for ([[maybe_unused]] auto _ : state) state.SetIterationTime(0);
                                 for (const auto& [counter, value] : numbers) {
                                   state.counters[counter] = value;
                                 }
                                 state.SetLabel(label);
                               })
      ->UseManualTime()
      ->Iterations(1)
      ->Repetitions(1);
}

void registerTried(const Contender& contender, const Preflight& tried, const MovingFibers& fibers) {
  registerNumbers("Tried/" + shortName(contender),
                  {{"segments", static_cast<double>(fibers.segmentCount())},
                   {"set_up", phaseSeconds(tried, Phase::kSetUp)},
                   {"update", phaseSeconds(tried, Phase::kUpdate)},
                   {"detection", phaseSeconds(tried, Phase::kSelfCollision)}},
                  tried.note);
}

void registerChecked(const Contender& contender, const Preflight& checked,
                     const MovingFibers& fibers) {
  const auto number = [](std::size_t count) { return static_cast<double>(count); };
  registerNumbers("Checked/" + shortName(contender),
                  {{"fibers", number(fibers.fiberCount())},
                   {"segments", number(fibers.segmentCount())},
                   {"pairs", number(checked.frames[0].reported)},
                   {"touching", number(checked.frames[0].touching)},
                   {"bytes", number(checked.bytes)},
                   {"bytes_after_frames", number(checked.bytes_after_frames)},
                   {"bytes_stated", number(checked.bytes_stated)}},
                  checked.note);
}

struct TriedTree {
  Contender contender;
  double seconds;  ///< update + self-collision
};

/// FCL's trees that read such boxes, each level of each of them tried, fastest first. In rounds,
/// and the faster one counts: a level that is chosen by noise would be too easy a match.
std::vector<TriedTree> tryFclTrees(Boxes boxes, MovingFibers& fibers) {
  constexpr int kRounds = 2;
  PreflightLimits limits;
  limits.phase_seconds = kPhaseLimit;
  limits.check = false;
  const std::vector<Contender> contenders = fclTreeContenders(boxes);
  std::vector<Preflight> fastest(contenders.size());
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      showProgress(fibers.name() + ": try " + contenders[i].title());
      const Preflight result = preflight(contenders[i], fibers, limits);
      if (round == 0 || (result.right() && frameSeconds(result) < frameSeconds(fastest[i]))) {
        fastest[i] = result;
      }
    }
  }
  std::vector<TriedTree> tried;
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    registerTried(contenders[i], fastest[i], fibers);
    if (fastest[i].right()) tried.push_back({contenders[i], frameSeconds(fastest[i])});
  }
  if (tried.empty()) throw std::runtime_error("none of FCL's trees ended in time");
  std::stable_sort(tried.begin(), tried.end(),
                   [](const TriedTree& a, const TriedTree& b) { return a.seconds < b.seconds; });
  return tried;
}

/// How many of the fastest are timed.
std::size_t countToTime(const std::vector<TriedTree>& tried) {
  const bool has_second = tried.size() > 1 && tried[0].seconds < kFastFrame &&
                          tried[1].seconds <= kNearBest * tried[0].seconds;
  return has_second ? 2 : 1;
}

/// Who is timed, and who with FCL's narrow phase as well.
struct Chosen {
  std::vector<Contender> contenders;
  std::vector<bool> narrow_phase;  ///< by contender

  /// But those that are there already.
  void add(const Contender& contender, bool with_narrow_phase = false) {
    const auto isSame = [&](const Contender& other) {
      return shortName(other) == shortName(contender);
    };
    if (std::any_of(contenders.begin(), contenders.end(), isSame)) return;
    contenders.push_back(contender);
    narrow_phase.push_back(with_narrow_phase);
  }
};

/// FCL's, tried on `fibers`, and ours, Embree's and Bullet's. FCL's tight boxes come first: the
/// others are held to them.
Chosen chooseContenders(MovingFibers& fibers) {
  const auto isDynamicTree = [](const TriedTree& tree) {
    return tree.contender.manager == "DynamicAABBTree";
  };
  Chosen chosen;
  const std::vector<TriedTree> tight = tryFclTrees(Boxes::kTight, fibers);
  for (std::size_t i = 0; i < countToTime(tight); ++i) chosen.add(tight[i].contender);
  // Set-up and bytes are compared with the dynamic tree, whatever is best in a frame, and with what
  // it does unless told otherwise.
  const auto tree = std::find_if(tight.begin(), tight.end(), isDynamicTree);
  if (tree != tight.end()) chosen.add(tree->contender);
  chosen.add(fclTreeContenders(Boxes::kTight).front());
  const std::vector<TriedTree> stock = tryFclTrees(Boxes::kStock, fibers);
  for (std::size_t i = 0; i < countToTime(stock); ++i) {
    chosen.add(stock[i].contender, /*with_narrow_phase=*/i == 0);
  }
  for (const int threads : {1, 2}) {
    const std::string suffix = threads == 1 ? "" : "_2_threads";
    chosen.add(boxTreeContender("boxes" + suffix, Report::kVolumes, threads));
    chosen.add(boxTreeContender("capsules" + suffix, Report::kCapsules, threads));
  }
  for (const Contender& contender : foreignContenders()) chosen.add(contender);
  return chosen;
}

Chosen chooseContenders(const PartRequest& request, Motion& motion) {
  if (!motion.checked.empty()) return chooseContenders(motion.checked.back());
  if (motion.fibers.segmentCount() < kTrySmallerFromSegments) {
    return chooseContenders(motion.fibers);
  }
  Motion smaller = makeMotion(request, kTryPart);
  return chooseContenders(smaller.fibers);
}

/// The frames that a run goes through, after frame 0.
std::vector<int> framesOfRun(const Motion& motion, double seconds_per_frame) {
  std::vector<int> frames;
  if (motion.summed) {
    for (int frame = 1; frame < motion.fibers.frameCount(); ++frame) frames.push_back(frame);
    return frames;
  }
  if (seconds_per_frame > kSlowFrame) return {1};
  const double count = std::clamp(kSecondsPerRun / seconds_per_frame, 2.0, kMaxFrames);
  for (int i = 0; i < static_cast<int>(count) / 2 * 2; ++i) frames.push_back(1 - i % 2);
  return frames;
}

/// One contender, whose runs are set-up and then frame by frame motion, update and detection.
class FrameRuns {
 public:
  FrameRuns(const Contender& contender, const Preflight& checked, Motion& motion)
      : contender_(contender),
        checked_(checked),
        motion_(motion),
        frames_(framesOfRun(motion, frameSeconds(checked))) {}

  /// A further row is none that ours are compared with.
  void registerFrames(bool is_further_row) {
    const double seconds =
        phaseSeconds(checked_, Phase::kSetUp) + frameCount() * frameSeconds(checked_);
    const int runs = static_cast<int>(std::clamp(kSecondsPerContender / seconds, 3.0, 9.0));
    const bool once = is_further_row && frameSeconds(checked_) > kOnceFrame;
    registerRuns("Frames/" + shortName(contender_), once ? 1 : runs / 2 * 2 + 1, nullptr);
  }

  /// With fcl::collide on the pairs; once, for it takes longest.
  void registerNarrowPhase() {
    const auto pairs = static_cast<double>(checked_.frames[0].reported);
    const double stride = std::ceil(
        std::max(pairs / kNarrowPairsPerFrame, pairs * frameCount() / kNarrowPairsPerRun));
    stride_ = static_cast<std::size_t>(std::max(stride, 1.0));
    registerRuns("Frames/" + shortName(contender_) + "_and_collide", 1,
                 [this] { return std::make_unique<NarrowPhase>(stride_); });
  }

 private:
  struct Sums {
    double set_up = 0;
    double update = 0;
    double detection = 0;
    double pairs = 0;
  };

  double frameCount() const { return static_cast<double>(frames_.size()); }

  void registerRuns(const std::string& name, int runs,
                    std::function<std::unique_ptr<NarrowPhase>()> make_narrow_phase) {
    runs_ += runs;
    benchmark::RegisterBenchmark(name.c_str(),
                                 [this, name, make_narrow_phase](benchmark::State& state) {
                                   showRun(name);
                                   for ([[maybe_unused]] auto _ : state) {
                                     const auto narrow =
                                         make_narrow_phase ? make_narrow_phase() : nullptr;
                                     report(state, run(state, narrow.get()), narrow.get());
                                   }
                                 })
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond)
        ->Iterations(1)
        ->Repetitions(runs);
  }

  static void showRun(const std::string& name) {
    ++runs_done_;
    showProgress("time " + std::to_string(runs_done_) + "/" + std::to_string(runs_) + ": " + name);
  }

  Sums run(benchmark::State& state, NarrowPhase* narrow) {
    MovingFibers& fibers = motion_.fibers;
    fibers.bringTo(0, contender_.boxes);
    Sums sums;
    std::unique_ptr<Manager> manager;
    sums.set_up = seconds([&] { manager = contender_.set_up(fibers); });
    int updates = 0;
    for (const int frame : frames_) {
      if (!contender_.ours && updates == kUpdatesPerManager) {
        manager = nullptr;  // before the next one takes memory
        manager = contender_.set_up(fibers);
        updates = 0;
      }
      fibers.setPoses(frame);
      sums.update += seconds([&] { update(contender_, fibers, *manager); });
      ++updates;
      const std::size_t pairs = detect(*manager, narrow, sums.detection);
      if (!arePairsAsBefore(frame, pairs)) {
        state.SkipWithError("reports other pairs than when it was checked, or in another run");
      }
      sums.pairs += static_cast<double>(pairs);
    }
    return sums;
  }

  /// Adds the seconds that it takes.
  static std::size_t detect(const Manager& manager, NarrowPhase* narrow, double& taken) {
    std::size_t pairs = 0;
    if (narrow == nullptr) {
      taken += seconds([&] { pairs = countPairs(manager); });
      return pairs;
    }
    const std::size_t before = narrow->pairs();
    taken += narrow->time(manager);
    return narrow->pairs() - before;
  }

  /// Embree's trees are not the same each time, and may have several boxes to a leaf.
  bool arePairsAsBefore(int frame, std::size_t pairs) {
    if (contender_.manager == "Embree") return true;
    const auto [known, is_new] = pairs_.try_emplace(frame, pairs);
    if (is_new && !motion_.summed) {
      known->second = checked_.frames[static_cast<std::size_t>(frame)].reported;
    }
    return pairs == known->second;
  }

  void report(benchmark::State& state, const Sums& sums, const NarrowPhase* narrow) const {
    // A sum over all frames, or the mean of the two that take turns.
    const double divisor = motion_.summed ? 1 : frameCount();
    state.SetIterationTime((sums.update + sums.detection) / divisor);
    state.counters["set_up"] = sums.set_up;
    state.counters["update"] = sums.update / divisor;
    state.counters["detection"] = sums.detection / divisor;
    state.counters["pairs"] = sums.pairs / divisor;
    if (narrow == nullptr) return;
    state.counters["stride"] = static_cast<double>(stride_);
    state.counters["touching"] = narrow->touching() / divisor;
  }

  static inline int runs_ = 0;
  static inline int runs_done_ = 0;

  const Contender& contender_;
  const Preflight& checked_;
  Motion& motion_;
  std::vector<int> frames_;
  std::map<int, std::size_t> pairs_;  ///< by frame
  std::size_t stride_ = 1;
};

/// What every update has to do at least: read each object's transform and capsule.
double readObjects(const MovingFibers& fibers) {
  double sum = 0;
  for (const Object* const object : fibers.objects()) {
    const fcl::Transform3d& pose = object->getTransform();
    const auto& capsule = static_cast<const fcl::Capsuled&>(*object->collisionGeometry());
    sum += pose.translation().sum() + pose.linear().col(2).sum() + capsule.lz + capsule.radius;
  }
  return sum;
}

void registerFloor(Motion& motion) {
  benchmark::RegisterBenchmark(
      "Floor/read",
      [&motion](benchmark::State& state) {
        const std::vector<int> frames = framesOfRun(motion, 0.01);
        double taken = 0;
        for (const int frame : frames) {
          motion.fibers.setPoses(frame);
          taken += seconds([&] { benchmark::DoNotOptimize(readObjects(motion.fibers)); });
        }
        for ([[maybe_unused]] auto _ : state) {
          const auto count = static_cast<double>(frames.size());
          state.SetIterationTime(motion.summed ? taken : taken / count);
        }
      })
      ->UseManualTime()
      ->Unit(benchmark::kMillisecond)
      ->Iterations(1)
      ->Repetitions(9);
}

std::vector<Preflight> check(const std::vector<Contender>& contenders, MovingFibers& fibers) {
  PreflightLimits limits;
  limits.phase_seconds = kPhaseLimit;
  limits.trial = false;
  return preflightAll(contenders, fibers, limits);
}

/// Times and counts are those of the last frames, where there are most pairs.
std::vector<Preflight> checkMotion(const std::vector<Contender>& contenders, Motion& motion) {
  if (motion.checked.empty()) return check(contenders, motion.fibers);
  std::vector<Preflight> results = check(contenders, motion.checked.front());
  for (std::size_t m = 1; m < motion.checked.size(); ++m) {
    const std::vector<Preflight> later = check(contenders, motion.checked[m]);
    for (std::size_t i = 0; i < results.size(); ++i) {
      if (results[i].right()) results[i] = later[i];
    }
  }
  return results;
}

}  // namespace

bool timeScene(const PartRequest& request) {
  Motion motion = makeMotion(request);
  const Chosen chosen = chooseContenders(request, motion);
  const std::vector<Preflight> checked = checkMotion(chosen.contenders, motion);

  bool right = true;
  std::deque<FrameRuns> runs;
  for (std::size_t i = 0; i < checked.size(); ++i) {
    const Contender& contender = chosen.contenders[i];
    registerChecked(contender, checked[i], motion.fibers);
    if (contender.ours && !checked[i].right()) right = false;
    if (!checked[i].right()) continue;
    FrameRuns& frame_runs = runs.emplace_back(contender, checked[i], motion);
    // FCL's best comes first; its other trees with tight boxes have their set-up compared alone.
    const bool is_other_tree = i > 0 && !contender.ours && contender.boxes == Boxes::kTight;
    frame_runs.registerFrames(is_other_tree || contender.manager == "Bullet_btDbvt");
    if (chosen.narrow_phase[i]) frame_runs.registerNarrowPhase();
  }
  registerFloor(motion);
  return runRegistered() && right;
}

}  // namespace fcl_fibers::benchmarks
