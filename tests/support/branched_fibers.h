// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

#include "support/random.h"

namespace fcl_fibers::test {

/// Fibers that start at points of others and so form trees, and end there and so form loops. Some
/// are closed, some have one point or none. Coordinates are those of floats.
/// @param least  points of a fiber; if it is more than 1, none is without points
inline FiberPolylines branchedFibers(std::uint64_t seed, std::size_t fibers = 14,
                                     std::size_t least = 1) {
  Random random(seed);
  FiberPolylines scene;
  scene.radius = 0.05;
  const auto near = [&](const fcl_fibers::Point& p) {
    fcl_fibers::Point q;
    for (std::size_t k = 0; k < 3; ++k) {
      q[k] = static_cast<double>(static_cast<float>(p[k] + random.between(-0.1, 0.1)));
    }
    return q;
  };
  for (std::size_t f = 0; f < fibers; ++f) {
    const std::size_t begin = scene.points.size(),
                      count = f % 7 == 3 && least < 2 ? 0 : least + random.below(7);
    const auto somePoint = [&](std::size_t end) {
      return static_cast<std::int32_t>(random.below(4) == 0 && f > 0
                                           ? scene.point_begin[random.below(f)] % end
                                           : random.below(end));
    };
    const bool starts = count > 0 && begin > 0 && random.below(5) > 0;
    scene.starts_at.push_back(starts ? somePoint(begin) : -1);
    for (std::size_t i = 0; i < count; ++i) {
      scene.points.push_back(starts && i == 0 ? scene.points[std::size_t(scene.starts_at[f])]
                             : i == 0         ? near({0, 0, 0})
                                              : near(scene.points.back()));
    }
    const bool closes = count > 3 && random.below(5) == 0;
    if (closes) scene.points.back() = scene.points[begin];
    const bool ends = !closes && count > 2 && random.below(3) == 0;
    scene.ends_at.push_back(ends ? somePoint(scene.points.size() - 1) : -1);
    if (ends) scene.points.back() = scene.points[static_cast<std::size_t>(scene.ends_at[f])];
    scene.closed.push_back(closes ? 1 : 0);
    scene.point_begin.push_back(scene.points.size());
  }
  return scene;
}

/// Which segments are neighbours, each named by its first point, by Dijkstra's algorithm over all
/// points.
class BranchOracle {
 public:
  BranchOracle(const FiberPolylines& scene, int reach, double arc_length)
      : reach_(reach), arc_length_(arc_length), node_(scene.points.size()), ways_(node_.size()) {
    std::iota(node_.begin(), node_.end(), std::size_t{0});
    const auto unite = [&](std::size_t p, std::size_t q) {
      const std::size_t from = node_[p], to = node_[q];
      std::replace(node_.begin(), node_.end(), from, to);
    };
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      const std::size_t begin = scene.point_begin[f], end = scene.point_begin[f + 1];
      const auto uniteAt = [&](const std::vector<std::int32_t>& at, std::size_t own) {
        if (!at.empty() && at[f] >= 0) unite(own, static_cast<std::size_t>(at[f]));
      };
      uniteAt(scene.starts_at, begin);
      uniteAt(scene.ends_at, end - 1);
      if (scene.isClosed(f)) unite(end - 1, begin);
    }
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      for (std::size_t i = scene.point_begin[f]; i + 1 < scene.point_begin[f + 1]; ++i) {
        const fcl_fibers::Point &p = scene.points[i], &q = scene.points[i + 1];
        const double length = std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
        ways_[node_[i]].push_back({node_[i + 1], length});
        ways_[node_[i + 1]].push_back({node_[i], length});
      }
    }
    for (std::size_t i = 0; i < node_.size(); ++i) {
      by_number_.push_back(distancesFrom(i, [](double) { return 1.0; }));
      by_length_.push_back(distancesFrom(i, [](double length) { return length; }));
    }
  }

  bool areNeighbors(std::size_t a, std::size_t b) const {
    const auto least = [&](const std::vector<std::vector<double>>& distances) {
      return std::min(
          {distances[a][b], distances[a][b + 1], distances[a + 1][b], distances[a + 1][b + 1]});
    };
    return (reach_ > 0 && least(by_number_) + 1 <= reach_) ||
           (arc_length_ > 0 && least(by_length_) <= arc_length_);
  }

 private:
  template <class LengthOf>
  std::vector<double> distancesFrom(std::size_t point, LengthOf&& lengthOf) const {
    std::vector<double> found(node_.size(), std::numeric_limits<double>::infinity());
    using Reached = std::pair<double, std::size_t>;
    std::priority_queue<Reached, std::vector<Reached>, std::greater<Reached>> reached;
    reached.emplace(0, node_[point]);
    while (!reached.empty()) {
      const auto [distance, node] = reached.top();
      reached.pop();
      if (found[node] <= distance) continue;
      found[node] = distance;
      for (const auto& [next, length] : ways_[node]) {
        reached.emplace(distance + lengthOf(length), next);
      }
    }
    std::vector<double> by_point;
    for (const std::size_t node : node_) by_point.push_back(found[node]);
    return by_point;
  }

  int reach_;
  double arc_length_;
  std::vector<std::size_t> node_;  ///< by point
  std::vector<std::vector<std::pair<std::size_t, double>>> ways_;
  std::vector<std::vector<double>> by_number_, by_length_;
};

}  // namespace fcl_fibers::test
