// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "contenders/contender.h"
#include "contenders/narrow_phase.h"
#include "harness/runs.h"
#include "judge/preflight.h"
#include "scenes.h"

namespace fcl_fibers::benchmarks {

/// Registers `Checked/<contender>`: what the check has found, and why the contender is not timed.
void registerChecked(const Contender& contender, const Preflight& checked,
                     const MovingFibers& fibers);

/// One contender, whose runs are set-up and then frame by frame motion, update and detection:
/// `Frames/<contender>`. FCL's are set up anew before each update.
class FrameRuns {
 public:
  /// @param last  phase that a run goes to: there is no time of those behind it
  FrameRuns(const Contender& contender, const Preflight& checked, Motion& motion,
            Phase last = Phase::kDetection);

  /// @param runs  0: as many as a spread needs
  /// @param narrow_phase  `Frames/<contender>_and_collide` too, with fcl::collide on the pairs, or
  /// on a sample of them
  void registerFrames(int runs = 0, bool narrow_phase = false);

 private:
  /// The numbers of a run, and the seconds of its frame.
  double frame(Numbers& numbers, bool with_narrow_phase);
  void run();
  const PairSample& sampleOf(int frame, const Manager& manager);
  void notePairs(int frame, std::size_t pairs);
  int runCount() const;

  const Contender& contender_;
  const Preflight& checked_;
  Motion& motion_;
  Phase last_;
  std::vector<int> frames_;           ///< that a run goes through, after frame 0
  std::map<int, std::size_t> pairs_;  ///< by frame
  bool narrow_phase_ = false;
  std::map<int, PairSample> samples_;  ///< by frame, for the narrow phase
  /// A run with a narrow phase does both kinds of detection, and the results of one kind wait here
  /// until they are asked for.
  std::deque<Numbers> plain_, with_narrow_phase_;
};

}  // namespace fcl_fibers::benchmarks
