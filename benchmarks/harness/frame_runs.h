// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "contenders/contender.h"
#include "contenders/narrow_phase.h"
#include "harness/runs.h"
#include "judge/preflight.h"
#include "scenes.h"

namespace fcl_fibers::benchmarks {

/// Registers what the check has found, and why the contender is not timed.
/// @param name  of the result; `Checked/<contender>` if it is empty
template <typename S>
void registerChecked(const BasicContender<S>& contender, const Preflight& checked,
                     const BasicMovingFibers<S>& fibers, const std::string& name = "");

/// One contender, whose runs are set-up and then frame by frame motion, update and detection. Those
/// of FCL and coal are set up anew before each update.
template <typename S>
class BasicFrameRuns {
 public:
  /// @param last  phase that a run goes to: there is no time of those behind it
  BasicFrameRuns(const BasicContender<S>& contender, const Preflight& checked,
                 BasicMotion<S>& motion, Phase last = Phase::kDetection);

  /// Registers `Frames/<contender>`, whose seconds are those of a frame, and one more for each kind
  /// of work that is not kCount, `Frames/<contender>_and_test` and `_and_collide`.
  /// @param runs  0: as many as a spread needs
  void registerFrames(int runs = 0, const std::vector<PairWork>& more = {});

  /// Registers one entry for each phase, `NAME/construction`, `NAME/update` and `NAME/detection`,
  /// and `NAME/touching`: detection with PairWork::kTest, unless it reports touching pairs alone.
  void registerPhases(const std::string& name);

 private:
  /// An entry, and the results that wait until it asks for them: one run serves all entries.
  struct Entry {
    PairWork work;
    std::function<double(const Numbers&)> seconds;
    std::deque<Numbers> waiting = {};
  };

  void registerEntry(const std::string& name, int runs, PairWork work,
                     std::function<double(const Numbers&)> seconds);
  void run();
  const PairSample<S>& sampleOf(int frame, const BasicManager<S>& manager);
  void notePairs(int frame, std::size_t pairs);
  void checkTouching(int frame, std::size_t touching) const;
  int runCount() const;
  bool does(PairWork work) const;

  const BasicContender<S>& contender_;
  const Preflight& checked_;
  BasicMotion<S>& motion_;
  Phase last_;
  std::vector<int> frames_;           ///< that a run goes through, after frame 0
  std::map<int, std::size_t> pairs_;  ///< by frame
  std::size_t runs_done_ = 0;
  std::map<int, PairSample<S>> samples_;  ///< by frame, for PairWork::kCollide
  std::deque<Entry> entries_;
  bool is_test_first_ = false;  ///< in a frame with PairWork::kTest, in every second one
};

extern template class BasicFrameRuns<float>;
extern template class BasicFrameRuns<double>;
using FrameRuns = BasicFrameRuns<double>;

}  // namespace fcl_fibers::benchmarks
