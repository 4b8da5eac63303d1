// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <fcl_fibers/tree_export.h>

#include "fibers/neighbor_rule.h"

namespace fcl_fibers::fibers {

/// A point of a fiber: where segment `number` begins, or where the last segment ends.
struct FiberPoint {
  std::uint32_t fiber;  ///< its number in the table, which stays the same
  SegmentId number;
};

/// Two points of fibers that are one.
using Joint = std::pair<FiberPoint, FiberPoint>;

/// Which segments are neighbours because their fibers are joined. Between two segments counts the
/// shortest path along the fibers, so fibers may form trees and loops.
///
/// It keeps the distances from each joint to some others, its hubs, and none to all others. The
/// shortest path between two joints runs through a hub of both (Akiba, Iwata and Yoshida, Fast
/// exact shortest-path distance queries on large networks by pruned landmark labeling, 2013). A
/// thousand fibers that meet in one point have one hub.
class JointGraph {
 public:
  /// How far along a fiber a point is: in segments, and by length, which is 0 if the rule has no
  /// arc length.
  using Way = std::array<double, 2>;
  struct Place {
    std::size_t fiber;  ///< its position in the table
    Way way;
  };

  /// @param joined    2 k and 2 k + 1 are one point
  /// @param id_count  of the table
  FCL_FIBERS_TREE_EXPORT JointGraph(const NeighborRule& rule, const std::vector<Place>& joined,
                                    SegmentId id_count);

  /// All joined points, in the order of fibers and along each, without repetition.
  const std::vector<Place>& places() const { return places_; }

  /// Has areNeighbors() know the segment between two points of a fiber with joined points.
  /// @param next  of places(): the first one that is not before the segment's end
  FCL_FIBERS_TREE_EXPORT void add(SegmentId id, const Place& from, const Place& to,
                                  std::size_t next);

  /// Whether the rule excludes the pair by a path that leaves the fiber of each.
  /// @pre a < b
  bool areNeighbors(SegmentId a, SegmentId b) const {
    // What was added to the table since is not joined.
    if (static_cast<std::size_t>(b) >= near_.size()) return false;
    const std::int32_t p = near_[static_cast<std::size_t>(a)],
                       q = near_[static_cast<std::size_t>(b)];
    return (p | q) >= 0 &&
           areNear(exits_[static_cast<std::size_t>(p)], exits_[static_cast<std::size_t>(q)]);
  }

  FCL_FIBERS_TREE_EXPORT std::size_t memoryUsage() const;

 private:
  using Node = std::uint32_t;  ///< all places that are one point: the first of them

  /// The nodes before and after a segment, and the ways there from its ends, which are infinite
  /// where there is none.
  struct Exits {
    Node node[2];
    Way way[2];
  };
  FCL_FIBERS_TREE_EXPORT bool areNear(const Exits& a, const Exits& b) const;

  /// A node and how far it is. Of a hub this is its rank in place of the node.
  struct Label {
    Node node;
    double distance;
  };
  using Labels = std::vector<Label>;  ///< ascending
  static bool areWithin(const Labels& p, const Labels& q, double most);
  static std::vector<Labels> hubs(const std::vector<Labels>& edges, double most);

  Way most_;  ///< between neighbours, and negative for what does not count
  std::vector<Place> places_;
  std::vector<Node> nodes_;                  ///< by place
  std::array<std::vector<Labels>, 2> hubs_;  ///< by node; empty if only one node may be between
  std::vector<std::int32_t> near_;           ///< by id: its place in exits_, or -1
  std::vector<Exits> exits_;
};

}  // namespace fcl_fibers::fibers
