// SPDX-License-Identifier: BSD-3-Clause
#if defined(FCL_FIBERS_TREE_TRAVERSAL_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_TREE_TRAVERSAL_INL_H
#undef FCL_FIBERS_TREE_TRAVERSAL_INL_H
#else
#define FCL_FIBERS_TREE_TRAVERSAL_INL_H
#endif

#include <cstddef>
#include <cstdint>

#include "geometry/volume-inl.h"
#include "simd/lanes-inl.h"
#include "tree/pairing-inl.h"
#include "tree/search.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

// A query decides at every step what a traversal visits:
//
//   Visit forEachPassing(pack, frame, volume, lanes, visit)
//     calls visit(lane), in any order, for those of the lanes in which a pair with `volume` may be
//     found, and stops when `visit` returns kStop. `frame` is that of the pack and of the volume.
//   Visit leafPair(SegmentId a, SegmentId b)   for pairs; a query that splits has none
//   Visit leaf(SegmentId a)                    for visitLeaves
//
// If a query of pairs sets kNearestFirst, pairs of the children of two nodes are visited in the
// order of their distances. Such a query also has:
//
//   template <int kMost> Places      room for at most so many pairs of children
//   void addNearer(pack, frame, volume, lanes, first, places)
//     adds the places first + lane of those of the lanes that may be nearer than the limit
//   Visit visitNearestFirst(places, frame, visit)
//     calls visit(place), the nearest one first, as long as they are nearer than the limit
//
// If a query sets kSplits, it gets the pairs below two links as one task, to be visited later or
// elsewhere, whenever isTask() is true of them:
//
//   bool isTask(std::int32_t a_leaves, std::int32_t b_leaves)   the numbers of leaves below
//   Visit addTask(const TraversalTask&)

/// One of the two frames of a traversal.
enum class FrameOf { kA, kB };

/// Passes volumes that overlap.
struct OverlapTest {
  static constexpr bool kSplits = false;
  static constexpr bool kNearestFirst = false;

