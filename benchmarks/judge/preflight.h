// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "contenders/contender.h"

namespace fcl_fibers::benchmarks {

/// What a contender reported in one frame. Each pair is judged by one exact test of the capsules.
struct PairCounts {
  bool checked = false;
  std::size_t reported = 0;
  std::size_t touching = 0;   ///< different ones
  std::size_t repeated = 0;   ///< touching ones reported once more
  std::size_t apart = 0;      ///< neither touching nor at the boundary of it
  std::size_t undecided = 0;  ///< at that boundary, where rounding decides
  std::size_t with_itself = 0;
  std::size_t foreign = 0;   ///< with null, or an object that the manager was not given
  std::size_t adjacent = 0;  ///< adjacent segments of a fiber, touching ones
};

/// What the process of a contender leaves, however it ended.
struct Measured {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  Phase phase = Phase::kSetUp;  ///< where it ended, unless right
  /// Of each phase, the last time.
  std::array<double, kPhases> seconds = {kUnknown, kUnknown, kUnknown};
  /// Of each query: in frame 0, after the update to frame 1, and if asked again after two more.
  std::array<PairCounts, 2 * MovingFibers::kFrames> frames;
  std::optional<CapsulePair> missed;   ///< one that touches, of the last query that missed any
  std::size_t bytes = 0;               ///< that set-up allocated and kept
  std::size_t bytes_after_frames = 0;  ///< that it keeps when all is done
  std::size_t bytes_stated = 0;        ///< memoryUsage(), ours only
};

/// What one contender did, once, in a process of its own: set up, self-collide in frame 0, move,
/// update, self-collide in frame 1, move back, update. Some of FCL's managers crash or never end.
struct Preflight : Measured {
  enum class Verdict { kRight, kTooSlow, kWrong, kCrashed, kRefused };

  Verdict verdict = Verdict::kRight;
  std::string note;    ///< what the table says there instead of a time
  std::string when;    ///< it is wrong, ` after update`
  std::string detail;  ///< a refusal's text

  bool right() const { return verdict == Verdict::kRight; }
  /// `>10 s in update`, `wrong: 3 missed in detection after update`, or nothing.
  std::string whyNotTimed() const;
  double phaseSeconds(Phase p) const { return seconds[static_cast<std::size_t>(p)]; }
  double frameSeconds() const {
    return phaseSeconds(Phase::kUpdate) + phaseSeconds(Phase::kDetection);
  }
};

struct PreflightLimits {
  double phase_seconds = 10;  ///< a phase that takes longer ends the contender
  bool check = true;          ///< else pairs are counted only, once, and it does not move back
  bool update = true;         ///< else it stays in frame 0
  bool again = false;         ///< updates to both frames once more, unless Contender::is_renewed
  bool show_errors = false;   ///< what it writes to stderr is shown
  std::size_t at_once = 1;    ///< contenders that run at the same time, whose seconds then say less
};

/// Runs all contenders and judges them by touchingPairs(), which each must have reported, and by
/// one another: those that owe the same pairs must report as many. Where one of them leaves out
/// adjacent segments, all are compared without these.
template <typename S>
std::vector<Preflight> preflightAll(const std::vector<BasicContender<S>>& contenders,
                                    BasicMovingFibers<S>& fibers, const PreflightLimits& limits);

/// Whether none of ours is wrong; to be too slow is not.
template <typename S>
bool oursAreRight(const std::vector<BasicContender<S>>& contenders,
                  const std::vector<Preflight>& preflights);

}  // namespace fcl_fibers::benchmarks
