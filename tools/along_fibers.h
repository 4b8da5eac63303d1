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

/// How near two segments of a fiber are along it, the shorter way if it is closed.
struct NearAlong {
  std::size_t numbers_apart;  ///< 1 for adjacent segments
  double length_between;      ///< of the fiber
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

  /// How near two segments of a fiber are along it.
  NearAlong near(std::size_t fiber, SegmentPair pair) const {
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    return mostApart(fiber, {a, a}, {b, b});
  }

  /// How far a segment of `a` and a later one of `b` are at most apart along a fiber.
  NearAlong mostApart(std::size_t fiber, SegmentRange a, SegmentRange b) const {
    const NearAlong inside{b.last - a.first, from_start_[b.last] - from_start_[a.first + 1]};
    if (!scene_.isClosed(fiber)) return inside;
    const std::size_t end = scene_.point_begin[fiber + 1] - 1;
    const NearAlong around{end - b.first + a.last - scene_.point_begin[fiber],
                           from_start_[end] - from_start_[b.first + 1] + from_start_[a.last]};
    return {std::min(inside.numbers_apart, around.numbers_apart),
            std::min(inside.length_between, around.length_between)};
  }

 private:
  const FiberPolylines& scene_;
  std::vector<double> from_start_;  ///< by point
};

}  // namespace fcl_fibers::tools
