// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "contenders/contender.h"
#include "harness/runs.h"
#include "judge/preflight.h"
#include "scenes.h"

namespace fcl_fibers::benchmarks {

/// Registers `Checked/<contender>`: what the check has found, and why the contender is not timed.
void registerChecked(const Contender& contender, const Preflight& checked,
                     const MovingFibers& fibers);

/// One contender, whose runs are set-up and then frame by frame motion, update and detection:
/// `Frames/<contender>`. A contender that lives longer than a few frames is set up anew meanwhile.
class FrameRuns {
 public:
  /// @param last  phase that a run goes to: there is no time of those behind it
  FrameRuns(const Contender& contender, const Preflight& checked, Motion& motion,
            Phase last = Phase::kDetection);

  /// @param runs  0: as many as a spread needs
  void registerFrames(int runs = 0);

  /// `Frames/<contender>_and_collide`: with fcl::collide on the pairs, or on a sample of them.
  void registerNarrowPhase();

 private:
  double run(Numbers& numbers, bool with_narrow_phase);
  void notePairs(int frame, std::size_t pairs);
  int runCount() const;

  const Contender& contender_;
  const Preflight& checked_;
  Motion& motion_;
  Phase last_;
  std::vector<int> frames_;           ///< that a run goes through, after frame 0
  std::map<int, std::size_t> pairs_;  ///< by frame
};

}  // namespace fcl_fibers::benchmarks
