// SPDX-License-Identifier: BSD-3-Clause
#include "live/skin.h"

#include <algorithm>
#include <cmath>

namespace fcl_fibers::live {
namespace {

constexpr int kLeast = -4, kMost = 3;

// What costs how much, in tests of a listed pair, as measured.
constexpr double kSearchOfSegment = 40;  ///< a search, for each segment
constexpr double kMoveOfSegment = 2;     ///< bounding its displacement

constexpr std::int64_t kLongestRest = 64;

}  // namespace

double Skin::next(double size) {
  if (fixed_ >= 0) return last_ = fixed_;
  size_ = size;
  if (rest_ > 0) {
    --rest_;
    return last_ = 0;
  }
  return last_ = std::ldexp(size, exponent_);
}

void Skin::observe(const Listing& listing, std::int64_t life) {
  if (fixed_ >= 0 || last_ == 0 || listing.segments == 0) return;
  const auto segments = static_cast<double>(listing.segments);
  const double search = kSearchOfSegment * segments;
  const double lasted = static_cast<double>(std::max<std::int64_t>(life, 1));
  const double touching = static_cast<double>(listing.touching);
  const double near = static_cast<double>(listing.listed) - touching;
  int best = kLeast;
  double least = search;
  bool pays = false;
  for (int exponent = kLeast; exponent <= kMost; ++exponent) {
    const double wider = std::ldexp(1.0, exponent - exponent_);
    // A list that has not outlived the first update tells only that the motion is faster.
    const double lives = life == 0 ? 0.5 * wider : lasted * wider;
    if (lives < 1) continue;
    // Pairs that are near grow with the volume around a fiber.
    const double tests = touching + near * wider * std::sqrt(std::max(wider, 1.0));
    const double cost =
        (search * (1 + 0.1 * tests / (touching + segments))) / (std::floor(lives) + 1) +
        kMoveOfSegment * segments + tests;
    if (cost >= least) continue;
    least = cost;
    best = exponent;
    pays = true;
  }
  if (pays) {
    // Far from where it was observed, the estimate is poor.
    exponent_ = std::clamp(best, exponent_ - 2, exponent_ + 2);
    next_rest_ = 4;
    return;
  }
  rest_ = next_rest_;
  next_rest_ = std::min(2 * next_rest_, kLongestRest);
}

}  // namespace fcl_fibers::live
