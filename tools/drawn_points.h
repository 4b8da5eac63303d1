// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::tools {

/// Which fibers and points of a scene are drawn: every nth fiber, and on it every mth point and the
/// last.
struct Thinning {
  std::size_t fiber_step = 1;
  std::size_t point_step = 1;

  /// Drops points before fibers, as long as a fiber keeps fifty points.
  static Thinning forScene(const FiberPolylines& scene, std::size_t most_points);

  /// Calls visit(fiber, indices of its points that are drawn).
  template <typename Visit>
  void forEachFiber(const FiberPolylines& scene, Visit&& visit) const {
    std::vector<std::size_t> points;
    for (std::size_t f = 0; f < scene.fiberCount(); f += fiber_step) {
      points.clear();
      const std::size_t end = scene.point_begin[f + 1];
      for (std::size_t i = scene.point_begin[f]; i + 1 < end; i += point_step) points.push_back(i);
      if (end > scene.point_begin[f]) points.push_back(end - 1);
      visit(f, points);
    }
  }

  /// `every 2nd fiber drawn`; empty if all is drawn.
  std::string text() const;
};

/// Coordinates as 16-bit steps about a middle.
struct Steps {
  Point middle{};
  Point size{};
  double step = 0;

  explicit Steps(const std::vector<const std::vector<Point>*>& frames);
};

// What is drawn as base64, point after point.

std::string pointsText(const FiberPolylines& scene, const Thinning& thinning, const Steps& steps);

/// The radius of all points, or `radii` of each point.
std::string radiiText(const FiberPolylines& scene, const Thinning& thinning);

/// One bit for each point, least significant first: whether the line drawn from it touches.
/// @param touching  by the first point of a segment: 1 if it touches
std::string touchingText(const FiberPolylines& scene, const Thinning& thinning,
                         const std::vector<unsigned char>& touching);

}  // namespace fcl_fibers::tools
