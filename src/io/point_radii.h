// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::io {

// Files hold radii by point, FiberPolylines by segment. A segment gets the larger radius of its
// ends, so that it is never thinner than the fiber.

/// Returns radii by point from which setPointRadii() restores the scene's radii. That is impossible
/// if a segment is thicker than both of its neighbours: the segment before it becomes as thick.
inline std::vector<double> pointRadii(const FiberPolylines& scene) {
  if (scene.radii.empty()) return std::vector<double>(scene.points.size(), scene.radius);
  std::vector<double> radii = scene.radii;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t begin = scene.point_begin[f], last = scene.point_begin[f + 1] - 1;
    for (std::size_t i = begin + 1; i <= last; ++i) {
      radii[i] = std::min(scene.radii[i - 1], scene.radii[i]);
    }
    for (std::size_t i = begin; i < last; ++i) {
      if (std::max(radii[i], radii[i + 1]) < scene.radii[i]) radii[i] = scene.radii[i];
    }
  }
  return radii;
}

/// @param radii  by point of the scene
inline void setPointRadii(FiberPolylines& scene, std::vector<double> radii) {
  if (std::adjacent_find(radii.begin(), radii.end(), std::not_equal_to<>()) == radii.end()) {
    if (!radii.empty()) scene.radius = radii.front();
    return;
  }
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    for (std::size_t i = scene.point_begin[f]; i + 1 < scene.point_begin[f + 1]; ++i) {
      radii[i] = std::max(radii[i], radii[i + 1]);
    }
  }
  scene.radii = std::move(radii);
}

}  // namespace fcl_fibers::io
