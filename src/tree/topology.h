// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "geometry/segment.h"
#include "geometry/segment_block.h"
#include "parallel/unwritten.h"

namespace fcl_fibers::tree {

/// The number of a segment in an index.
using SegmentId = std::int32_t;
using SegmentIds = parallel::UnwrittenVector<SegmentId>;

/// The segments of one group are not paired with one another.
using Group = std::int32_t;
constexpr Group kNoGroup = 0;

/// The categories that a segment or an obstacle has and those that it meets, a bit each.
struct Categories {
  std::uint32_t own = ~std::uint32_t{0}, met = ~std::uint32_t{0};

  /// Two meet if each has a category that the other one meets.
  bool meet(const Categories& other) const {
    return (own & other.met) != 0 && (other.own & met) != 0;
  }
  bool operator==(const Categories& other) const { return own == other.own && met == other.met; }
  bool operator!=(const Categories& other) const { return !(*this == other); }
  Categories operator|(const Categories& other) const { return {own | other.own, met | other.met}; }
};
constexpr Categories kAllCategories = {};
constexpr Categories kNoCategories = {0, 0};

/// Fibers over the segments of an index. Fiber f consists of the segments ids[begin[f]], ...,
/// ids[begin[f + 1] - 1], in their order along it.
struct Fibers {
  SegmentIds ids;
  std::vector<std::int32_t> begin = {0};
  std::vector<Group> groups;  ///< by fiber; empty if no fiber has a group

  /// By position in `ids`: which meshes the segment may meet. Empty if every segment may meet every
  /// mesh.
  parallel::UnwrittenVector<Categories> meets;

  void endFiber() { begin.push_back(static_cast<std::int32_t>(ids.size())); }
};

/// A link from a node to a child: another node, or a segment (a leaf).
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

/// A tree without geometry. Motion does not change it; only building does.
///
/// Invariants:
/// * The root is node 0, and children come after their parent, so one backward sweep refits all.
/// * The segments below a node are a contiguous range of `leaves`, which its children divide in
///   order.
/// * Every segment is the child of one node. Every node has at least one child, and every node
///   except the root at least two.
template <int Arity>
struct Topology {
  static constexpr int kArity = Arity;

  struct Node {
    static constexpr int kArity = Arity;

    std::array<Link, static_cast<std::size_t>(Arity)> children;
    std::int32_t child_count;
    std::int32_t leaf_begin, leaf_end;  ///< the segments below, as a range of `leaves`

    /// The children as numbers: the index of a node, or ~segment.
    const std::int32_t* links() const {
      static_assert(sizeof(Link) == sizeof(std::int32_t));
      return reinterpret_cast<const std::int32_t*>(children.data());
    }
    /// A node without children.
    static Node of(std::int32_t leaf_begin, std::int32_t leaf_count) {
      return {unlinked(std::make_index_sequence<Arity>{}), 0, leaf_begin, leaf_begin + leaf_count};
    }

    std::int32_t leafCount() const { return leaf_end - leaf_begin; }
    /// Every child has at least one segment below it.
    bool hasOnlyLeaves() const { return leafCount() == child_count; }

   private:
    template <std::size_t... I>
    static std::array<Link, Arity> unlinked(std::index_sequence<I...>) {
      return {((void)I, Link::node(0))...};
    }
  };

  std::vector<Node> nodes;  ///< empty if there are no segments
  SegmentIds leaves;        ///< all segments, depth first

  /// By slot, which is Arity times the node plus the lane of the child: the group that all segments
  /// of the child share, or kNoGroup. Empty if no fiber has a group.
  parallel::UnwrittenVector<Group> groups;
  /// By slot: all categories of the segments of the child. Empty if every segment may meet every
  /// mesh.
  parallel::UnwrittenVector<Categories> meets;
};

/// A topology that several threads have built: the nodes near the root, and the subtrees below
/// them. In the whole, the nodes near the root come first, and then those of part after part. The
/// parts are in the order of their leaves.
template <int Arity>
struct TopologyParts {
  using Node = typename Topology<Arity>::Node;

  struct Part {
    Topology<Arity>
        subtree;  ///< counts nodes and leaves from 0 on, and has no groups or categories
    std::int32_t node_begin, leaf_begin;  ///< where the subtree is in the whole

    /// A node of the subtree as it is in the whole.
    Node nodeOfWhole(std::size_t i) const {
      Node node = subtree.nodes[i];
      for (int lane = 0; lane < node.child_count; ++lane) {
        Link& child = node.children[static_cast<std::size_t>(lane)];
        if (!child.isLeaf()) child = Link::node(child.node() + node_begin);
      }
      node.leaf_begin += leaf_begin;
      node.leaf_end += leaf_begin;
      return node;
    }
  };

  std::size_t nodeCount() const {
    return parts.empty() ? top.size()
                         : static_cast<std::size_t>(parts.back().node_begin) +
                               parts.back().subtree.nodes.size();
  }
  std::size_t leafCount() const {
    return top.empty() ? (parts.empty() ? 0 : parts.front().subtree.leaves.size())
                       : static_cast<std::size_t>(top.front().leaf_end);
  }

  void link(std::int32_t parent, std::size_t lane, Link child) {
    top[static_cast<std::size_t>(parent)].children[lane] = child;
  }

  std::vector<Node> top;  ///< as in the whole, level after level
  std::vector<Part> parts;
};

/// A point. It only decides where a build splits, and floats are precise enough for that.
using Middle = std::array<float, 3>;

/// The midpoint of a segment. A box that is unbounded on a side counts as one at the origin.
Middle middleOf(const geometry::Segment& segment);
/// The midpoints of the first `count` segments of a block.
void middlesOf(const geometry::SegmentBlock& segments, int count, Middle* out);

/// The super thread of Sobottka, Varnik and Weber, 2005, section 3.2: the fibers in the order
/// given, every other one backward, so that consecutive fibers are joined tip to tip and root to
/// root. The tree over this one long chain is balanced and binary.
Topology<2> superThread(const Fibers& fibers);

}  // namespace fcl_fibers::tree
