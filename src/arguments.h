// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

#include "joined_text.h"

namespace fcl_fibers {

/// Throws std::invalid_argument: "call: name is value; remedy".
template <typename Value>
[[noreturn]] void refuseArgument(const char* call, const char* name, const Value& value,
                                 const char* remedy) {
  throw std::invalid_argument(joinedText(call, ": ", name, " is ", value, "; ", remedy));
}

/// Returns the radius as S. The limit leaves room for sums of a few radii.
template <typename S>
S requireRadius(const char* call, double radius) {
  constexpr double kLimit = std::numeric_limits<S>::max() / 4;
  if (!(radius >= 0 && radius <= kLimit)) {
    refuseArgument(call, "radius", radius, "give a finite radius of 0 or more");
  }
  return static_cast<S>(radius);
}

/// Checks that point_begin is as FiberPolylines requires.
inline void requireFiberRanges(const char* call, const FiberPolylines& scene) {
  const std::vector<std::size_t>& begin = scene.point_begin;
  const auto refuse = [call](const std::string& reason) {
    throw std::invalid_argument(std::string(call) + ": point_begin " + reason +
                                "; it must run from 0 to the number of points and never descend");
  };
  if (begin.empty()) refuse("is empty");
  if (begin.front() != 0) refuse("starts at " + std::to_string(begin.front()));
  for (std::size_t f = 0; f + 1 < begin.size(); ++f) {
    if (begin[f + 1] < begin[f]) refuse("descends at fiber " + std::to_string(f));
  }
  if (begin.back() != scene.points.size()) {
    refuse("ends at " + std::to_string(begin.back()) + ", but there are " +
           std::to_string(scene.points.size()) + " points");
  }
}

/// Checks that all radii are finite in S and not negative, and that their number is right.
template <typename S>
void requireRadii(const char* call, const FiberPolylines& scene) {
  requireRadius<S>(call, scene.radius);
  if (!scene.radii.empty() && scene.radii.size() != scene.points.size()) {
    refuseArgument(call, "the number of radii", scene.radii.size(),
                   "give one for each point, or none");
  }
  for (const double radius : scene.radii) requireRadius<S>(call, radius);
}

}  // namespace fcl_fibers
