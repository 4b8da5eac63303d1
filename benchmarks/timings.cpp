// SPDX-License-Identifier: BSD-3-Clause
#include "timings.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "progress.h"

namespace fcl_fibers::benchmarks {
namespace {

// Seconds that a run repeats a fast phase for, and that all runs of one benchmark are to take. More
// make the medians steadier and the whole slower: there are eighty benchmarks to a scene.
constexpr double kSecondsPerRun = 0.03;
constexpr double kSecondsPerBenchmark = 0.5;
constexpr double kMinRuns = 3;
constexpr double kMaxRuns = 9;

// One of FCL's managers this many times slower than its fastest is run once: its rank is certain,
// and its runs would take most of the time.
constexpr double kFarBehind = 8;

/// Runs of a phase that takes so many seconds once, odd for the median to be one of them.
int runsFor(double seconds) {
  const double runs =
      std::clamp(kSecondsPerBenchmark / std::max(seconds, kSecondsPerRun), kMinRuns, kMaxRuns);
  return static_cast<int>(runs) / 2 * 2 + 1;
}

double updateAndSelf(const Preflight& preflight) {
  return preflight.seconds[static_cast<std::size_t>(Phase::kUpdate)] +
         preflight.seconds[static_cast<std::size_t>(Phase::kSelfCollision)];
}

// Updates that a manager lives through before it is set up anew. FCL's trees become slower with
// every update, by half after a thousand on 8,000 segments and its array form a hundred times, so
// that times would depend on how many runs came before.
constexpr int kUpdatesPerManager = 10;

/// A contender and its manager, which its benchmarks share.
class Timed {
 public:
  Timed(const Contender& contender, const Preflight& preflight, MovingFibers& fibers)
      : contender_(contender), preflight_(preflight), fibers_(fibers) {}

  /// Repetitions are --benchmark_repetitions if there is such a flag.
  void registerBenchmark(Phase phase, const std::string& name, bool choose_repetitions,
                         bool run_once) {
    const double expected = std::max(expectedSeconds(phase), 1e-9);
    const bool updates = phase == Phase::kUpdate || phase == Phase::kFrame;
    const double iterations = std::clamp(std::round(kSecondsPerRun / expected), 1.0,
                                         updates ? kUpdatesPerManager : 1000.0);
    benchmark::internal::Benchmark* const registered =
        benchmark::RegisterBenchmark(name.c_str(), [this, phase, name](benchmark::State& state) {
          showRun(name);
          run(phase, state);
          setCounters(state);
        });
    registered->UseManualTime()
        ->Unit(benchmark::kMillisecond)
        ->Iterations(static_cast<benchmark::IterationCount>(iterations));
    const int repetitions = choose_repetitions && !run_once ? runsFor(expected) : 1;
    if (choose_repetitions) registered->Repetitions(repetitions);
    runs_ += repetitions;
  }

 private:
  double expectedSeconds(Phase phase) const {
    if (phase != Phase::kFrame) return preflight_.seconds[static_cast<std::size_t>(phase)];
    return updateAndSelf(preflight_);
  }

  static void showRun(const std::string& name) {
    ++runs_done_;
    const int percent = std::min(100, 100 * runs_done_ / runs_);
    // A log gets a line for every tenth of the work.
    if (progressOverwrites() || percent / 10 > 100 * (runs_done_ - 1) / runs_ / 10) {
      showProgress("time " + std::to_string(percent) + " %: " + name);
    }
  }

  void run(Phase phase, benchmark::State& state) {
    switch (phase) {
      case Phase::kSetUp:
        return runSetUp(state);
      case Phase::kUpdate:
        return runUpdate(state);
      case Phase::kSelfCollision:
        return runSelfCollision(state);
      case Phase::kFrame:
        return runFrame(state);
    }
  }

  void runSetUp(benchmark::State& state) {
    fibers_.bringTo(0, contender_.boxes);
    for ([[maybe_unused]] auto _ : state) {
      std::unique_ptr<Manager> manager;
      state.SetIterationTime(seconds([&] { manager = contender_.set_up(fibers_); }));
    }
  }

  void runUpdate(benchmark::State& state) {
    prepareManager(static_cast<int>(state.max_iterations));
    for ([[maybe_unused]] auto _ : state) {
      fibers_.setPoses(otherFrame());
      state.SetIterationTime(seconds([&] { update(contender_, fibers_, *manager_); }));
      noteUpdate();
    }
  }

  void runSelfCollision(benchmark::State& state) {
    prepareManager(0);
    for ([[maybe_unused]] auto _ : state) {
      std::size_t pairs = 0;
      state.SetIterationTime(seconds([&] { pairs = countPairs(*manager_); }));
      if (!arePairsAsChecked(state, pairs)) break;
    }
  }

