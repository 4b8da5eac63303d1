// SPDX-License-Identifier: BSD-3-Clause
#include "judge/preflight.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <stdexcept>
#include <thread>
#include <type_traits>
#include <utility>

#include "judge/child.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

template <typename S>
Truth truthOf(BasicMovingFibers<S>& fibers, const PreflightLimits& limits) {
  Truth truth;
  const NextInFiber next = fibers.nextInFiber();
  for (std::size_t frame = 0; frame < (limits.update ? truth.pairs.size() : 1); ++frame) {
    fibers.setPoses(static_cast<int>(frame));
    const std::vector<Capsule> capsules = fibers.capsules();
    truth.pairs[frame] = touchingPairs(capsules, fibers.rounding());
    truth.adjacent[frame] = adjacentCount(next, truth.pairs[frame]);
    if constexpr (std::is_same_v<S, float>) {
      // A manager that misses all of these would pass.
      const std::size_t open =
          touchingPairs(capsules, fibers.rounding(), Contact::kBoundary).size();
      if (open <= truth.pairs[frame].size()) continue;
      throw std::invalid_argument(
          "'" + fibers.name() + "': rounding of float decides " + std::to_string(open) +
          " pairs, and " + std::to_string(truth.pairs[frame].size()) +
          " touch for certain; take double, or a scene nearer to the origin");
    }
  }
  return truth;
}

void judgeWrong(Preflight& result, std::size_t frame, std::size_t count, const std::string& what) {
  result.verdict = Preflight::Verdict::kWrong;
  result.phase = Phase::kDetection;
  result.note = "wrong: " + std::to_string(count) + what;
  constexpr std::array kWhen = {"", " after update", " after two updates", " after three updates"};
  result.when = kWhen.at(frame);
}

/// What is wrong whatever the others report.
template <typename S>
void judgeAlone(const BasicContender<S>& contender, Preflight& result) {
  for (std::size_t f = 0; f < result.frames.size(); ++f) {
    const PairCounts& counts = result.frames[f];
    const std::pair<std::size_t, const char*> faults[] = {
        {counts.repeated, " reported again"},
        {counts.with_itself, " with themselves"},
        {counts.foreign, " of objects that it was not given, or whose user data it has changed"},
        {contender.leaves_out_adjacent ? counts.adjacent : 0, " adjacent"},
        {contender.reported == Reported::kTouching ? counts.apart : 0, " not touching"}};
    for (const auto& [count, what] : faults) {
      if (count > 0) return judgeWrong(result, f, count, what);
    }
  }
}

void judgeMissed(Preflight& result, const Truth& truth, bool without_adjacent) {
  for (std::size_t f = 0; f < result.frames.size(); ++f) {
    const PairCounts& counts = result.frames[f];
    const std::size_t found = counts.touching - (without_adjacent ? counts.adjacent : 0);
    const std::size_t frame = f % truth.pairs.size();
    const std::size_t due =
        truth.pairs[frame].size() - (without_adjacent ? truth.adjacent[frame] : 0);
    if (!counts.checked || found >= due) continue;
    judgeWrong(result, f, due - found, " missed");
    if (result.missed && !without_adjacent) {
      const auto [i, j] = *result.missed;
      result.detail = "such as objects " + std::to_string(i) + " and " + std::to_string(j);
    }
    return;
  }
}

/// Bounds may be rounded outward, so ours may report a few more pairs, and none less.
constexpr double kRoundingExcess = 0.01;

