// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

#include "arguments.h"
#include "joined_text.h"

namespace fcl_fibers::io {

/// Throws std::invalid_argument if the scene is not as FiberPolylines requires, because files would
/// be refused, or hold other fibers.
inline void requireScene(const char* call, const FiberPolylines& scene) {
  const auto refuse = [call](const auto&... reason) {
    throw std::invalid_argument(joinedText(call, ": ", reason...));
  };
  const auto requireSize = [&](const char* name, const auto& numbers, std::size_t count,
                               const char* items) {
    if (numbers.empty() || numbers.size() == count) return;
    refuse(name, " has ", numbers.size(), " numbers for ", count, ' ', items,
           "; give one for each, or none");
  };
  const auto requirePlaces = [&](const char* name, const std::vector<std::int32_t>& at,
                                 bool are_starts) {
    requireSize(name, at, scene.fiberCount(), "fibers");
    for (std::size_t f = 0; f < at.size(); ++f) {
      const std::size_t begin = scene.point_begin[f], end = scene.point_begin[f + 1];
      const std::size_t own = are_starts ? begin : end - 1, point = static_cast<std::size_t>(at[f]);
      if (at[f] == -1) continue;
      if (begin < end && point < scene.points.size() && point != own &&
          scene.points[point] == scene.points[own]) {
        continue;
      }
      refuse(name, " of fiber ", f, " is ", at[f],
             "; give another point at the same place, or -1 for none");
    }
  };
  requireFiberRanges(call, scene);
  requireRadii<double>(call, scene);
  for (const Point& point : scene.points) {
    for (const double c : point) {
      if (!std::isfinite(c)) refuse("a coordinate is ", c, "; give a finite number");
    }
  }
  requireSize("closed", scene.closed, scene.fiberCount(), "fibers");
  requireSize("samples", scene.samples, scene.points.size(), "points");
  requireSize("types", scene.types, scene.points.size(), "points");
  requirePlaces("starts_at", scene.starts_at, true);
  requirePlaces("ends_at", scene.ends_at, false);
}

}  // namespace fcl_fibers::io