  void runFrame(benchmark::State& state) {
    prepareManager(static_cast<int>(state.max_iterations));
    for ([[maybe_unused]] auto _ : state) {
      std::size_t pairs = 0;
      state.SetIterationTime(seconds([&] {
        fibers_.setPoses(otherFrame());
        update(contender_, fibers_, *manager_);
        pairs = countPairs(*manager_);
      }));
      noteUpdate();
      if (!arePairsAsChecked(state, pairs)) break;
    }
  }

  /// Whoever used the objects last: manager and objects stand in frame 0, and the manager can take
  /// so many updates.
  void prepareManager(int updates) {
    fibers_.bringTo(0, contender_.boxes);
    const int back = frame_ == 0 ? 0 : 1;
    if (!manager_ || updates_ + back + updates > kUpdatesPerManager) {
      manager_ = nullptr;  // before the next one takes memory
      manager_ = contender_.set_up(fibers_);
      updates_ = 0;
      frame_ = 0;
    } else if (back > 0) {
      manager_->update();
      noteUpdate();
    }
  }

  void noteUpdate() {
    frame_ = fibers_.frame();
    ++updates_;
  }

  int otherFrame() const { return frame_ == 0 ? 1 : 0; }

  /// What is timed is what was checked.
  bool arePairsAsChecked(benchmark::State& state, std::size_t pairs) const {
    if (pairs == preflight_.frames[static_cast<std::size_t>(frame_)].reported) return true;
    state.SkipWithError("reports other pairs than when it was checked");
    return false;
  }

  void setCounters(benchmark::State& state) const {
    state.counters["pairs"] = static_cast<double>(preflight_.frames[0].reported);
    state.counters["touching"] = static_cast<double>(preflight_.frames[0].touching);
    state.counters["segments"] = static_cast<double>(fibers_.segmentCount());
    state.counters["fibers"] = static_cast<double>(fibers_.fiberCount());
    state.counters["bytes"] = static_cast<double>(preflight_.bytes);
    if (contender_.ours) {
      state.counters["volume_tests"] = static_cast<double>(preflight_.volume_tests);
    }
  }

  static inline int runs_ = 0;
  static inline int runs_done_ = 0;

  const Contender& contender_;
  const Preflight& preflight_;
  MovingFibers& fibers_;
  std::unique_ptr<Manager> manager_;
  int frame_ = 0;    ///< where the manager last saw the objects
  int updates_ = 0;  ///< of this manager
};

/// Keeps the medians; prints nothing, for the table is printed at the end.
class MedianReporter : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      const std::string& name = run.run_name.function_name;
      if (run.error_occurred) {
        wrong.insert(name);
      } else if (run.aggregate_name == "median" || run.repetitions == 1) {
        seconds[name] = run.GetAdjustedRealTime() / benchmark::GetTimeUnitMultiplier(run.time_unit);
      }
    }
  }

  std::map<std::string, double> seconds;
  std::set<std::string> wrong;
};

}  // namespace

std::vector<Timing> timeContenders(const std::vector<Contender>& contenders,
                                   std::vector<Preflight>& preflights, MovingFibers& fibers,
                                   bool choose_repetitions) {
  const auto benchmarkName = [&](Phase phase, const Contender& contender) {
    return std::string(phaseName(phase)) + "/" + contender.manager + "/" + contender.variant + "/" +
           fibers.name();
  };

  double fastest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    if (contenders[i].ours || !preflights[i].right()) continue;
    fastest = std::min(fastest, updateAndSelf(preflights[i]));
  }

  std::vector<std::unique_ptr<Timed>> timed;
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    if (!preflights[i].right()) continue;
    timed.push_back(std::make_unique<Timed>(contenders[i], preflights[i], fibers));
    const bool run_once =
        !contenders[i].ours && updateAndSelf(preflights[i]) > kFarBehind * fastest;
    for (int p = 0; p < kPhases; ++p) {
      const Phase phase = static_cast<Phase>(p);
      timed.back()->registerBenchmark(phase, benchmarkName(phase, contenders[i]),
                                      choose_repetitions, run_once);
    }
  }
  MedianReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::ClearRegisteredBenchmarks();
  endProgress();

  std::vector<Timing> timings(contenders.size());
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    timings[i].fill(Preflight::kUnknown);
    for (int p = 0; p < kPhases; ++p) {
      const std::string name = benchmarkName(static_cast<Phase>(p), contenders[i]);
      if (reporter.wrong.count(name) > 0) {
        preflights[i].verdict = Preflight::Verdict::kWrong;
        preflights[i].phase = Phase::kSelfCollision;
        preflights[i].note = "wrong: other pairs after more updates";
      }
      const auto found = reporter.seconds.find(name);
      if (found != reporter.seconds.end()) timings[i][static_cast<std::size_t>(p)] = found->second;
    }
    if (!preflights[i].right()) timings[i].fill(Preflight::kUnknown);
  }
  return timings;
}

}  // namespace fcl_fibers::benchmarks