/// Each of ours against FCL's manager of its group, if there is one, or else against the fewest
/// pairs. What some leave out counts for none.
template <typename S>
void judgeWork(const std::vector<BasicContender<S>>& contenders, std::vector<Preflight>& results,
               bool without_adjacent) {
  const auto reported = [&](std::size_t i, std::size_t frame) {
    const PairCounts& counts = results[i].frames[frame];
    return counts.reported - (without_adjacent ? counts.adjacent : 0);
  };
  for (const Reported group : {Reported::kTightBoxes, Reported::kSpheres}) {
    std::vector<std::size_t> members;
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      if (contenders[i].reported == group && results[i].right()) members.push_back(i);
    }
    if (members.empty()) continue;
    const auto rank = [&](std::size_t i) {
      return std::make_pair(contenders[i].boxes != Boxes::kTight, reported(i, 0));
    };
    const std::size_t reference =
        *std::min_element(members.begin(), members.end(),
                          [&](std::size_t i, std::size_t j) { return rank(i) < rank(j); });
    for (const std::size_t i : members) {
      if (!contenders[i].ours) continue;
      for (std::size_t f = 0; f < results[i].frames.size(); ++f) {
        const bool is_known = results[i].frames[f].checked && results[reference].frames[f].checked;
        if (!is_known) continue;
        const std::size_t due = reported(reference, f);
        const bool more =
            static_cast<double>(reported(i, f)) > (1 + kRoundingExcess) * static_cast<double>(due);
        // Nobody computes the spheres exactly, and each tree rounds them in a frame of its own.
        const double least =
            (group == Reported::kSpheres ? 1 - kRoundingExcess : 1) * static_cast<double>(due);
        if (static_cast<double>(reported(i, f)) < least || more) {
          judgeWrong(results[i], f, reported(i, f), " pairs instead of " + std::to_string(due));
        }
      }
    }
  }
}

}  // namespace

std::string Preflight::whyNotTimed() const {
  std::string why = note;
  if (!why.empty()) why += std::string(" in ") + phaseName(phase) + when;
  if (!detail.empty()) why += ": " + detail;
  return why;
}

template <typename S>
std::vector<Preflight> preflightAll(const std::vector<BasicContender<S>>& contenders,
                                    BasicMovingFibers<S>& fibers, const PreflightLimits& limits) {
  const bool without_adjacent =
      std::any_of(contenders.begin(), contenders.end(),
                  [](const auto& contender) { return contender.leaves_out_adjacent; });
  Truth truth;
  if (limits.check) {
    tools::progress(fibers.name() + ": find what touches");
    truth = truthOf(fibers, limits);
  }
  std::vector<Preflight> results;
  std::deque<Child> running;
  for (std::size_t started = 0; results.size() < contenders.size();) {
    if (started < contenders.size() && running.size() < limits.at_once) {
      const auto& contender = contenders[started];
      tools::progress(fibers.name() + (limits.check ? ": check " : ": try ") +
                      std::to_string(++started) + "/" + std::to_string(contenders.size()) + ": " +
                      contender.title());
      running.emplace_back(contender, fibers, limits, truth);
      continue;
    }
    for (bool ended = false; !ended; std::this_thread::sleep_for(std::chrono::milliseconds(1))) {
      for (Child& child : running) child.hasEnded();
      ended = running.front().hasEnded();
    }
    Preflight result = running.front().result();
    running.pop_front();
    judgeAlone(contenders[results.size()], result);
    if (result.verdict != Preflight::Verdict::kWrong) judgeMissed(result, truth, without_adjacent);
    results.push_back(result);
  }
  judgeWork(contenders, results, without_adjacent);
  tools::progress("");
  return results;
}

template <typename S>
bool oursAreRight(const std::vector<BasicContender<S>>& contenders,
                  const std::vector<Preflight>& preflights) {
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const bool slow = preflights[i].verdict == Preflight::Verdict::kTooSlow;
    if (contenders[i].ours && !preflights[i].right() && !slow) return false;
  }
  return true;
}

template std::vector<Preflight> preflightAll(const std::vector<BasicContender<float>>&,
                                             BasicMovingFibers<float>&, const PreflightLimits&);
template std::vector<Preflight> preflightAll(const std::vector<BasicContender<double>>&,
                                             BasicMovingFibers<double>&, const PreflightLimits&);
template bool oursAreRight(const std::vector<BasicContender<float>>&,
                           const std::vector<Preflight>&);
template bool oursAreRight(const std::vector<BasicContender<double>>&,
                           const std::vector<Preflight>&);

}  // namespace fcl_fibers::benchmarks
