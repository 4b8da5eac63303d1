// SPDX-License-Identifier: BSD-3-Clause
#if defined(FCL_FIBERS_TREE_TRAVERSAL_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_TREE_TRAVERSAL_INL_H
#undef FCL_FIBERS_TREE_TRAVERSAL_INL_H
#else
#define FCL_FIBERS_TREE_TRAVERSAL_INL_H
#endif

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/frame.h"
#include "geometry/lanes-inl.h"
#include "geometry/overlap-inl.h"
#include "geometry/rounding.h"
#include "tree/work.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

// A query is what a traversal asks at every step:
//
//   Visit forEachAdmitted(pack, volume, lanes, unit, visit)
//     calls visit(lane) for those of the lanes that a pair with `volume` may be found in, in the
//     order it likes best, and stops when told to. `unit` is the length of the pack's frame in the
//     query's.
//   Visit leafPair(SegmentId a, SegmentId b)   for visitPairs
//   Visit leaf(SegmentId a)                    for visitLeaves
//
// The two kinds of admission follow; a query derives from one of them. A query of visitPairs that
// sets kCuts does not see the pairs below two links of which it says so, but gets them in one
// piece, to be visited later or elsewhere:
//
//   bool cuts(std::int32_t a_leaves, std::int32_t b_leaves)   how many leaves are below each
//   Visit work(const Work&)
//
// Whom a segment may meet for its group's sake is the affair of one of the two below, chosen before
// a traversal starts.

/// In a tree without groups, and between two trees.
struct AllMeet {
  /// The children of a node that a segment below a slot may meet; bits beyond its children are set.
  FCL_FIBERS_ALWAYS_INLINE geometry::LaneMask lanes(std::int32_t /*slot*/,
                                                    std::int32_t /*node*/) const {
    return ~geometry::LaneMask{0};
  }
  /// Whether segments below a slot may meet each other.
  FCL_FIBERS_ALWAYS_INLINE bool within(std::int32_t /*slot*/) const { return true; }
};

/// In a tree with groups: all but those of which all segments are of one and the same.
template <int Arity>
class OtherGroupsMeet {
 public:
  explicit OtherGroupsMeet(const std::vector<Group>& by_slot) : by_slot_(by_slot.data()) {}

  FCL_FIBERS_ALWAYS_INLINE geometry::LaneMask lanes(std::int32_t slot, std::int32_t node) const {
    return lanesOf(by_slot_[slot], node);
  }
  FCL_FIBERS_ALWAYS_INLINE bool within(std::int32_t slot) const {
    return by_slot_[slot] == kNoGroup;
  }
  FCL_FIBERS_ALWAYS_INLINE geometry::LaneMask lanesOf(Group group, std::int32_t node) const {
    if (group == kNoGroup) return ~geometry::LaneMask{0};
    return ~geometry::HWY_NAMESPACE::lanesEqual<Arity>(by_slot_ + Arity * node, group);
  }

 private:
  const Group* by_slot_;
};

/// Admits volumes that overlap.
struct OverlapAdmission {
  static constexpr bool kCuts = false;

