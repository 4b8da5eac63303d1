// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::io {

// Files hold radii by point, and trees take them by segment. A segment gets the larger radius of
// its ends, so that it is never thinner than the fiber.

/// Returns the radii by segment that follow from those by point.
inline std::vector<double> segmentRadii(const FiberPolylines& scene, std::vector<double> radii) {
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    for (std::size_t i = scene.point_begin[f]; i + 1 < scene.point_begin[f + 1]; ++i) {
      radii[i] = std::max(radii[i], radii[i + 1]);
    }
  }
  return radii;
}

/// Whether two ends of a segment have different radii.
inline bool differAlongFibers(const FiberPolylines& scene, const std::vector<double>& radii) {
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    for (std::size_t i = scene.point_begin[f]; i + 1 < scene.point_begin[f + 1]; ++i) {
      if (radii[i] != radii[i + 1]) return true;
    }
  }
  return false;
}

/// Whether the segments have the radii that follow from `point_radii`, which a program may have
/// left as they were when it changed the others.
inline bool hasPointRadii(const FiberPolylines& scene) {
  const std::vector<double>& given = scene.point_radii;
  if (given.empty() || given.size() != scene.points.size()) return false;
  // NaN is no radius either.
  if (!std::all_of(given.begin(), given.end(), [](double r) { return r >= 0; })) return false;
  const std::vector<double> radii = segmentRadii(scene, given);
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t begin = scene.point_begin[f], last = scene.point_begin[f + 1] - 1;
    // The radius of a lone point counts, too, and that of a fiber's last point does not.
    for (std::size_t i = begin; i < std::max(last, begin + 1); ++i) {
      if (radii[i] != scene.radiusAt(i)) return false;
    }
  }
  return true;
}

/// Returns radii by point from which setPointRadii() restores the scene's radii: those that a file
/// had, if the scene has them. Without them that is impossible if a segment is thicker than both of
/// its neighbors: the segment before it becomes as thick.
inline std::vector<double> pointRadii(const FiberPolylines& scene) {
  if (hasPointRadii(scene)) return scene.point_radii;
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

/// @param radii  by point of the scene, which has none yet
inline void setPointRadii(FiberPolylines& scene, std::vector<double> radii) {
  if (std::adjacent_find(radii.begin(), radii.end(), std::not_equal_to<>()) == radii.end()) {
    if (!radii.empty()) scene.radius = radii.front();
    return;
  }
  if (!differAlongFibers(scene, radii)) {
    scene.radii = std::move(radii);
    return;
  }
  scene.radii = segmentRadii(scene, radii);
  scene.point_radii = std::move(radii);
}

}  // namespace fcl_fibers::io
