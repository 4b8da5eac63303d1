// SPDX-License-Identifier: BSD-3-Clause
#if defined(FCL_FIBERS_TREE_TRAVERSAL_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_TREE_TRAVERSAL_INL_H
#undef FCL_FIBERS_TREE_TRAVERSAL_INL_H
#else
#define FCL_FIBERS_TREE_TRAVERSAL_INL_H
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "geometry/frame.h"
#include "geometry/overlap-inl.h"
#include "geometry/rounding.h"
#include "simd/lanes-inl.h"
#include "tree/pairing_rules-inl.h"
#include "tree/traversal_task.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

// A query decides at every step what a traversal visits:
//
//   Visit forEachPassing(pack, volume, lanes, unit, visit)
//     calls visit(lane), in any order, for those of the lanes in which a pair with `volume` may be
//     found, and stops when `visit` returns kStop. `unit` is the length of the pack's unit in the
//     query's frame.
//   Visit leafPair(SegmentId a, SegmentId b)   for visitPairs
//   Visit leaf(SegmentId a)                    for visitLeaves
//
// The two tests follow; a query derives from one of them. If a query of visitPairs sets
// kNearestFirst, pairs of the children of two nodes are visited in the order of their distances. If
// it sets kSplits, it gets the pairs below two links as one task, to be visited later or elsewhere,
// whenever isTask() is true of them:
//
//   bool isTask(std::int32_t a_leaves, std::int32_t b_leaves)   the numbers of leaves below
//   Visit addTask(const TraversalTask&)
//

struct OverlapTest {
  static constexpr bool kSplits = false;
  static constexpr bool kNearestFirst = false;

