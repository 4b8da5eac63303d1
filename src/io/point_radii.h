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

/// Calls visit(i, j) for the points of each segment, and for a lone point with it and itself.
template <typename Visit>
void forSegments(const FiberPolylines& scene, Visit&& visit) {
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t begin = scene.point_begin[f], end = scene.point_begin[f + 1];
    if (begin + 1 == end) visit(begin, begin);
    for (std::size_t i = begin; i + 1 < end; ++i) visit(i, i + 1);
  }
}

/// Whether the segments have the radii that follow from `point_radii`, which a program may have
/// left as they were when it changed the others.
inline bool hasPointRadii(const FiberPolylines& scene) {
  const std::vector<double>& given = scene.point_radii;
  if (given.empty() || given.size() != scene.points.size()) return false;
  // NaN is no radius either.
  bool has = std::all_of(given.begin(), given.end(), [](double r) { return r >= 0; });
  forSegments(scene, [&](std::size_t i, std::size_t j) {
    has = has && std::max(given[i], given[j]) == scene.radiusAt(i);
  });
  return has;
}

/// Returns radii by point from which setPointRadii() restores the scene's radii: those that a file
/// had, if the scene has them. Without them that is impossible if a segment is thicker than both of
/// its neighbors: the segment before it becomes as thick.
inline std::vector<double> pointRadii(const FiberPolylines& scene) {
  if (hasPointRadii(scene)) return scene.point_radii;
  if (scene.radii.empty()) return std::vector<double>(scene.points.size(), scene.radius);
  std::vector<double> radii = scene.radii;
  forSegments(scene, [&](std::size_t i, std::size_t j) {
    radii[j] = std::min(scene.radii[i], scene.radii[j]);
  });
  forSegments(scene, [&](std::size_t i, std::size_t j) {
    if (std::max(radii[i], radii[j]) < scene.radii[i]) radii[i] = scene.radii[i];
  });
  return radii;
}

/// @param radii  by point of the scene, which has none yet
inline void setPointRadii(FiberPolylines& scene, std::vector<double> radii) {
  if (std::adjacent_find(radii.begin(), radii.end(), std::not_equal_to<>()) == radii.end()) {
    if (!radii.empty()) scene.radius = radii.front();
    return;
  }
  bool differ_along_fibers = false;
  scene.radii = radii;
  forSegments(scene, [&](std::size_t i, std::size_t j) {
    differ_along_fibers = differ_along_fibers || radii[i] != radii[j];
    scene.radii[i] = std::max(radii[i], radii[j]);
  });
  if (differ_along_fibers) scene.point_radii = std::move(radii);
}

}  // namespace fcl_fibers::io
