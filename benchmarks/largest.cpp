// SPDX-License-Identifier: BSD-3-Clause
#include "largest.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <string>
#include <utility>

#include "moving_fibers.h"
#include "preflight.h"
#include "progress.h"
#include "table.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr double kSeconds = 60;
// Growth is a guess; a try that fails costs all of kSeconds.
constexpr double kStartBelowSeconds = 50;
constexpr int kFirstFibers = 125;

/// How far one contender has come.
struct Climb {
  const Contender* contender;
  bool climbing = true;
  bool updates = true;  ///< false once an update has proved not to end
  int fibers = 0;       ///< largest size that it finished
  Preflight done;       ///< at that size
  double growth = 4;    ///< of its time when fibers double: quadratic until it is known
  std::string note;
};

double total(const Preflight& preflight, bool updates) {
  const auto seconds = [&](Phase phase) {
    return preflight.seconds[static_cast<std::size_t>(phase)];
  };
  return seconds(Phase::kSetUp) + (updates ? seconds(Phase::kUpdate) : 0) +
         seconds(Phase::kSelfCollision);
}

/// The first size is small enough to be checked as every scene is, with others to be held to.
void checkFirstSize(const std::vector<Contender>& contenders, MovingFibers& fibers,
                    std::vector<Climb>& climbs) {
  std::vector<Contender> checked;
  for (const Contender& contender : contenders) {
    const bool climbs_too = std::any_of(climbs.begin(), climbs.end(), [&](const Climb& climb) {
      return climb.contender == &contender;
    });
    if (climbs_too || contender.reported == Reported::kTightBoxes) checked.push_back(contender);
  }
  const std::vector<Preflight> results = preflightAll(checked, fibers, PreflightLimits());
  for (Climb& climb : climbs) {
    const auto found = std::find_if(
        checked.begin(), checked.end(),
        [&](const Contender& contender) { return contender.title() == climb.contender->title(); });
    climb.done = results[static_cast<std::size_t>(found - checked.begin())];
    const bool endless_update =
        climb.done.verdict == Preflight::Verdict::kTooSlow && climb.done.phase == Phase::kUpdate;
    if (endless_update) climb.updates = false;
    if (climb.done.right() || endless_update) {
      climb.fibers = static_cast<int>(fibers.fiberCount());
    } else {
      climb.climbing = false;
      climb.note = climb.done.note;
    }
  }
}

void climbOn(MovingFibers& fibers, Climb& climb) {
  const double last = total(climb.done, climb.updates);
  if (last * climb.growth > kStartBelowSeconds) {
    climb.climbing = false;
    return;
  }
  const int count = static_cast<int>(fibers.fiberCount());
  showProgress("largest in 60 s: " + climb.contender->title() + ", " + std::to_string(count) +
               " fibers");
  PreflightLimits limits;
  limits.phase_seconds = kSeconds;
  limits.check = false;
  limits.update = climb.updates;
  const Preflight result = preflight(*climb.contender, fibers, limits);
  const double now = total(result, climb.updates);
  climb.climbing = result.right() && now <= kSeconds;
  if (!climb.climbing) return;
  // Less than twice the time for twice the fibers is noise.
  climb.growth = std::max(now / last, 2.0);
  climb.done = result;
  climb.fibers = count;
}

}  // namespace

void printLargest(const std::vector<Contender>& contenders, int segments, unsigned long long seed) {
  std::vector<Climb> climbs;
  for (const Contender& contender : contenders) {
    if (contender.manager != "SaP" && contender.manager != "SSaP") continue;
    climbs.emplace_back();
    climbs.back().contender = &contender;
  }
  const Contender& ours = contenders.front();
  std::vector<std::pair<int, Preflight>> ours_by_fibers;

  const auto anyClimbing = [&] {
    return std::any_of(climbs.begin(), climbs.end(),
                       [](const Climb& climb) { return climb.climbing; });
  };
  for (int count = kFirstFibers; anyClimbing(); count *= 2) {
    MovingFibers fibers = makeMovingStrand(count, segments, seed);
    PreflightLimits limits;
    limits.check = false;
    ours_by_fibers.emplace_back(count, preflight(ours, fibers, limits));
    if (count == kFirstFibers) {
      checkFirstSize(contenders, fibers, climbs);
      continue;
    }
    for (Climb& climb : climbs) {
      if (climb.climbing) climbOn(fibers, climb);
    }
  }
  endProgress();

  std::printf(
      "\nLargest strand of %d segments a fiber within 60 s, fibers doubled from %d, each tried "
      "once\n\n",
      segments, kFirstFibers);
  TextTable table({"manager", "segments", "set-up", "update", "self-collision", "total",
                   ours.title() + ": total", "ratio"});
  for (const Climb& climb : climbs) {
    if (climb.fibers == 0) {
      table.add({climb.contender->title(), "-", "-", "-", climb.note, "-", "-", "-"});
      continue;
    }
    const Preflight& same_size =
        std::find_if(ours_by_fibers.begin(), ours_by_fibers.end(), [&](const auto& entry) {
          return entry.first == climb.fibers;
        })->second;
    const double theirs = total(climb.done, climb.updates);
    const double at_same_size = total(same_size, climb.updates);
    const auto cell = [&](Phase phase) {
      return timeText(climb.done.seconds[static_cast<std::size_t>(phase)]);
    };
    table.add(
        {climb.contender->title(),
         countText(static_cast<std::size_t>(climb.fibers) * static_cast<std::size_t>(segments)),
         cell(Phase::kSetUp), climb.updates ? cell(Phase::kUpdate) : "without, >10 s",
         cell(Phase::kSelfCollision), timeText(theirs), timeText(at_same_size),
         ratioText(at_same_size / theirs)});
  }
  table.print();
  std::fflush(stdout);
}

}  // namespace fcl_fibers::benchmarks
