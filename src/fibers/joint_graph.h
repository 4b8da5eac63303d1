// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <fcl_fibers/tree_export.h>

#include "fibers/neighbor_rule.h"

namespace fcl_fibers::fibers {

/// A point of a fiber: where segment `number` begins, or where the last segment ends.
struct FiberPoint {
  std::uint32_t fiber;  ///< its position in the table
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
  /// A point of a fiber, and how far along the fiber it is.
  struct Place {
    FiberPoint point;
    double arc;  ///< 0 if the rule has no arc length
  };

  /// @param joined    2 k and 2 k + 1 are one point
  /// @param id_count  of the table
  FCL_FIBERS_TREE_EXPORT JointGraph(const NeighborRule& rule, const std::vector<Place>& joined,
                                    SegmentId id_count);

  /// All joined points, in the order of fibers and along each, without repetition.
  const std::vector<Place>& places() const { return places_; }

  /// Has areNeighbors() know a segment. It has to, if one of the places is within the rule's reach
  /// along the fiber.
  /// @param number  of the segment, from `from` to `to` along the fiber
  /// @param before  the place before the segment; null if its fiber has none there
  /// @param after   the place after it, as above
  FCL_FIBERS_TREE_EXPORT void addNear(SegmentId id, const Place& from, const Place& to,
                                      const Place* before, const Place* after);

  /// Whether the rule excludes the pair by a path that leaves the fiber of each.
  /// @pre a < b
  bool areNeighbors(SegmentId a, SegmentId b) const {
    // What was added to the table since is not joined.
    if (static_cast<std::size_t>(b) >= near_.size()) return false;
    const std::int32_t p = near_[static_cast<std::size_t>(a)],
                       q = near_[static_cast<std::size_t>(b)];
    if ((p | q) < 0) return false;
    const Exits &x = exits_[static_cast<std::size_t>(p)], &y = exits_[static_cast<std::size_t>(q)];
    bool share_point = false;
    for (const int i : {0, 1}) {
      for (const int k : {0, 1}) {
        share_point |= (x.node[i] == y.node[k]) & (x.segments[i] + y.segments[k] < rule_.reach);
      }
    }
    return share_point || (goes_beyond_ && areNear(x, y));
  }

  FCL_FIBERS_TREE_EXPORT std::size_t memoryUsage() const;

 private:
  using Node = std::int32_t;  ///< all places that are one point

  /// The nodes before and after a segment, and the ways there from its ends.
  struct Exits {
    Node node[2];
    SegmentId segments[2];
    double length[2];
  };
  FCL_FIBERS_TREE_EXPORT bool areNear(const Exits& a, const Exits& b) const;

  /// The distances of nodes, as far as the limit.
  class Distances {
   public:
    /// Finds them all. distanceOf(p, q) is that of two consecutive places of a fiber.
    template <class DistanceOf>
    void find(const JointGraph& graph, double limit, DistanceOf&& distanceOf);
    bool areWithin(Node p, Node q, double most) const;
    std::size_t memoryUsage() const {
      return begin_.capacity() * sizeof(std::size_t) + labels_.capacity() * sizeof(Label);
    }

   private:
    struct Label {
      Node hub;  ///< its rank
      double distance;
    };
    static bool areWithin(const Label* p, const Label* p_end, const Label* q, const Label* q_end,
                          double most);

    std::vector<std::size_t> begin_;  ///< by node, and the end
    std::vector<Label> labels_;       ///< by node, then by hub
  };

  NeighborRule rule_;
  std::vector<Place> places_;
  std::vector<Node> nodes_;  ///< by place
  Node node_count_ = 0;
  bool goes_beyond_;  ///< whether segments may be neighbours that are next to no common node
  Distances by_number_, by_length_;
  std::vector<std::int32_t> near_;  ///< by id: its place in exits_, or -1
  std::vector<Exits> exits_;
};

}  // namespace fcl_fibers::fibers
