// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
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

/// Checks that no coordinate is NaN or beyond a limit.
inline void requireCoordinates(const char* call, const FiberPolylines& scene, double limit,
                               const char* remedy) {
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    for (const double coordinate : scene.points[i]) {
      if (std::fabs(coordinate) <= limit) continue;
      refuseArgument(call, joinedText("a coordinate of point ", i).c_str(), coordinate, remedy);
    }
  }
}

/// Checks that there are as many numbers as items, or none.
template <class Numbers>
void requireCount(const char* call, const char* name, const Numbers& numbers, std::size_t count,
                  const char* item) {
  if (numbers.empty() || numbers.size() == count) return;
  refuseArgument(call, joinedText("the number of ", name).c_str(), numbers.size(),
                 joinedText("give one for each ", item, ", or none").c_str());
}

/// Checks that starts_at and ends_at are as FiberPolylines requires.
/// @pre requireFiberRanges()
inline void requireBranches(const char* call, const FiberPolylines& scene) {
  const auto require = [&](const char* name, const std::vector<std::int32_t>& at, bool are_starts) {
    requireCount(call, name, at, scene.fiberCount(), "fiber");
    for (std::size_t f = 0; f < at.size(); ++f) {
      const std::size_t begin = scene.point_begin[f], end = scene.point_begin[f + 1];
      const std::size_t own = are_starts ? begin : end - 1, point = static_cast<std::size_t>(at[f]);
      const bool is_right =
          at[f] == -1 || (begin < end && point < scene.points.size() && point != own &&
                          scene.points[point] == scene.points[own]);
      if (is_right) continue;
      refuseArgument(call, joinedText(name, " of fiber ", f).c_str(), at[f],
                     "give another point at the same place, or -1 for none");
    }
  };
  require("starts_at", scene.starts_at, true);
  require("ends_at", scene.ends_at, false);
}

/// Checks that all radii are finite in S and not negative, and that their number is right.
template <typename S>
void requireRadii(const char* call, const FiberPolylines& scene) {
  requireRadius<S>(call, scene.radius);
  requireCount(call, "radii", scene.radii, scene.points.size(), "point");
  for (const double radius : scene.radii) requireRadius<S>(call, radius);
}

}  // namespace fcl_fibers
