// SPDX-License-Identifier: BSD-3-Clause
#include "harness/runs.h"

#include <benchmark/benchmark.h>

#include <cstdio>
#include <exception>
#include <utility>
#include <vector>

#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

bool is_registered = false;
int runs_registered = 0;
int runs_done = 0;
bool ours_failed = false;

/// Google Benchmark 1.8 has given it another name.
///@{
template <class Run>
auto errorOf(const Run& run, int /*first choice*/) -> decltype(run.skip_message) {
  return run.skip_message;
}
template <class Run>
auto errorOf(const Run& run, long /*second choice*/) -> decltype(run.error_message) {
  return run.error_message;
}
///@}

/// Prints nothing but errors.
class ErrorReporter : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      const std::string error = benchmarks::errorOf(run);
      if (error.empty()) continue;
      tellWrong(run.run_name.function_name + ": " + error);
    }
  }
};

void registerBenchmark(const std::string& name, int runs,
                       const std::function<void(benchmark::State&)>& run) {
  is_registered = true;
  benchmark::RegisterBenchmark(name.c_str(), run)
      ->UseManualTime()
      ->Unit(benchmark::kMillisecond)
      ->Iterations(1)
      ->Repetitions(runs);
}

void setCounters(benchmark::State& state, const Numbers& numbers) {
  for (const auto& [counter, value] : numbers) state.counters[counter] = value;
}

}  // namespace

void registerRuns(const std::string& name, int runs, std::function<double(Numbers&)> run,
                  bool ours) {
  runs_registered += runs;
  registerBenchmark(name, runs, [name, ours, run = std::move(run)](benchmark::State& state) {
    tools::progress("run " + std::to_string(++runs_done) + "/" + std::to_string(runs_registered) +
                    ": " + name);
    for ([[maybe_unused]] auto _ : state) {
      Numbers numbers;
      try {
        state.SetIterationTime(run(numbers));
        numbers.emplace(kEnd, tools::secondsNow());
      } catch (const std::exception& error) {
        ours_failed = ours_failed || ours;
        return state.SkipWithError(error.what());
      } catch (...) {
        ours_failed = ours_failed || ours;
        return state.SkipWithError("throws what is no std::exception");
      }
      setCounters(state, numbers);
    }
  });
}

void registerNumbers(const std::string& name, const Numbers& numbers, const std::string& label) {
  registerBenchmark(name, 1, [numbers, label](benchmark::State& state) {
    for ([[maybe_unused]] auto _ : state) state.SetIterationTime(0);
    setCounters(state, numbers);
    state.SetLabel(label);
  });
}

std::string errorOf(const benchmark::BenchmarkReporter::Run& run) { return errorOf(run, 0); }

bool tellWrong(const std::string& what) {
  tools::progress("");
  std::fprintf(stderr, "%s\n", what.c_str());
  return false;
}

bool runRegistered() {
  ErrorReporter reporter;
  return runRegistered(&reporter);
}

bool runRegistered(benchmark::BenchmarkReporter* reporter) {
  if (!is_registered) return true;  // which Google Benchmark would call an error
  if (reporter == nullptr) {
    benchmark::RunSpecifiedBenchmarks();
  } else {
    benchmark::RunSpecifiedBenchmarks(reporter);
  }
  benchmark::ClearRegisteredBenchmarks();
  tools::progress("");
  return !ours_failed;
}

}  // namespace fcl_fibers::benchmarks
