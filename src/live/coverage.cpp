// SPDX-License-Identifier: BSD-3-Clause
#include "live/coverage.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fcl_fibers::live {
namespace {

using geometry::AffineMap;
using geometry::Box;
using geometry::MovedPoint;
using geometry::Vec3d;

/// Makes up for the rounding of the few operations behind it.
constexpr double kOutward = 1 + 64 * std::numeric_limits<double>::epsilon();

/// Bounds how much nearer a segment of p and one of q have come. NaN counts as infinity.
double approachOf(const Anchors::Node& p, const Anchors::Node& q) {
  double squared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = std::max(double{p.moved.high[axis]} - double{q.moved.low[axis]},
                              double{q.moved.high[axis]} - double{p.moved.low[axis]});
    squared += d * d;
  }
  const double approach = (std::sqrt(squared) + double{p.growth} + double{q.growth}) * kOutward;
  return approach >= 0 ? approach : std::numeric_limits<double>::infinity();
}

/// Whether two nodes are further apart than this. A box that is around everything is not.
bool areFurtherApart(const Box& p, const Box& q, double distance) {
  double squared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double gap = std::max({double{p.low[axis]} - double{q.high[axis]},
                                 double{q.low[axis]} - double{p.high[axis]}, 0.0});
    squared += gap * gap;
  }
  return squared > distance * distance * kOutward;
}

/// The mean distance of the points from where a motion takes them, apart from what is common to
/// all.
double restOf(const std::vector<MovedPoint>& points, const AffineMap& motion) {
  const double count = static_cast<double>(points.size());
  Vec3d mean{0, 0, 0};
  for (const MovedPoint& p : points) mean = mean + (1 / count) * (p.after - motion(p.before));
  double rest = 0;
  for (const MovedPoint& p : points) rest += norm(p.after - motion(p.before) - mean) / count;
  return rest;
}

}  // namespace

AffineMap commonMotion(const std::vector<MovedPoint>& points) {
  // To follow a turn costs time for every point, so it has to leave much less of the displacements.
  constexpr double kWorth = 0.7;
  const AffineMap fit = rigidFit(points), none;
  return restOf(points, fit) < kWorth * restOf(points, none) ? fit : none;
}

bool Coverage::check(std::int64_t most) {
  left_ = most;
  uncovered_.clear();
  if (p_.levelCount() == 0 || q_.levelCount() == 0) return true;
  return check(p_.levelCount() - 1, 0, q_.levelCount() - 1, 0);
}

bool Coverage::check(int p_level, std::int32_t i, int q_level, std::int32_t j) {
  if (--left_ < 0) return false;
  const Anchors::Node &p = p_.node(p_level, i), &q = q_.node(q_level, j);
  const double approach = approachOf(p, q);
  if (approach <= covered_ || areFurtherApart(p.where, q.where, approach + margin_)) return true;
  if (p_level == 0 && q_level == 0) {
    uncovered_.emplace_back(i, j);
    return true;
  }
  const bool splits_p = p_level >= q_level, splits_q = q_level >= p_level;
  const auto childrenOf = [](const Anchors& anchors, int level, std::int32_t node, bool splits) {
    const std::int32_t first = node * Anchors::kArity;
    return splits
               ? std::pair(first, std::min(first + Anchors::kArity, anchors.nodeCount(level - 1)))
               : std::pair(node, node + 1);
  };
  const auto [p_begin, p_end] = childrenOf(p_, p_level, i, splits_p);
  const auto [q_begin, q_end] = childrenOf(q_, q_level, j, splits_q);
  const bool is_one = is_one_ && i == j;
  for (std::int32_t k = p_begin; k < p_end; ++k) {
    for (std::int32_t l = is_one ? k : q_begin; l < q_end; ++l) {
      if (!check(p_level - (splits_p ? 1 : 0), k, q_level - (splits_q ? 1 : 0), l)) return false;
    }
  }
  return true;
}

void Coverage::chooseBlocks(std::vector<std::int32_t> (&blocks)[2]) const {
  for (const auto& [i, j] : uncovered_) {
    if (p_.deviationOf(i) >= q_.deviationOf(j)) {
      blocks[0].push_back(i);
    } else {
      blocks[is_one_ ? 0 : 1].push_back(j);
    }
  }
  for (std::vector<std::int32_t>& side : blocks) {
    std::sort(side.begin(), side.end());
    side.erase(std::unique(side.begin(), side.end()), side.end());
  }
}

double Coverage::mostOfAll() const {
  if (p_.levelCount() == 0 || q_.levelCount() == 0) return 0;
  return approachOf(p_.node(p_.levelCount() - 1, 0), q_.node(q_.levelCount() - 1, 0));
}

}  // namespace fcl_fibers::live