  template <class Pack, class Volume, class F>
  FCL_FIBERS_ALWAYS_INLINE Visit forEachPassing(const Pack& pack, const Volume& volume,
                                                simd::LaneMask lanes, double /*unit*/, F&& visit) {
    using geometry::HWY_NAMESPACE::overlaps;
    for (auto rest = overlaps(pack, volume) & lanes; rest != 0; rest &= rest - 1) {
      if (visit(__builtin_ctz(rest)) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }
};

/// Passes volumes nearer than a limit, which may shrink as pairs are found, the nearest first.
struct DistanceTest {
  static constexpr bool kSplits = false;
  static constexpr bool kNearestFirst = true;
  double limit;  ///< in the frame of the query

  /// At most kMost places, each with a distance in the unit of one pack.
  template <std::size_t kMost>
  class Places {
   public:
    FCL_FIBERS_ALWAYS_INLINE void add(float distance, int place) {
      std::uint32_t bits;  // have the order of the distances, because these are not negative
      std::memcpy(&bits, &distance, sizeof(bits));
      const std::uint64_t key = std::uint64_t{bits} << 32 | static_cast<std::uint32_t>(place);
      std::size_t at = count_++;
      if constexpr (kIsSmall) {
        for (; at > 0 && key < keys_[at - 1]; --at) keys_[at] = keys_[at - 1];
      }
      keys_[at] = key;
    }
    /// Calls visit(place), the nearest first, as long as they are nearer than the limit.
    template <class F>
    Visit visitNearestFirst(const DistanceTest& test, double unit, F&& visit) {
      if constexpr (!kIsSmall) std::sort(keys_.data(), keys_.data() + count_);
      for (std::size_t i = 0; i < count_; ++i) {
        const auto bits = static_cast<std::uint32_t>(keys_[i] >> 32);
        float distance;
        std::memcpy(&distance, &bits, sizeof(bits));
        // If the limit is infinite, the product may be infinite too.
        if (!(distance * unit < test.limit) && std::isfinite(test.limit)) break;
        const auto place = static_cast<std::uint32_t>(keys_[i]);
        if (visit(static_cast<int>(place)) == Visit::kStop) return Visit::kStop;
      }
      return Visit::kContinue;
    }

   private:
    /// There are few, and keeping them in order takes less than sorting them.
    static constexpr bool kIsSmall = kMost <= 16;
    std::array<std::uint64_t, kMost> keys_;
    std::size_t count_ = 0;
  };

  /// Calls add(lane, distance) for those of the lanes that may be nearer than the limit.
  template <int N, template <int> class Pack, class Volume, class F>
  FCL_FIBERS_ALWAYS_INLINE void forEachNearer(const Pack<N>& pack, const Volume& volume,
                                              simd::LaneMask lanes, double unit, F&& add) const {
    using geometry::HWY_NAMESPACE::nearer;
    float distance[N];
    for (auto rest = nearer(pack, volume, geometry::roundedUp(limit / unit), distance) & lanes;
         rest != 0; rest &= rest - 1) {
      const int lane = __builtin_ctz(rest);
      add(lane, distance[lane]);
    }
  }

  template <int N, template <int> class Pack, class Volume, class F>
  FCL_FIBERS_ALWAYS_INLINE Visit forEachPassing(const Pack<N>& pack, const Volume& volume,
                                                simd::LaneMask lanes, double unit, F&& visit) {
    Places<N> nearest;
    forEachNearer(pack, volume, lanes, unit,
                  [&](int lane, float distance) HWY_ATTR { nearest.add(distance, lane); });
    return nearest.visitNearestFirst(*this, unit, visit);
  }
};

namespace internal {

/// Visits pairs of a segment of tree A and one of tree B, which may be the same tree.
template <class TreeA, class TreeB, class Query, class BToA, class AToB, class GroupFilter>
class PairTraversal {
  static constexpr bool kSplits = Query::kSplits;

 public:
  PairTraversal(const TreeA& a, const TreeB& b, const BToA& b_to_a, const AToB& a_to_b,
                GroupFilter filter, Query& query)
      : a_(a), b_(b), b_to_a_(b_to_a), a_to_b_(a_to_b), filter_(filter), query_(query) {}

  Visit run(const TraversalTask& task) {
    if (task.node != TraversalTask::kCross) return visitSelf(task.node);
    return visitPair(Child<TreeA>::of(a_, task.a_slot), Child<TreeB>::of(b_, task.b_slot));
  }
  Visit visitPair(const Child<TreeA>& a, const Child<TreeB>& b) {
    if (!a.link.isLeaf() || !b.link.isLeaf()) return visitCross(a, b);
    return query_.leafPair(a.link.segment(), b.link.segment());
  }

  /// Visits all unordered pairs below a node of A once.
  Visit visitSelf(std::int32_t node) {
    if constexpr (kSplits) {
      const std::int32_t leaves = leafCount(a_, Link::node(node));
      if (query_.isTask(leaves, leaves)) return query_.addTask(TraversalTask{node, 0, 0});
    }
    const auto& pack = a_.pack(node);
    const int count = a_.node(node).child_count;
    if constexpr (Query::kNearestFirst) {
      for (int lane = 0; lane < count; ++lane) {
        const auto child = Child<TreeA>::of(a_, node, lane);
        if (!child.link.isLeaf() && filter_.passesSelf(child.slot) &&
            visitSelf(child.link.node()) == Visit::kStop) {
          return Visit::kStop;
        }
      }
      return crossNearestFirst(node, simd::firstLanes(count), node,
                               [](int lane) HWY_ATTR { return ~simd::firstLanes(lane + 1); });
    }
    for (int lane = 0; lane < count; ++lane) {
      const auto child = Child<TreeA>::of(a_, node, lane);
      if (!child.link.isLeaf() && filter_.passesSelf(child.slot) &&
          visitSelf(child.link.node()) == Visit::kStop) {
        return Visit::kStop;
      }
      const auto later = simd::firstLanes(count) & ~simd::firstLanes(lane + 1) &
                         filter_.lanesOfB(child.slot, node);
      if (query_.forEachPassing(pack, child.volume, later, 1, [&](int other) HWY_ATTR {
            return visitInB(child, node, other);
          }) == Visit::kStop) {
        return Visit::kStop;
      }
    }
    return Visit::kContinue;
  }

  /// Visits all pairs below a child in A and a child in B. The larger of the two is opened
  /// (Sobottka, Varnik and Weber, 2005, section 2), against the whole of the other. Two wide nodes
  /// of similar size are both opened, which makes the same tests without a decision in between.
  /// @pre not both are leaves
  Visit visitCross(const Child<TreeA>& a, const Child<TreeB>& b) {
    if constexpr (kSplits) {
      if (query_.isTask(leafCount(a_, a.link), leafCount(b_, b.link))) {
        return query_.addTask(TraversalTask{TraversalTask::kCross, a.slot, b.slot});
      }
    }
    const auto& b_in_a = b_to_a_(b.volume);
    if (a.link.isLeaf()) return crossChildrenOfB(a, b.link.node());
    if (b.link.isLeaf()) return crossChildrenOfA(a.link.node(), b, b_in_a);

    const float a_size = a.volume.size(), b_size = b_in_a.size();
    constexpr float kLikeSize = 4;
    if (TreeA::kArity > 2 && a_size <= kLikeSize * b_size && b_size <= kLikeSize * a_size) {
      return crossChildrenOfBoth(a.link.node(), b, b_in_a);
    }
    return a_size >= b_size ? crossChildrenOfA(a.link.node(), b, b_in_a)
                            : crossChildrenOfB(a, b.link.node());
  }

  /// Visits all pairs below children of a node in A and of a node in B, the nearest children first.
  /// @param lanesOfB  lanesOfB(lane of A): which children of B are paired with it
  template <class LanesOfB>
  Visit crossNearestFirst(std::int32_t a_node, simd::LaneMask a_lanes, std::int32_t b_node,
                          LanesOfB&& lanesOfB) {
    constexpr auto kA = static_cast<std::size_t>(TreeA::kArity);
    constexpr auto kB = static_cast<std::size_t>(TreeB::kArity);
    typename Query::template Places<kA * kB> nearest;
    const double unit = b_to_a_.scale();
    for (auto rest = a_lanes; rest != 0; rest &= rest - 1) {
      const int lane = __builtin_ctz(rest);
      const auto child = Child<TreeA>::of(a_, a_node, lane);
      const auto lanes = simd::firstLanes(b_.node(b_node).child_count) & lanesOfB(lane) &
                         filter_.lanesOfB(child.slot, b_node);
      query_.forEachNearer(b_.pack(b_node), inB(child), lanes, unit,
                           [&](int other, float distance)
                               HWY_ATTR { nearest.add(distance, lane * TreeB::kArity + other); });
    }
    return nearest.visitNearestFirst(query_, unit, [&](int place) HWY_ATTR {
      return visitInB(Child<TreeA>::of(a_, a_node, place / TreeB::kArity), b_node,
                      place % TreeB::kArity);
    });
  }

  FCL_FIBERS_ALWAYS_INLINE Visit crossChildrenOfA(std::int32_t node, const Child<TreeB>& b,
                                                  const typename TreeA::Volume& b_in_a) {
    const auto lanes = simd::firstLanes(a_.node(node).child_count) & filter_.lanesOfA(b.slot, node);
    return query_.forEachPassing(a_.pack(node), b_in_a, lanes, 1,
                                 [&](int lane) HWY_ATTR { return visitInA(node, lane, b); });
  }
  FCL_FIBERS_ALWAYS_INLINE Visit crossChildrenOfB(const Child<TreeA>& a, std::int32_t node) {
    const auto lanes = simd::firstLanes(b_.node(node).child_count) & filter_.lanesOfB(a.slot, node);
    return query_.forEachPassing(b_.pack(node), inB(a), lanes, b_to_a_.scale(),
                                 [&](int lane) HWY_ATTR { return visitInB(a, node, lane); });
  }
  Visit crossChildrenOfBoth(std::int32_t a_node, const Child<TreeB>& b,
                            const typename TreeA::Volume& b_in_a) {
    const auto lanes =
        simd::firstLanes(a_.node(a_node).child_count) & filter_.lanesOfA(b.slot, a_node);
    if constexpr (Query::kNearestFirst) {
      simd::LaneMask near = 0;
      query_.forEachNearer(a_.pack(a_node), b_in_a, lanes, 1,
                           [&](int lane, float) HWY_ATTR { near |= simd::LaneMask{1} << lane; });
      return crossNearestFirst(a_node, near, b.link.node(),
                               [](int) HWY_ATTR { return ~simd::LaneMask{0}; });
    }
    return query_.forEachPassing(a_.pack(a_node), b_in_a, lanes, 1, [&](int lane) HWY_ATTR {
      return crossChildrenOfB(Child<TreeA>::of(a_, a_node, lane), b.link.node());
    });
  }

  /// The volume of a child in A, in B's frame.
  FCL_FIBERS_ALWAYS_INLINE decltype(auto) inB(const Child<TreeA>& a) const {
    if (a.link.isLeaf()) return a_to_b_.ofLeaf(a.link.segment(), a.volume);
    return a_to_b_(a.volume);
  }

  // Most pairs end here as leaves, whose volumes are no longer needed.
  FCL_FIBERS_ALWAYS_INLINE Visit visitInA(std::int32_t a_node, int lane, const Child<TreeB>& b) {
    const Link a = a_.node(a_node).children[static_cast<std::size_t>(lane)];
    if (!kSplits && a.isLeaf() && b.link.isLeaf())
      return query_.leafPair(a.segment(), b.link.segment());
    return visitCross(Child<TreeA>::of(a_, a_node, lane), b);
  }
  FCL_FIBERS_ALWAYS_INLINE Visit visitInB(const Child<TreeA>& a, std::int32_t b_node, int lane) {
    const Link b = b_.node(b_node).children[static_cast<std::size_t>(lane)];
    if (!kSplits && a.link.isLeaf() && b.isLeaf())
      return query_.leafPair(a.link.segment(), b.segment());
    return visitCross(a, Child<TreeB>::of(b_, b_node, lane));
  }

 private:
  const TreeA& a_;
  const TreeB& b_;
  const BToA& b_to_a_;
  const AToB& a_to_b_;
  const GroupFilter filter_;
  Query& query_;
};

/// Calls visit(filter) with the group filter of a tree.
template <class Tree, class F>
FCL_FIBERS_ALWAYS_INLINE Visit withGroups(const Tree& tree, F&& visit) {
  const auto& groups = tree.groups();
  return groups.empty() ? visit(AllGroups()) : visit(OtherGroups<Tree::kArity>(groups));
}

template <class Tree, class Query, class GroupFilter>
auto selfPairs(const Tree& tree, GroupFilter filter, Query& query) {
  static constexpr geometry::SameFrame kSame;
  return PairTraversal<Tree, Tree, Query, geometry::SameFrame, geometry::SameFrame, GroupFilter>(
      tree, tree, kSame, kSame, filter, query);
}

/// @param lanes  lanes(node): the children of a node that are tested
template <class Tree, class Query, class Lanes>
Visit leavesBelow(const Tree& tree, std::int32_t node, const typename Tree::Volume& volume,
                  const Lanes& lanes, Query& query) {
  return query.forEachPassing(
      tree.pack(node), volume, simd::firstLanes(tree.node(node).child_count) & lanes(node), 1,
      [&](int lane) HWY_ATTR {
        const Link child = tree.node(node).children[static_cast<std::size_t>(lane)];
        return child.isLeaf() ? query.leaf(child.segment())
                              : leavesBelow(tree, child.node(), volume, lanes, query);
      });
}

}  // namespace internal

/// Visits each unordered pair of a tree's segments that passes the query's test once, except pairs
/// of one group.
template <class Tree, class Query>
Visit visitPairs(const Tree& tree, Query& query) {
  if (tree.empty()) return Visit::kContinue;
  return internal::withGroups(tree, [&](auto filter) HWY_ATTR {
    return internal::selfPairs(tree, filter, query).visitSelf(0);
  });
}

/// Visits each pair of a leaf of `a` and one of `b` that passes the filter and the query's test
/// once. The query's frame is that of `a`.
template <class TreeA, class TreeB, class BToA, class AToB, class Filter, class Query>
Visit visitPairs(const TreeA& a, const TreeB& b, const BToA& b_to_a, const AToB& a_to_b,
                 Filter filter, Query& query) {
  if (a.empty() || b.empty()) return Visit::kContinue;
  internal::PairTraversal<TreeA, TreeB, Query, BToA, AToB, Filter> pairs(a, b, b_to_a, a_to_b,
                                                                         filter, query);
  if constexpr (Query::kNearestFirst) {
    const auto lanes = simd::firstLanes(a.node(0).child_count) & filter.lanesOfA(0, 0);
    return pairs.crossNearestFirst(0, lanes, 0, [](int) HWY_ATTR { return ~simd::LaneMask{0}; });
  }
  // The root's volume is in no pack, so the traversal starts with the children of b's root.
  for (int lane = 0; lane < b.node(0).child_count; ++lane) {
    const auto child = Child<TreeB>::of(b, 0, lane);
    if (pairs.crossChildrenOfA(0, child, b_to_a(child.volume)) == Visit::kStop) {
      return Visit::kStop;
    }
  }
  return Visit::kContinue;
}

/// Visits each segment that passes the query's test against one volume once, except those of
/// `group`.
template <class Tree, class Query>
Visit visitLeaves(const Tree& tree, const typename Tree::Volume& volume, Query& query,
                  Group group = kNoGroup) {
  if (tree.empty()) return Visit::kContinue;
  if (group == kNoGroup || tree.groups().empty()) {
    const auto all = [](std::int32_t) HWY_ATTR { return ~simd::LaneMask{0}; };
    return internal::leavesBelow(tree, 0, volume, all, query);
  }
  const OtherGroups<Tree::kArity> filter(tree.groups());
  const auto others = [&](std::int32_t node) HWY_ATTR { return filter.lanesOf(group, node); };
  return internal::leavesBelow(tree, 0, volume, others, query);
}

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
