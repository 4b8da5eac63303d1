// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::tools {

/// Consecutive segments of a fiber, by the points at which the first and the last of them start.
struct SegmentRange {
  std::size_t first, last;
};

/// Lengths along the fibers of a scene, which has to outlive this.
class AlongFibers {
 public:
  explicit AlongFibers(const FiberPolylines& scene)
      : scene_(scene), from_start_(scene.points.size()) {
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      for (std::size_t i = scene.point_begin[f] + 1; i < scene.point_begin[f + 1]; ++i) {
        const Point &p = scene.points[i - 1], &q = scene.points[i];
        from_start_[i] = from_start_[i - 1] + std::hypot(q[0] - p[0], q[1] - p[1], q[2] - p[2]);
      }
    }
  }

  /// How much of the fiber is between two of its segments, the shorter way if it is closed.
  double between(std::size_t fiber, SegmentPair pair) const {
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    return mostBetween(fiber, {a, a}, {b, b});
  }

  /// How much of the fiber is at most between a segment of `a` and a later one of `b`, likewise.
  double mostBetween(std::size_t fiber, SegmentRange a, SegmentRange b) const {
    const double inside = from_start_[b.last] - from_start_[a.first + 1];
    if (!scene_.isClosed(fiber)) return inside;
    const double whole = from_start_[scene_.point_begin[fiber + 1] - 1];
    return std::min(inside, whole - from_start_[b.first + 1] + from_start_[a.last]);
  }

 private:
  const FiberPolylines& scene_;
  std::vector<double> from_start_;  ///< by point
};

}  // namespace fcl_fibers::tools
