// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "geometry/affine_map.h"
#include "geometry/box.h"
#include "geometry/rigid_fit.h"
#include "live/anchors.h"
#include "live/block_tree.h"

namespace fcl_fibers::live {

/// Returns the rigid motion of most of the points, or none if they have no common one.
geometry::AffineMap commonMotion(const std::vector<geometry::MovedPoint>& points);

/// One or two sets of segments and their anchors, or segments and the triangles of a mesh. If there
/// is one set, it is also the second.
struct Sides {
  int count;
  const BlockTree* anchors[2];
  bool keeps_second;  ///< whether only segments of the first side are anchored anew
  bool have_boxes;    ///< whether a segment may be a box
  /// Writes the nodes of the leaves of a block of one side.
  std::function<void(int side, std::int32_t block, BlockTree::BlockNodes& nodes)> writeNodes;
};

/// Finds out whether a list may have lost pairs. Two segments are covered while they have come
/// nearer by at most a length, or by less than the gap between their anchors, or if they are
/// listed. This is asked of pairs of nodes, from the root down to pairs of segments.
class Coverage {
 public:
  /// By side.
  using Leaves = std::array<std::vector<Leaf>, 2>;
  using Renewals = std::array<std::vector<Anchors::Renewal>, 2>;

  /// Whether a pair is listed or does not count, by segments of the first and of the second side.
  using IsListed = std::function<bool(Leaf p, Leaf q)>;

  /// @param covered  how much nearer two segments may have come that are not listed
  /// @param margin   within which segments touch
  /// @param most     how many pairs of nodes may be asked about
  Coverage(const Sides& sides, double covered, double margin, std::int64_t most, IsListed isListed);

  /// For each pair that is not covered, adds a renewal of the segment that has left its
  /// surroundings further, with the displacement of the other one. Returns false if it has asked
  /// about too many pairs.
  bool check(Renewals& renewals);

  /// Adds renewals for the pairs of segments whose anchors have just changed, in the same way.
  bool checkAround(const Leaves& changed, Renewals& renewals);

  /// Finds the pairs of segments that would not be covered if they came nearer by `wanted`. Calls
  /// take(p, q, rest) for each, where `rest` is how much nearer they may come. Returns false if it
  /// has asked about too many pairs.
  using TakeRest = std::function<void(Leaf p, Leaf q, double rest)>;
  bool findRests(double wanted, const TakeRest& take);

  std::int64_t left() const { return left_; }  ///< how many pairs may still be asked about

 private:
  struct Place {
    int level;
    std::int32_t node;
  };
  const BlockTree::Node& nodeAt(int side, const Place& place) const {
    return sides_.anchors[side]->node(place.level, place.node);
  }
  Place root(int side) const { return {sides_.anchors[side]->levelCount() - 1, 0}; }
  using TakePair =
      std::function<void(Leaf k, const BlockTree::Node& p, Leaf l, const BlockTree::Node& q)>;
  double reachOf(double distance) const;
  bool covers(const BlockTree::Node& p, const BlockTree::Node& q);
  bool visitUncovered(const TakePair& take);
  bool visitUncovered(const Place& p, const Place& q, const TakePair& take);
  void visitUncoveredOf(std::int32_t i, std::int32_t j, const TakePair& take);
  void choose(int p_side, Leaf k, const BlockTree::Node& p, int q_side, Leaf l,
              const BlockTree::Node& q, Renewals& renewals) const;
  const BlockTree::BlockNodes& nodesOf(int side, std::int32_t block);

  const Sides sides_;
  const double covered_, margin_;
  const IsListed is_listed_;
  double wanted_ = 0;  ///< how much nearer they are to be able to come
  std::int64_t left_;  ///< pairs of nodes that may still be asked about
  /// The nodes of segments of blocks that have been asked about, and where those of a block are.
  std::vector<BlockTree::BlockNodes> nodes_;
  std::vector<std::int32_t> places_[2];
};

/// Bounds how much nearer any two segments have come.
double mostApproach(const Sides& sides);

/// By how much segments that are near each other have usually come nearer, or a mesh and segments
/// within a distance.
double usualApproach(const Sides& sides, double distance);

/// Calls visit(child) for the children of a node.
template <class Visit>
void forChildren(const BlockTree& anchors, int level, std::int32_t node, const Visit& visit) {
  const std::int32_t first = node * BlockTree::kArity;
  const std::int32_t end = std::min(first + BlockTree::kArity, anchors.nodeCount(level - 1));
  for (std::int32_t child = first; child < end; ++child) visit(child);
}

/// Calls visit(block) for the blocks whose anchors and radii may be in a box.
template <class Visit>
void visitNear(const BlockTree& anchors, const geometry::Box& box, const Visit& visit) {
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
    forChildren(anchors, level, i, [&](std::int32_t child) { self(self, level - 1, child); });
  };
  if (anchors.levelCount() > 0) below(below, anchors.levelCount() - 1, 0);
}

}  // namespace fcl_fibers::live
