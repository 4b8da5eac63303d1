// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>
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
    const bool has_branches = !scene.starts_at.empty() || !scene.ends_at.empty();
    const auto join = [&](std::size_t p, std::size_t q) {
      joints_.emplace_back(p, q);
      joints_.emplace_back(q, p);
    };
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      for (std::size_t i = scene.point_begin[f] + 1; i < scene.point_begin[f + 1]; ++i) {
        const Point &p = scene.points[i - 1], &q = scene.points[i];
        from_start_[i] = from_start_[i - 1] + std::hypot(q[0] - p[0], q[1] - p[1], q[2] - p[2]);
      }
      if (!has_branches || scene.point_begin[f] == scene.point_begin[f + 1]) continue;
      const std::size_t first = scene.point_begin[f], last = scene.point_begin[f + 1] - 1;
      const auto joinAt = [&](const std::vector<std::int32_t>& places, std::size_t end) {
        if (!places.empty() && places[f] >= 0) join(end, static_cast<std::size_t>(places[f]));
      };
      joinAt(scene.starts_at, first);
      joinAt(scene.ends_at, last);
      if (scene.isClosed(f)) join(first, last);
    }
    std::sort(joints_.begin(), joints_.end());
  }

  /// Returns whether fibers start or end at others.
  bool hasBranches() const { return !joints_.empty(); }

  /// How near two segments are along fibers that start or end at each other, by the shortest way
  /// that is no longer than `most_length` or of no more segments than `most_apart`, if there is
  /// one.
  std::optional<NearAlong> nearAcross(SegmentPair pair, double most_length,
                                      std::size_t most_apart) const {
    using Way = std::tuple<double, std::size_t, std::size_t>;  // its length, segments, and its end
    std::priority_queue<Way, std::vector<Way>, std::greater<>> ways;
    std::map<std::size_t, std::size_t> been;  // by point: the fewest segments so far
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    ways.emplace(0, 1, a);
    ways.emplace(0, 1, a + 1);
    while (!ways.empty()) {
      const auto [length, numbers, point] = ways.top();
      ways.pop();
      if (length > most_length && numbers > most_apart) continue;
      if (point == b || point == b + 1) return NearAlong{numbers, length};
      const auto [before, is_new] = been.try_emplace(point, numbers);
      if (!is_new && before->second <= numbers) continue;
      before->second = numbers;
      const auto [first, last] =
          std::equal_range(joints_.begin(), joints_.end(), Joint(point, 0),
                           [](const Joint& p, const Joint& q) { return p.first < q.first; });
      for (auto joint = first; joint != last; ++joint) ways.emplace(length, numbers, joint->second);
      const auto next =
          std::upper_bound(scene_.point_begin.begin(), scene_.point_begin.end(), point);
      if (point + 1 < *next) {
        ways.emplace(length + from_start_[point + 1] - from_start_[point], numbers + 1, point + 1);
      }
      if (point > *(next - 1)) {
        ways.emplace(length + from_start_[point] - from_start_[point - 1], numbers + 1, point - 1);
      }
    }
    return std::nullopt;
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
  using Joint = std::pair<std::size_t, std::size_t>;

  const FiberPolylines& scene_;
  std::vector<Joint> joints_;       ///< points of two fibers that are one, both ways, ascending
  std::vector<double> from_start_;  ///< by point
};

}  // namespace fcl_fibers::tools
