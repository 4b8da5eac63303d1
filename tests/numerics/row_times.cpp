// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/row_times.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <vector>

#include "numerics/row_scenes.h"

namespace fcl_fibers::test {
namespace {

/// What is timed, each per segment, or per segment and reported pair for the query.
using Seconds = std::array<double, 3>;  ///< build, update, query

template <class Act>
double secondsOf(std::size_t calls, Act&& act) {
  const auto start = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < calls; ++i) act();
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
  return time.count() / static_cast<double>(calls);
}

/// A scene whose tree is timed in its environment.
template <typename S>
class Timed {
 public:
  Timed(const Assembly<S>& fibers, double margin, const FloatEnvironment& environment)
      : fibers_(fibers), environment_(environment), tree_(usualOptions(margin)) {}

  Seconds time() {
    // So many calls that a clock can tell them.
    constexpr std::size_t kSegments = 20'000;
    const ScopedFloatEnvironment scoped(environment_);
    const FiberArrays<S> view = fibers_.view();
    tree_.build(view);
    const auto segments = static_cast<double>(tree_.segmentCount());
    const std::size_t calls = 1 + kSegments / tree_.segmentCount();
    Seconds seconds;
    seconds[0] = secondsOf(calls, [&] { tree_.build(view); }) / segments;
    seconds[1] = secondsOf(calls, [&] { tree_.update(view); }) / segments;
    const double query = secondsOf(calls, [&] { tree_.find(Pairs{}, pairs_); });
    seconds[2] = query / (segments + static_cast<double>(pairs_.size()));
    return seconds;
  }

 private:
  const Assembly<S> fibers_;
  const FloatEnvironment environment_;
  FiberTree tree_;
  std::vector<SegmentPair> pairs_;
};

/// How many times as long as an ordinary scene of its size these fibers of a row take, measured in
/// turns.
template <typename S>
Seconds timesOf(const ExtremeRow<S>& row, const Assembly<S>& fibers) {
  constexpr std::size_t kTurns = 9;
  Timed<S> extreme(fibers, row.margin, row.environment);
  Timed<S> usual(ordinary<S>(fibers.capsules().size()), 0, {});
  std::array<std::array<double, kTurns>, 3> times;
  for (std::size_t turn = 0; turn < kTurns; ++turn) {
    const Seconds of_usual = usual.time(), of_extreme = extreme.time();
    for (std::size_t k = 0; k < 3; ++k) times[k][turn] = of_extreme[k] / of_usual[k];
  }
  Seconds median;
  for (std::size_t k = 0; k < 3; ++k) {
    std::nth_element(times[k].begin(), times[k].begin() + kTurns / 2, times[k].end());
    median[k] = times[k][kTurns / 2];
  }
  return median;
}

template <typename S>
std::string line(const ExtremeRow<S>& row, const std::string& scalar) {
  constexpr std::size_t kWanted = 20'000;
  const Assembly<S> fibers = repeated(row, kWanted);
  std::string line = row.name + ',' + scalar + ',' + std::to_string(fibers.capsules().size());
  for (const double times : timesOf(row, fibers)) {
    char text[64];
    std::snprintf(text, sizeof text, ",%.1f", times);
    line += text;
  }
  return line + '\n';
}

}  // namespace

std::string rowTimesTable(const std::string& names) {
  std::string table = "row,scalar,segments,build,update,query\n";
  const auto& singles = extremeRows<float>();
  const auto& doubles = extremeRows<double>();
  for (std::size_t i = 0; i < doubles.size(); ++i) {
    const bool is_wanted = doubles[i].name.compare(0, names.size(), names) == 0;
    if (!is_wanted || !doubles[i].environment.isPossible()) continue;
    table += line(singles[i], "float") + line(doubles[i], "double");
  }
  return table;
}

}  // namespace fcl_fibers::test
