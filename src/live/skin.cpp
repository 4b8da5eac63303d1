// SPDX-License-Identifier: BSD-3-Clause
#include "live/skin.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace fcl_fibers::live {
namespace {

// What costs how much, in tests of a listed pair, which take about 29 ns: as measured in time on
// the scenes of the benchmarks. Listed pairs come from anywhere in memory, so a test takes longer
// than its instructions would.
constexpr double kSearch = 3.6;   ///< a search, for each segment
constexpr double kSeen = 0.9;     ///< and for each pair whose volumes overlap
constexpr double kMeasure = 0.7;  ///< to bound displacements, for each segment
constexpr double kAnchor = 1.2;   ///< to anchor a segment
constexpr double kAsked = 1.7;    ///< to compare a node with up to eight
constexpr double kListed = 5;     ///< to list a pair, and to see more pairs because of the skin

/// Below these shares of what searches cost, a list is worth its trouble, and has been worth it.
constexpr double kWorth = 0.85, kHasPaid = 0.95;

/// Motion that is so many times as fast as it was is a storm.
constexpr double kFaster = 2;

constexpr int kLeast = -3;  ///< the narrowest skin, as a power of 2

/// For fewer segments a search costs less than a list, and less than to find out.
constexpr double kFewSegments = 128;

}  // namespace

bool Skin::wantsSpeed() const {
  return is_chosen_ && last_ == 0 && rest_ == 0 && segments_ >= kFewSegments &&
         kWorth * costOfSearch() > kMeasure * segments_;
}

void Skin::setSearch(std::size_t segments, std::size_t seen) {
  segments_ = static_cast<double>(segments);
  search_ = kSearch * segments_ + kSeen * static_cast<double>(seen);
  if (last_ == 0) plain_ = search_;
}

void Skin::setMeshSearch(std::size_t segments, std::size_t touching) {
  // It hardly passes over what is far from the mesh.
  constexpr double kShareOfFar = 1.0 / 12, kNear = 80;
  segments_ = static_cast<double>(segments);
  search_ = kNear * std::min(static_cast<double>(touching) + kShareOfFar * segments_, segments_);
  if (last_ == 0) plain_ = search_;
}

void Skin::setFound(std::size_t listed, std::size_t touching) {
  touching_ = static_cast<double>(touching);
  listed_skin_ = last_;
  near_ = static_cast<double>(listed - touching);
  spent_ = search_ + kAnchor * segments_ + kListed * static_cast<double>(listed);
  served_ = 1;
  last_update_ = approach_ = 0;
}

void Skin::setApproach(double approach, std::int64_t age) {
  // In the mean of all updates a storm that has just begun would be calm.
  const double mean = approach / static_cast<double>(age);
  const double now = approach - std::exchange(approach_, approach);
  speed_ = now > kFaster * mean ? now : mean;
}

void Skin::setUpdate(std::int64_t asked, std::size_t tests) {
  last_update_ =
      kMeasure * segments_ + kAsked * static_cast<double>(asked) + static_cast<double>(tests);
  spent_ += last_update_;
  asked_ += (static_cast<double>(asked) - asked_) / served_;
  ++served_;
}

std::int64_t Skin::mostAsked() const {
  constexpr double kInStorm = 0.1, kInCalm = 0.5, kFew = 64, kFewOfGiven = 1024;
  const bool is_storm = speed_ > kFaster * expected_;
  const double search = costOfSearch() / kAsked;
  const double most =
      is_chosen_ ? (is_storm ? kInStorm : kInCalm) * search + kFew : search + kFewOfGiven;
  return static_cast<std::int64_t>(most);
}

/// The mean cost of an update with lists of this skin.
double Skin::costOf(double skin, double speed) const {
  constexpr double kLongest = 128;
  const double lives = std::min(used_ * skin / speed, kLongest);
  // What is near grows with the volume around a fiber. Before there was a list it is a guess.
  const double wider = listed_skin_ > 0 ? skin / listed_skin_ : skin;
  const double near = listed_skin_ > 0 ? near_ : touching_ + 0.1 * segments_;
  const double tests = touching_ + near * wider * std::max(1.0, std::sqrt(wider));
  const double listing = costOfSearch() + kAnchor * segments_ + kListed * tests;
  const double update = kMeasure * segments_ + kAsked * asked_ + tests;
  return (listing + lives * update) / (1 + std::floor(lives));
}

/// Lets updates search for so many updates, and the next time for more.
double Skin::rest(std::int64_t& updates, std::int64_t most) {
  rest_ = updates;
  updates = std::min(2 * updates, most);
  asked_ = 0;
  costs_ = {};
  return last_ = 0;
}

double Skin::next(bool is_used_up) {
  constexpr std::int64_t kLongestRest = 8, kLongestLongRest = 64;
  const double speed = std::exchange(speed_, -1);
  if (rest_ > 0) {
    --rest_;
    return last_ = 0;
  }
  if (speed < 0) return last_ = 0;
  double most = kWorth * costOfSearch();
  if (speed > kFaster * expected_ || kFaster * speed < expected_) costs_ = {};
  if (last_ > 0) {
    const double cost = spent_ / served_;
    // A storm tells nothing about how long a list lives.
    if (is_used_up && speed <= kFaster * expected_) {
      constexpr double kLeastUsed = 0.2;
      used_ = std::clamp(served_ * speed / last_, kLeastUsed, 1.0);
      costs_[static_cast<std::size_t>(std::ilogb(last_) - kLeast)] = cost;
    }
    if (cost <= kHasPaid * costOfSearch()) {
      in_vain_ = 0;
      next_long_rest_ = kFirstLongRest;
      most = kHasPaid * costOfSearch();
    } else if (++in_vain_ > 2) {
      return rest(next_long_rest_, kLongestLongRest);
    }
  }
  double least = most, best = 0;
  for (int i = 0; i < kSkins; ++i) {
    const double skin = std::ldexp(1.0, kLeast + i), known = costs_[static_cast<std::size_t>(i)];
    const double cost = known > 0 ? known : costOf(skin, speed);
    if (cost >= least) continue;
    least = cost;
    best = skin;
  }
  if (best == 0) return rest(next_rest_, kLongestRest);
  next_rest_ = kFirstRest;
  expected_ = speed;
  return last_ = best;
}

}  // namespace fcl_fibers::live
