// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/segment.h"

namespace fcl_fibers::tree {

/// A segment's number among all segments of a scene.
using SegmentId = std::int32_t;

/// Segments of one group are not paired with one another.
using Group = std::int32_t;
constexpr Group kNoGroup = 0;

/// The fibers of a scene: fiber f consists of the segments ids[begin[f]], ..., ids[begin[f + 1] -
/// 1], in their order along it.
struct Fibers {
  std::vector<SegmentId> ids;
  std::vector<std::int32_t> begin = {0};
  std::vector<Group> groups;  ///< by fiber; empty if none has one

  void endFiber() { begin.push_back(static_cast<std::int32_t>(ids.size())); }
};

/// What a node points at: a further node, or a segment (a leaf).
class Link {
 public:
  static Link node(std::int32_t index) { return Link(index); }
  static Link leaf(SegmentId id) { return Link(~id); }

  bool isLeaf() const { return value_ < 0; }
  std::int32_t node() const { return value_; }
  SegmentId segment() const { return ~value_; }

 private:
  explicit Link(std::int32_t value) : value_(value) {}
  std::int32_t value_;
};

/// A tree without geometry. Motion leaves it as it is; only registering and unregistering change
/// it.
///
/// Invariants:
/// * the root is node 0, and children come after their parent, so one backward sweep refits all;
/// * the segments below a node are a contiguous range of `leaves`, and a node's children share it
///   out among them in order;
/// * every segment is the child of one node; every node has at least one child, and every node but
///   the root at least two.
template <int Arity>
struct Topology {
  struct Node {
    std::array<Link, static_cast<std::size_t>(Arity)> children;
    std::int32_t child_count;
    std::int32_t leaf_begin, leaf_end;  ///< the segments below, as a range of `leaves`

    /// The children as numbers: of a node, or ~segment.
    const std::int32_t* links() const {
      static_assert(sizeof(Link) == sizeof(std::int32_t));
      return reinterpret_cast<const std::int32_t*>(children.data());
    }
    std::int32_t leafCount() const { return leaf_end - leaf_begin; }
    /// Every child has a segment at least.
    bool hasOnlyLeaves() const { return leafCount() == child_count; }
  };

  std::vector<Node> nodes;        ///< empty if there are no segments
  std::vector<SegmentId> leaves;  ///< all segments, depth first

  /// By slot, which is Arity times the node plus the child's number: the group that all segments
  /// of the child have, or kNoGroup if they have none or not the same. Empty if no fiber has one.
  std::vector<Group> groups;
};

/// The super thread of Sobottka, Varnik and Weber, section 3.2: the fibers in the order given,
/// every other one backward, so that consecutive fibers are joined tip to tip and root to root;
/// over this one long chain a balanced binary tree.
Topology<2> superThread(const Fibers& fibers);

/// A node is a block: a set of fibers over a range along each of them. It is split where it is
/// longer: the range in about half, or the set near the median of its fibers across, so that nodes
/// fill. Inside one fiber that is the chain-aligned tree; over fibers of one segment a kd-tree.
/// @param segments  by id, in any frame
Topology<8> bundle(const Fibers& fibers, const std::vector<geometry::Segment>& segments);

}  // namespace fcl_fibers::tree
