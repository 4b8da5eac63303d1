// SPDX-License-Identifier: BSD-3-Clause
#include "tools/trade/measure.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace fcl_fibers::tools::trade {
namespace {

constexpr std::size_t kLeastFrames = 5, kMostFrames = 25;
constexpr double kEnough = 0.5;  ///< seconds of all frames of a setting

double quantile(std::vector<double>& values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

double unlimited(Trial& trial) {
  Deadline deadline(std::numeric_limits<double>::infinity());
  return trial.frame(deadline);
}

}  // namespace

Outcome measure(const Scene& scene, const Verdict& verdict, const Setting& setting, Trial& usual,
                double longest) {
  const std::unique_ptr<Trial> trial = setting.make();
  Deadline deadline(longest);
  double taken = trial->frame(deadline);
  Outcome outcome;
  if (deadline.wasOver() || taken > longest) {
    outcome.is_ended = true;
    outcome.bytes = trial->bytes();
    return outcome;
  }
  outcome = compare(scene, verdict, setting, trial->found());
  std::vector<double> times, usual_times;
  while (times.size() < kLeastFrames || (taken < kEnough && times.size() < kMostFrames)) {
    usual_times.push_back(unlimited(usual));
    times.push_back(unlimited(*trial));
    taken += times.back();
  }
  outcome.bytes = trial->bytes();
  outcome.seconds = quantile(times, 0.5);
  outcome.low = quantile(times, 0.25);
  outcome.high = quantile(times, 0.75);
  outcome.times = outcome.seconds / quantile(usual_times, 0.5);
  return outcome;
}

}  // namespace fcl_fibers::tools::trade