  template <class Pack, class Volume, class F>
  FCL_FIBERS_ALWAYS_INLINE Visit forEachPassing(const Pack& pack, FrameOf /*frame*/,
                                                const Volume& volume, simd::LaneMask lanes,
                                                F&& visit) {
    using geometry::HWY_NAMESPACE::overlaps;
    for (auto rest = overlaps(pack, volume) & lanes; rest != 0; rest &= rest - 1) {
      if (visit(__builtin_ctz(rest)) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }
};

struct CollectPairs : OverlapTest {
  explicit CollectPairs(PairBuffer& buffer, SegmentId id = 0) : out(buffer), second(id) {}

  FCL_FIBERS_ALWAYS_INLINE Visit leafPair(SegmentId a, SegmentId b) { return out.push(a, b); }
  FCL_FIBERS_ALWAYS_INLINE Visit leaf(SegmentId a) { return out.push(a, second); }

  PairBuffer& out;
  SegmentId second;
};

/// Visits pairs of a segment of tree A and one of tree B.
template <class Pairing, class Query>
class PairTraversal {
  using TreeA = typename Pairing::TreeA;
  using TreeB = typename Pairing::TreeB;
  static constexpr bool kSplits = Query::kSplits;

 public:
  PairTraversal(const Pairing& pairing, Query& query)
      : a_(pairing.a),
        b_(pairing.b),
        b_to_a_(pairing.b_to_a),
        a_to_b_(pairing.a_to_b),
        filter_(pairing.filter),
        query_(query) {}

  /// Visits the pairs of a task.
  Visit run(const TraversalTask& task) {
    if constexpr (Pairing::kSameFrame) {
      if (task.node != TraversalTask::kCross) return visitSelf(task.node);
    }
    const auto a = Child<TreeA>::of(a_, task.a_slot);
    const auto b = Child<TreeB>::of(b_, task.b_slot);
    if constexpr (!kSplits) {
      if (a.link.isLeaf() && b.link.isLeaf()) {
        return query_.leafPair(a.link.segment(), b.link.segment());
      }
    }
    return visitCross(a, b);
  }

  /// Visits all unordered pairs below a node of A once.
  Visit visitSelf(std::int32_t node) {
    if constexpr (kSplits) {
      const std::int32_t leaves = leafCount(a_, Link::node(node));
      if (query_.isTask(leaves, leaves)) return query_.addTask(TraversalTask{node, 0, 0});
    }
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
    } else {
      const auto& pack = a_.pack(node);
      for (int lane = 0; lane < count; ++lane) {
        const auto child = Child<TreeA>::of(a_, node, lane);
        if (!child.link.isLeaf() && filter_.passesSelf(child.slot) &&
            visitSelf(child.link.node()) == Visit::kStop) {
          return Visit::kStop;
        }
        const auto later = simd::firstLanes(count) & ~simd::firstLanes(lane + 1) &
                           filter_.lanesOfB(child.slot, node);
        if (query_.forEachPassing(pack, FrameOf::kA, child.volume, later, [&](int other) HWY_ATTR {
              return visitInB(child, node, other);
            }) == Visit::kStop) {
          return Visit::kStop;
        }
      }
      return Visit::kContinue;
    }
  }

  /// Visits all pairs of a leaf of A and one of B once. The query's frame is that of A.
  /// @pre neither tree is empty
  Visit visitBoth() {
    if constexpr (Query::kNearestFirst) {
      const auto lanes = simd::firstLanes(a_.node(0).child_count) & filter_.lanesOfA(0, 0);
      return crossNearestFirst(0, lanes, 0, [](int) HWY_ATTR { return ~simd::LaneMask{0}; });
    } else {
      // The root's volume is in no pack, so the traversal starts with the children of b's root.
      for (int lane = 0; lane < b_.node(0).child_count; ++lane) {
        const auto child = Child<TreeB>::of(b_, 0, lane);
        if (crossChildrenOfA(0, child, b_to_a_(child.volume)) == Visit::kStop) return Visit::kStop;
      }
      return Visit::kContinue;
    }
  }

  /// Visits all pairs below a child in A and a child in B. The larger of the two is opened
  /// (Sobottka, Varnik and Weber, 2005, section 2), against the whole of the other. Two wide nodes
  /// of similar size are both opened, which makes the same tests without a decision in between.
  /// @pre not both are leaves, unless two leaves are a task
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
    typename Query::template Places<TreeA::kArity * TreeB::kArity> places;
    const auto all = simd::firstLanes(b_.node(b_node).child_count);
    for (auto rest = a_lanes; rest != 0; rest &= rest - 1) {
      const int lane = __builtin_ctz(rest);
      const auto child = Child<TreeA>::of(a_, a_node, lane);
      const auto lanes = all & lanesOfB(lane) & filter_.lanesOfB(child.slot, b_node);
      if (lanes == 0) continue;
      query_.addNearer(b_.pack(b_node), FrameOf::kB, inB(child), lanes, lane * TreeB::kArity,
                       places);
    }
    return query_.visitNearestFirst(places, FrameOf::kB, [&](int place) HWY_ATTR {
      return visitInB(Child<TreeA>::of(a_, a_node, place / TreeB::kArity), b_node,
                      place % TreeB::kArity);
    });
  }

  FCL_FIBERS_ALWAYS_INLINE Visit crossChildrenOfA(std::int32_t node, const Child<TreeB>& b,
                                                  const typename TreeA::Volume& b_in_a) {
    const auto lanes = simd::firstLanes(a_.node(node).child_count) & filter_.lanesOfA(b.slot, node);
    return query_.forEachPassing(a_.pack(node), FrameOf::kA, b_in_a, lanes,
                                 [&](int lane) HWY_ATTR { return visitInA(node, lane, b); });
  }
  FCL_FIBERS_ALWAYS_INLINE Visit crossChildrenOfB(const Child<TreeA>& a, std::int32_t node) {
    const auto lanes = simd::firstLanes(b_.node(node).child_count) & filter_.lanesOfB(a.slot, node);
    return query_.forEachPassing(b_.pack(node), FrameOf::kB, inB(a), lanes,
                                 [&](int lane) HWY_ATTR { return visitInB(a, node, lane); });
  }
  Visit crossChildrenOfBoth(std::int32_t a_node, const Child<TreeB>& b,
                            const typename TreeA::Volume& b_in_a) {
    const auto lanes =
        simd::firstLanes(a_.node(a_node).child_count) & filter_.lanesOfA(b.slot, a_node);
    if constexpr (Query::kNearestFirst) {
      typename Query::template Places<TreeA::kArity> places;
      query_.addNearer(a_.pack(a_node), FrameOf::kA, b_in_a, lanes, 0, places);
      simd::LaneMask near = 0;
      for (int i = 0; i < places.count; ++i) near |= simd::LaneMask{1} << places.all[i].number();
      return crossNearestFirst(a_node, near, b.link.node(),
                               [](int) HWY_ATTR { return ~simd::LaneMask{0}; });
    } else {
      return query_.forEachPassing(
          a_.pack(a_node), FrameOf::kA, b_in_a, lanes, [&](int lane) HWY_ATTR {
            return crossChildrenOfB(Child<TreeA>::of(a_, a_node, lane), b.link.node());
          });
    }
  }

