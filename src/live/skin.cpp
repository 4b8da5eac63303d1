// SPDX-License-Identifier: BSD-3-Clause
#include "live/skin.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace fcl_fibers::live {
namespace {

// What costs how much, in tests of a listed pair, as measured on the scenes of the benchmarks.
constexpr double kSearch = 5;     ///< a search, for each segment
constexpr double kSeen = 4;       ///< and for each pair whose volumes overlap
constexpr double kMeasure = 2.5;  ///< to bound displacements, for each segment
constexpr double kListed = 5;     ///< to list a pair

/// Below this share of what searches cost, a list is worth its trouble.
constexpr double kWorth = 0.85;

/// For fewer segments a search costs less than a list, and less than to find out.
constexpr double kFewSegments = 128;

}  // namespace

bool Skin::wantsSpeed() const {
  return is_chosen_ && last_ == 0 && rest_ == 0 && segments_ >= kFewSegments &&
         search_ > 2 * kMeasure * segments_;
}

void Skin::setSearch(std::size_t segments, std::size_t seen) {
  segments_ = static_cast<double>(segments);
  search_ = kSearch * segments_ + kSeen * static_cast<double>(seen);
}

void Skin::setMeshSearch(std::size_t segments, std::size_t touching) {
  // It hardly passes over what is far from the mesh.
  constexpr double kShareOfFar = 1.0 / 12, kNear = 40;
  segments_ = static_cast<double>(segments);
  search_ = kNear * std::min(static_cast<double>(touching) + kShareOfFar * segments_, segments_);
}

void Skin::setFound(std::size_t listed, std::size_t touching) {
  touching_ = static_cast<double>(touching);
  listed_skin_ = last_;
  near_ = static_cast<double>(listed - touching);
}

/// The mean cost of an update with lists of this skin.
double Skin::costOf(double skin, double speed) const {
  constexpr double kLongest = 64;
  // Before the skin is used up where the motion is fastest, too many have left their surroundings.
  const double lives = std::min(0.7 * skin / speed, kLongest);
  // What is near grows with the volume around a fiber. Before there was a list it is a guess.
  const double wider = listed_skin_ > 0 ? skin / listed_skin_ : skin;
  const double near = listed_skin_ > 0 ? near_ : touching_ + 0.1 * segments_;
  const double tests = touching_ + near * wider * std::max(1.0, std::sqrt(wider));
  const double listing = search_ + kMeasure * segments_ + kListed * tests;
  const double update = kMeasure * segments_ + asked_ + tests;
  return (listing + lives * update) / (1 + std::floor(lives));
}

double Skin::next() {
  const double speed = std::exchange(speed_, -1);
  if (rest_ > 0) {
    --rest_;
    return last_ = 0;
  }
  if (speed < 0) return last_ = 0;
  constexpr int kLeast = -3, kMost = 3;
  double least = kWorth * search_, best = 0;
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
    asked_ = 0;
  }
  return last_ = best;
}

}  // namespace fcl_fibers::live
