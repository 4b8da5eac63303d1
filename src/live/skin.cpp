// SPDX-License-Identifier: BSD-3-Clause
#include "live/skin.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace fcl_fibers::live {
namespace {

// What costs how much, in tests of a listed pair, as measured.
constexpr double kSearch = 40;  ///< a search, for each segment
constexpr double kUpdate = 3;   ///< to bound displacements and to ask about them, for each segment

/// Below this share of what searches cost, a list is worth its trouble.
constexpr double kWorth = 0.9;

/// For fewer segments a search costs less than a list, and less than to find out.
constexpr double kFewSegments = 64;

}  // namespace

bool Skin::wantsSpeed() const {
  return is_chosen_ && last_ == 0 && rest_ == 0 && segments_ >= kFewSegments;
}

void Skin::setFound(std::size_t listed, std::size_t touching) {
  touching_ = static_cast<double>(touching);
  listed_skin_ = last_;
  near_ = static_cast<double>(listed - touching);
}

/// The mean cost of an update with lists of this skin.
double Skin::costOf(double skin, double speed) const {
  constexpr double kLongest = 64;
  // Half of the skin is used up where the motion is fastest when the rest begins to fail.
  const double lives = std::min(0.7 * skin / speed, kLongest);
  // What is near grows with the volume around a fiber. Before there was a list it is a guess.
  const double wider = listed_skin_ > 0 ? skin / listed_skin_ : skin;
  const double near = listed_skin_ > 0 ? near_ : touching_ + 0.1 * segments_;
  const double tests = touching_ + near * wider * std::max(1.0, std::sqrt(wider));
  const double listing = kSearch * segments_ + 10 * tests;
  return (listing + lives * (kUpdate * segments_ + tests)) / (1 + std::floor(lives));
}

double Skin::next(std::size_t segments) {
  segments_ = static_cast<double>(segments);
  const double speed = std::exchange(speed_, -1);
  if (rest_ > 0) {
    --rest_;
    return last_ = 0;
  }
  if (speed < 0) return last_ = 0;
  constexpr int kLeast = -3, kMost = 3;
  double least = kWorth * kSearch * segments_, best = 0;
  for (int exponent = kLeast; exponent <= kMost; ++exponent) {
    const double skin = std::ldexp(1.0, exponent), cost = costOf(skin, speed);
    if (cost >= least) continue;
    least = cost;
    best = skin;
  }
  if (best > 0) {
    next_rest_ = 4;
  } else {
    constexpr std::int64_t kLongestRest = 64;
    rest_ = next_rest_;
    next_rest_ = std::min(2 * next_rest_, kLongestRest);
  }
  return last_ = best;
}

}  // namespace fcl_fibers::live
