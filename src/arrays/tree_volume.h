// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <variant>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "geometry/frame.h"
#include "index/segment_index.h"
#include "tree/volumes.h"

namespace fcl_fibers::arrays {

/// Rounds outward. Division by the scale, a power of two, is exact.
inline TreeVolume toWorld(const geometry::Box& box, const geometry::Frame& frame) {
  TreeVolume volume;
  const double origin[3] = {frame.origin.x, frame.origin.y, frame.origin.z};
  for (int k = 0; k < 3; ++k) {
    const double low = std::nextafter(double{box.low[k]} / frame.scale + origin[k],
                                      -std::numeric_limits<double>::infinity());
    const double high = std::nextafter(double{box.high[k]} / frame.scale + origin[k],
                                       std::numeric_limits<double>::infinity());
    volume.center[k] = low + (high - low) / 2;
    volume.half[k] = std::nextafter(std::max(high - volume.center[k], volume.center[k] - low),
                                    std::numeric_limits<double>::infinity());
  }
  return volume;
}

inline TreeVolume toWorld(const geometry::Sphere& sphere, const geometry::Frame& frame) {
  TreeVolume volume;
  volume.kind = FiberTreeOptions::Volumes::kWrappedSpheres;
  const double origin[3] = {frame.origin.x, frame.origin.y, frame.origin.z};
  // By how much rounding moves the centre: half an ulp on each axis, and room for the sum.
  double moved = 0;
  for (int k = 0; k < 3; ++k) {
    volume.center[k] = double{sphere.center[k]} / frame.scale + origin[k];
    moved += std::numeric_limits<double>::epsilon() * std::fabs(volume.center[k]);
  }
  const double radius = std::nextafter(double{sphere.radius} / frame.scale + moved,
                                       std::numeric_limits<double>::infinity());
  std::fill_n(volume.half, 3, radius);
  return volume;
}

inline std::vector<TreeVolume> volumesOf(const index::SegmentIndex& index, int depth) {
  std::vector<TreeVolume> volumes;
  const auto add = [&](const auto& volume, std::int32_t begin, std::int32_t end) {
    volumes.push_back(toWorld(volume, index.frame()));
    volumes.back().segments = index.leaves().data() + begin;
    volumes.back().segment_count = static_cast<std::size_t>(end - begin);
  };
  std::visit([&](const auto& tree) { visitVolumes(tree, depth, add); }, index.tree());
  return volumes;
}

}  // namespace fcl_fibers::arrays