  template <class Pack, class Volume, class F>
  FCL_FIBERS_ALWAYS_INLINE Visit forEachAdmitted(const Pack& pack, const Volume& volume,
                                                 geometry::LaneMask lanes, double /*unit*/,
                                                 F&& visit) {
    using geometry::HWY_NAMESPACE::overlaps;
    for (auto rest = overlaps(pack, volume) & lanes; rest != 0; rest &= rest - 1) {
      if (visit(__builtin_ctz(rest)) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }
};

/// Admits volumes nearer than a limit, which may shrink as pairs are found; the nearest first.
struct NearestAdmission {
  static constexpr bool kCuts = false;
  double limit;  ///< in the frame of the query

  template <int N, template <int> class Pack, class Volume, class F>
  FCL_FIBERS_ALWAYS_INLINE Visit forEachAdmitted(const Pack<N>& pack, const Volume& volume,
                                                 geometry::LaneMask lanes, double unit, F&& visit) {
    using geometry::HWY_NAMESPACE::nearer;
    float distance[N];
    std::array<int, N> nearest_first;
    int count = 0;
    for (auto rest = nearer(pack, volume, geometry::roundedUp(limit / unit), distance) & lanes;
         rest != 0; rest &= rest - 1) {
      const int lane = __builtin_ctz(rest);
      int place = count++;
      for (; place > 0 &&
             distance[nearest_first[static_cast<std::size_t>(place - 1)]] > distance[lane];
           --place) {
        nearest_first[static_cast<std::size_t>(place)] =
            nearest_first[static_cast<std::size_t>(place - 1)];
      }
      nearest_first[static_cast<std::size_t>(place)] = lane;
    }
    for (int i = 0; i < count; ++i) {
      const int lane = nearest_first[static_cast<std::size_t>(i)];
      // Where the limit is infinite the product may be, too.
      if (!(distance[lane] * unit < limit) && std::isfinite(limit)) break;
      if (visit(lane) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }
};

namespace internal {

/// Pairs of a segment of tree A and one of tree B, which may be the same.
template <class TreeA, class TreeB, class Query, class BToA, class AToB, class Meet>
class PairTraversal {
  static constexpr bool kCuts = Query::kCuts;

 public:
  PairTraversal(const TreeA& a, const TreeB& b, const BToA& b_to_a, const AToB& a_to_b, Meet meet,
                Query& query)
      : a_(a), b_(b), b_to_a_(b_to_a), a_to_b_(a_to_b), meet_(meet), query_(query) {}

  /// What a query was handed in one piece.
  Visit resume(const Work& work) {
    if (work.node != Work::kBetween) return within(work.node);
    return meet(Child<TreeA>::of(a_, work.a_slot), Child<TreeB>::of(b_, work.b_slot));
  }
  Visit meet(const Child<TreeA>& a, const Child<TreeB>& b) {
    if (!a.link.isLeaf() || !b.link.isLeaf()) return between(a, b);
    return query_.leafPair(a.link.segment(), b.link.segment());
  }

  /// All unordered pairs below a node of A, each once.
  Visit within(std::int32_t node) {
    if constexpr (kCuts) {
      const std::int32_t leaves = leafCount(a_, Link::node(node));
      if (query_.cuts(leaves, leaves)) return query_.work(Work{node, 0, 0});
    }
    const auto& pack = a_.pack(node);
    const int count = a_.node(node).child_count;
    for (int lane = 0; lane < count; ++lane) {
      const auto child = Child<TreeA>::of(a_, node, lane);
      if (!child.link.isLeaf() && meet_.within(child.slot) &&
          within(child.link.node()) == Visit::kStop) {
        return Visit::kStop;
      }
      const auto later = geometry::firstLanes(count) & ~geometry::firstLanes(lane + 1) &
                         meet_.lanes(child.slot, node);
      if (query_.forEachAdmitted(pack, child.volume, later, 1, [&](int other) HWY_ATTR {
            return meetInB(child, node, other);
          }) == Visit::kStop) {
        return Visit::kStop;
      }
    }
    return Visit::kContinue;
  }

  /// All pairs below a child in A and a child in B. The larger of the two is opened (Sobottka,
  /// Varnik and Weber, section 2), against the whole of the other. Of two wide nodes of like size
  /// both are, which comes to the same tests without a decision in between.
  /// @pre not both are leaves
  Visit between(const Child<TreeA>& a, const Child<TreeB>& b) {
    if constexpr (kCuts) {
      if (query_.cuts(leafCount(a_, a.link), leafCount(b_, b.link))) {
        return query_.work(Work{Work::kBetween, a.slot, b.slot});
      }
    }
    const auto& b_in_a = b_to_a_(b.volume);
    if (a.link.isLeaf()) return betweenChildrenOfB(a, b.link.node());
    if (b.link.isLeaf()) return betweenChildrenOfA(a.link.node(), b, b_in_a);

    const float a_size = a.volume.size(), b_size = b_in_a.size();
    constexpr float kLikeSize = 4;
    if (TreeA::kArity > 2 && a_size <= kLikeSize * b_size && b_size <= kLikeSize * a_size) {
      return betweenChildrenOfBoth(a.link.node(), b, b_in_a);
    }
    return a_size >= b_size ? betweenChildrenOfA(a.link.node(), b, b_in_a)
                            : betweenChildrenOfB(a, b.link.node());
  }

  FCL_FIBERS_ALWAYS_INLINE Visit betweenChildrenOfA(std::int32_t node, const Child<TreeB>& b,
                                                    const typename TreeA::Volume& b_in_a) {
    const auto lanes = geometry::firstLanes(a_.node(node).child_count) & meet_.lanes(b.slot, node);
    return query_.forEachAdmitted(a_.pack(node), b_in_a, lanes, 1,
                                  [&](int lane) HWY_ATTR { return meetInA(node, lane, b); });
  }
  FCL_FIBERS_ALWAYS_INLINE Visit betweenChildrenOfB(const Child<TreeA>& a, std::int32_t node) {
    const auto lanes = geometry::firstLanes(b_.node(node).child_count) & meet_.lanes(a.slot, node);
    return query_.forEachAdmitted(b_.pack(node), a_to_b_(a.volume), lanes, b_to_a_.scale(),
                                  [&](int lane) HWY_ATTR { return meetInB(a, node, lane); });
  }
  Visit betweenChildrenOfBoth(std::int32_t a_node, const Child<TreeB>& b,
                              const typename TreeA::Volume& b_in_a) {
    const auto lanes =
        geometry::firstLanes(a_.node(a_node).child_count) & meet_.lanes(b.slot, a_node);
    return query_.forEachAdmitted(a_.pack(a_node), b_in_a, lanes, 1, [&](int lane) HWY_ATTR {
      return betweenChildrenOfB(Child<TreeA>::of(a_, a_node, lane), b.link.node());
    });
  }

  // Most pairs end here, as leaves, whose volumes are not needed any more.
  FCL_FIBERS_ALWAYS_INLINE Visit meetInA(std::int32_t a_node, int lane, const Child<TreeB>& b) {
    const Link a = a_.node(a_node).children[static_cast<std::size_t>(lane)];
    if (!kCuts && a.isLeaf() && b.link.isLeaf())
      return query_.leafPair(a.segment(), b.link.segment());
    return between(Child<TreeA>::of(a_, a_node, lane), b);
  }
  FCL_FIBERS_ALWAYS_INLINE Visit meetInB(const Child<TreeA>& a, std::int32_t b_node, int lane) {
    const Link b = b_.node(b_node).children[static_cast<std::size_t>(lane)];
    if (!kCuts && a.link.isLeaf() && b.isLeaf())
      return query_.leafPair(a.link.segment(), b.segment());
    return between(a, Child<TreeB>::of(b_, b_node, lane));
  }

 private:
  const TreeA& a_;
  const TreeB& b_;
  const BToA& b_to_a_;
  const AToB& a_to_b_;
  const Meet meet_;
  Query& query_;
};

/// Calls visit(meet) with whom the segments of a tree may meet.
template <class Tree, class F>
FCL_FIBERS_ALWAYS_INLINE Visit withGroups(const Tree& tree, F&& visit) {
  const auto& groups = tree.topology().groups;
  return groups.empty() ? visit(AllMeet()) : visit(OtherGroupsMeet<Tree::kArity>(groups));
}

/// @param lanes  lanes(node): the children of a node that are visited at all
template <class Tree, class Query, class Lanes>
Visit leavesBelow(const Tree& tree, std::int32_t node, const typename Tree::Volume& volume,
                  const Lanes& lanes, Query& query) {
  return query.forEachAdmitted(
      tree.pack(node), volume, geometry::firstLanes(tree.node(node).child_count) & lanes(node), 1,
      [&](int lane) HWY_ATTR {
        const Link child = tree.node(node).children[static_cast<std::size_t>(lane)];
        return child.isLeaf() ? query.leaf(child.segment())
                              : leavesBelow(tree, child.node(), volume, lanes, query);
      });
}

}  // namespace internal

/// Each unordered pair of a tree's segments that the query admits, once, except those of one
/// group.
template <class Tree, class Query>
Visit visitPairs(const Tree& tree, Query& query) {
  if (tree.empty()) return Visit::kContinue;
  return internal::withGroups(tree, [&](auto meet) HWY_ATTR {
    using geometry::SameFrame;
    static constexpr SameFrame kSame;
    return internal::PairTraversal<Tree, Tree, Query, SameFrame, SameFrame, decltype(meet)>(
               tree, tree, kSame, kSame, meet, query)
        .within(0);
  });
}

/// Each pair of a segment of `a` and one of `b` that the query admits, once. The query's frame is
/// that of `a`.
template <class Tree, class Query>
Visit visitPairs(const Tree& a, const Tree& b, const geometry::FrameChange& b_to_a,
                 const geometry::FrameChange& a_to_b, Query& query) {
  if (a.empty() || b.empty()) return Visit::kContinue;
  using geometry::FrameChange;
  internal::PairTraversal<Tree, Tree, Query, FrameChange, FrameChange, AllMeet> pairs(
      a, b, b_to_a, a_to_b, AllMeet(), query);
  // Roots have no volume of their own, so the children of b's root are the start.
  for (int lane = 0; lane < b.node(0).child_count; ++lane) {
    const auto child = Child<Tree>::of(b, 0, lane);
    if (pairs.betweenChildrenOfA(0, child, b_to_a(child.volume)) == Visit::kStop) {
      return Visit::kStop;
    }
  }
  return Visit::kContinue;
}

/// Each segment that the query admits against one volume, once, except those of `group`.
template <class Tree, class Query>
Visit visitLeaves(const Tree& tree, const typename Tree::Volume& volume, Query& query,
                  Group group = kNoGroup) {
  if (tree.empty()) return Visit::kContinue;
  if (group == kNoGroup || tree.topology().groups.empty()) {
    const auto all = [](std::int32_t) HWY_ATTR { return ~geometry::LaneMask{0}; };
    return internal::leavesBelow(tree, 0, volume, all, query);
  }
  const OtherGroupsMeet<Tree::kArity> meet(tree.topology().groups);
  const auto others = [&](std::int32_t node) HWY_ATTR { return meet.lanesOf(group, node); };
  return internal::leavesBelow(tree, 0, volume, others, query);
}

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
