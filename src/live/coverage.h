// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "geometry/affine_map.h"
#include "geometry/box.h"
#include "geometry/rigid_fit.h"
#include "live/anchors.h"

namespace fcl_fibers::live {

/// Returns the rigid motion of most of the points, or none if they have no common one.
geometry::AffineMap commonMotion(const std::vector<geometry::MovedPoint>& points);

/// Finds out whether a list may have lost pairs. Two segments that are not listed are covered while
/// they have come nearer by at most a length, or by less than the gap between their anchors. This
/// is asked of pairs of nodes, from the root down to pairs of blocks.
class Coverage {
 public:
  /// @param q        the second side; null for the pairs within the first
  /// @param covered  how much nearer two segments may have come that are not listed
  /// @param margin   within which segments touch
  Coverage(const Anchors& p, const Anchors* q, double covered, double margin)
      : p_(p),
        q_(q != nullptr ? *q : p),
        is_one_(q == nullptr),
        covered_(covered),
        margin_(margin) {}

  /// Returns false if more pairs of nodes would have to be asked about.
  bool check(std::int64_t most);

  /// The pairs of blocks that are not covered.
  const std::vector<std::pair<std::int32_t, std::int32_t>>& uncovered() const { return uncovered_; }

  /// For each pair that is not covered, adds the block that has left its surroundings further. Each
  /// side's blocks ascend, and each is there once.
  void chooseBlocks(std::vector<std::int32_t> (&blocks)[2]) const;

  /// Bounds how much nearer any two segments have come.
  double mostOfAll() const;

 private:
  bool check(int p_level, std::int32_t i, int q_level, std::int32_t j);

  const Anchors &p_, &q_;
  const bool is_one_;
  const double covered_, margin_;
  std::int64_t left_ = 0;  ///< pairs of nodes that may still be asked about
  std::vector<std::pair<std::int32_t, std::int32_t>> uncovered_;
};

/// Calls visit(block) for the blocks whose anchors and radii may be in a box.
template <class Visit>
void visitNear(const Anchors& anchors, const geometry::Box& box, const Visit& visit) {
  const auto overlaps = [&](const geometry::Box& where) {
    bool all = true;
    for (int axis = 0; axis < 3; ++axis) {
      all &= where.low[axis] <= box.high[axis] && box.low[axis] <= where.high[axis];
    }
    return all;
  };
  const auto below = [&](auto& self, int level, std::int32_t i) -> void {
    if (!overlaps(anchors.node(level, i).where)) return;
    if (level == 0) return visit(i);
    const std::int32_t first = i * Anchors::kArity;
    const std::int32_t end = std::min(first + Anchors::kArity, anchors.nodeCount(level - 1));
    for (std::int32_t child = first; child < end; ++child) self(self, level - 1, child);
  };
  if (anchors.levelCount() > 0) below(below, anchors.levelCount() - 1, 0);
}

}  // namespace fcl_fibers::live
