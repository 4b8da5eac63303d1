// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::io {

/// Returns the radius at each point. If the scene has radii of segments, a point gets the larger
/// one of its two segments, so that no segment becomes thinner.
inline std::vector<double> pointRadii(const FiberPolylines& scene) {
  if (scene.radii.empty()) return std::vector<double>(scene.points.size(), scene.radius);
  std::vector<double> radii = scene.radii;
  if (scene.hasRadiiOfPoints()) return radii;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t begin = scene.point_begin[f], last = begin + scene.segmentCount(f);
    if (last == begin) continue;
    radii[last] = scene.radii[last - 1];
    for (std::size_t i = begin + 1; i < last; ++i) {
      radii[i] = std::max(scene.radii[i - 1], scene.radii[i]);
    }
    if (scene.isClosed(f)) radii[begin] = radii[last] = std::max(radii[begin], radii[last]);
  }
  return radii;
}

}  // namespace fcl_fibers::io