  /// The volume of a child in A, in B's frame.
  FCL_FIBERS_ALWAYS_INLINE decltype(auto) inB(const Child<TreeA>& a) const {
    if (a.link.isLeaf()) return a_to_b_.ofLeaf(a.link.segment(), a.volume);
    return a_to_b_(a.volume);
  }

  // Most pairs end here as leaves, whose volumes are no longer needed.
  FCL_FIBERS_ALWAYS_INLINE Visit visitInA(std::int32_t a_node, int lane, const Child<TreeB>& b) {
    const Link a = a_.node(a_node).children[static_cast<std::size_t>(lane)];
    if constexpr (!kSplits) {
      if (a.isLeaf() && b.link.isLeaf()) return query_.leafPair(a.segment(), b.link.segment());
    }
    return visitCross(Child<TreeA>::of(a_, a_node, lane), b);
  }
  FCL_FIBERS_ALWAYS_INLINE Visit visitInB(const Child<TreeA>& a, std::int32_t b_node, int lane) {
    const Link b = b_.node(b_node).children[static_cast<std::size_t>(lane)];
    if constexpr (!kSplits) {
      if (a.link.isLeaf() && b.isLeaf()) return query_.leafPair(a.link.segment(), b.segment());
    }
    return visitCross(a, Child<TreeB>::of(b_, b_node, lane));
  }

 private:
  const TreeA& a_;
  const TreeB& b_;
  const decltype(Pairing::b_to_a)& b_to_a_;
  const decltype(Pairing::a_to_b)& a_to_b_;
  const decltype(Pairing::filter) filter_;
  Query& query_;
};

template <class Trees>
constexpr bool kIsPair = false;
template <class TreeA, class TreeB>
constexpr bool kIsPair<TreePair<TreeA, TreeB>> = true;

/// Visits all pairs of one tree or of two.
template <class Trees, class Pairing, class Query>
Visit visitAll(const Pairing& pairing, Query& query) {
  if (pairing.a.empty() || pairing.b.empty()) return Visit::kContinue;
  PairTraversal<Pairing, Query> traversal(pairing, query);
  if constexpr (kIsPair<Trees>) {
    return traversal.visitBoth();
  } else {
    return traversal.visitSelf(0);
  }
}

/// Visits the leaves below a node that pass the query's test against one volume.
/// @param lanes  lanes(node): the children of a node that are tested
template <class Tree, class Query, class Lanes>
Visit leavesBelow(const Tree& tree, std::int32_t node, const typename Tree::Volume& volume,
                  const Lanes& lanes, Query& query) {
  return query.forEachPassing(
      tree.pack(node), FrameOf::kA, volume,
      simd::firstLanes(tree.node(node).child_count) & lanes(node), [&](int lane) HWY_ATTR {
        const Link child = tree.node(node).children[static_cast<std::size_t>(lane)];
        return child.isLeaf() ? query.leaf(child.segment())
                              : leavesBelow(tree, child.node(), volume, lanes, query);
      });
}

/// Visits each segment that passes the query's test against one volume once, except those of
/// `group`.
template <class Tree, class Query>
Visit visitLeaves(const Tree& tree, const typename Tree::Volume& volume, Query& query,
                  Group group = kNoGroup) {
  if (tree.empty()) return Visit::kContinue;
  if (group == kNoGroup || tree.groups().empty()) {
    const auto all = [](std::int32_t) HWY_ATTR { return ~simd::LaneMask{0}; };
    return leavesBelow(tree, 0, volume, all, query);
  }
  const OtherGroups<Tree::kArity> filter(tree.groups().data());
  const auto others = [&](std::int32_t node) HWY_ATTR { return filter.lanesOf(group, node); };
  return leavesBelow(tree, 0, volume, others, query);
}

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
