// SPDX-License-Identifier: BSD-3-Clause
#if defined(FCL_FIBERS_TREE_PAIRING_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_TREE_PAIRING_INL_H
#undef FCL_FIBERS_TREE_PAIRING_INL_H
#else
#define FCL_FIBERS_TREE_PAIRING_INL_H
#endif

#include <cassert>
#include <cstdint>
#include <type_traits>

#include "geometry/frame.h"
#include "simd/lanes-inl.h"
#include "tree/kernels.h"
#include "tree/topology.h"
#include "tree/traversal_task.h"
#include "tree/tree_pair.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

// A filter tells which leaves of two trees A and B may be paired:
//
//   simd::LaneMask lanesOfA(b_slot, a_node)   the children of a node of A that may be paired with
//                                             what is below a slot of B; bits beyond the children
//                                             are set
//   simd::LaneMask lanesOfB(a_slot, b_node)   the other way round
//   bool passesSelf(slot)                     whether segments below a slot may be paired with one
//                                             another

/// The filter of a tree without groups, and of two trees in one frame.
struct AllPairs {
  FCL_FIBERS_ALWAYS_INLINE simd::LaneMask lanesOfA(std::int32_t /*b_slot*/,
                                                   std::int32_t /*a_node*/) const {
    return ~simd::LaneMask{0};
  }
  FCL_FIBERS_ALWAYS_INLINE simd::LaneMask lanesOfB(std::int32_t /*a_slot*/,
                                                   std::int32_t /*b_node*/) const {
    return ~simd::LaneMask{0};
  }
  FCL_FIBERS_ALWAYS_INLINE bool passesSelf(std::int32_t /*slot*/) const { return true; }
};

/// The filter of a tree with groups. It excludes pairs of children whose segments are all of one
/// group.
template <int Arity>
class OtherGroups {
 public:
  explicit OtherGroups(const Group* by_slot) : by_slot_(by_slot) {}  ///< see Topology

  FCL_FIBERS_ALWAYS_INLINE simd::LaneMask lanesOfA(std::int32_t slot, std::int32_t node) const {
    return lanesOf(by_slot_[slot], node);
  }
  FCL_FIBERS_ALWAYS_INLINE simd::LaneMask lanesOfB(std::int32_t slot, std::int32_t node) const {
    return lanesOf(by_slot_[slot], node);
  }
  FCL_FIBERS_ALWAYS_INLINE bool passesSelf(std::int32_t slot) const {
    return by_slot_[slot] == kNoGroup;
  }
  /// The children of a node that may be paired with a segment of `group`.
  FCL_FIBERS_ALWAYS_INLINE simd::LaneMask lanesOf(Group group, std::int32_t node) const {
    if (group == kNoGroup) return ~simd::LaneMask{0};
    return ~simd::HWY_NAMESPACE::lanesEqual<Arity>(by_slot_ + Arity * node, group);
  }

 private:
  const Group* by_slot_;
};

/// One of the two filters above, in code that is compiled once for both.
template <int Arity>
class GroupsIfAny {
 public:
  /// @param by_slot  null if there are no groups
  explicit GroupsIfAny(const Group* by_slot) : any_(by_slot != nullptr), groups_(by_slot) {}

  FCL_FIBERS_ALWAYS_INLINE simd::LaneMask lanesOfA(std::int32_t slot, std::int32_t node) const {
    return any_ ? groups_.lanesOfA(slot, node) : ~simd::LaneMask{0};
  }
  FCL_FIBERS_ALWAYS_INLINE simd::LaneMask lanesOfB(std::int32_t slot, std::int32_t node) const {
    return any_ ? groups_.lanesOfB(slot, node) : ~simd::LaneMask{0};
  }
  FCL_FIBERS_ALWAYS_INLINE bool passesSelf(std::int32_t slot) const {
    return !any_ || groups_.passesSelf(slot);
  }

 private:
  const bool any_;
  const OtherGroups<Arity> groups_;
};

/// The filter of pairs of a tree A, whose segments may meet only some obstacles, and a tree B of
/// one obstacle.
template <int Arity>
class MeetingCategories {
 public:
  /// @param by_slot  see Topology; if it is null, all pairs pass
  MeetingCategories(const Categories* by_slot, Categories categories)
      : by_slot_(by_slot), categories_(categories) {}

  FCL_FIBERS_ALWAYS_INLINE simd::LaneMask lanesOfA(std::int32_t /*b_slot*/,
                                                   std::int32_t a_node) const {
    if (by_slot_ == nullptr) return ~simd::LaneMask{0};
    simd::LaneMask mask = 0;
    for (int lane = 0; lane < Arity; ++lane) {
      const bool meets = by_slot_[Arity * a_node + lane].meet(categories_);
      mask |= simd::LaneMask{meets} << lane;
    }
    return mask;
  }
  FCL_FIBERS_ALWAYS_INLINE simd::LaneMask lanesOfB(std::int32_t /*a_slot*/,
                                                   std::int32_t /*b_node*/) const {
    return ~simd::LaneMask{0};
  }

 private:
  const Categories* by_slot_;
  Categories categories_;
};

// A pairing is what a traversal needs to know of the two trees whose segments it pairs: the trees A
// and B, which may be the same, the changes between their frames, and the filter. Kernels have a
// pairing for each kind of filter and change, because asking for the kind at each test would take
// several per cent of it. Code that is compiled once asks.

/// Trees in one frame.
template <class Tree, class Filter>
struct SamePairing {
  using TreeA = Tree;
  using TreeB = Tree;
  static constexpr bool kSameFrame = true;

  const Tree& a;
  const Tree& b;
  Filter filter;
  geometry::SameFrame b_to_a = {}, a_to_b = {};
};

/// Trees in two frames.
template <class A, class B, class BToA, class AToB>
struct ChangingPairing {
  using TreeA = A;
  using TreeB = B;
  static constexpr bool kSameFrame = false;

  ChangingPairing(const TreePair<A, B>& trees, const BToA& b_in_a, const AToB& a_in_b)
      : a(trees.a),
        b(trees.b),
        filter(trees.meets, trees.categories),
        b_to_a(b_in_a),
        a_to_b(a_in_b) {}

  const A& a;
  const B& b;
  MeetingCategories<A::kArity> filter;
  const BToA& b_to_a;
  const AToB& a_to_b;
};

/// A change behind a call, which takes less code than a copy at each place.
template <class Change>
class Called {
 public:
  explicit Called(const Change& change) : change_(change) {}

  double scale() const { return change_.scale(); }
  template <class Volume>
  HWY_NOINLINE auto operator()(const Volume& volume) const {
    return change_(volume);
  }
  template <class Volume>
  HWY_NOINLINE auto ofLeaf(SegmentId id, const Volume& volume) const {
    return change_.ofLeaf(id, volume);
  }

 private:
  const Change& change_;
};
template <class Change>
using Inlined = const Change&;

// Each calls visit(pairing) with the pairing of a search within one tree, or between two.

/// For code that is compiled once.
/// @param How  Called or Inlined
///@{
template <template <class> class How, class Tree, class F>
Visit withAnyPairing(const Tree& tree, F&& visit) {
  using Filter = GroupsIfAny<Tree::kArity>;
  const auto& groups = tree.groups();
  return visit(
      SamePairing<Tree, Filter>{tree, tree, Filter(groups.empty() ? nullptr : groups.data())});
}
template <template <class> class How, class A, class B, class F>
Visit withAnyPairing(const TreePair<A, B>& trees, F&& visit) {
  if constexpr (std::is_same_v<A, B>) {
    using Filter = GroupsIfAny<A::kArity>;
    if (trees.isInOneFrame())
      return visit(SamePairing<A, Filter>{trees.a, trees.b, Filter(nullptr)});
  }
  const How<typename TreePair<A, B>::BToA> b_to_a(trees.b_to_a);
  const How<typename TreePair<A, B>::AToB> a_to_b(trees.a_to_b);
  return visit(ChangingPairing(trees, b_to_a, a_to_b));
}
///@}

/// For kernels. The test of moving boxes is so long that they may ask for their groups.
///@{
template <class Tree, class F>
FCL_FIBERS_ALWAYS_INLINE Visit withPairing(const Tree& tree, F&& visit) {
  if constexpr (Kernels<Tree>::kMoves) {
    return withAnyPairing<Inlined>(tree, visit);
  } else {
    using Groups = OtherGroups<Tree::kArity>;
    const auto& groups = tree.groups();
    if (groups.empty()) return visit(SamePairing<Tree, AllPairs>{tree, tree, {}});
    return visit(SamePairing<Tree, Groups>{tree, tree, Groups(groups.data())});
  }
}
template <class A, class B, class F>
FCL_FIBERS_ALWAYS_INLINE Visit withPairing(const TreePair<A, B>& trees, F&& visit) {
  if constexpr (std::is_same_v<A, B> && !Kernels<A>::kMoves) {
    if (trees.isInOneFrame()) return visit(SamePairing<A, AllPairs>{trees.a, trees.b, {}});
  }
  if constexpr (std::is_same_v<typename TreePair<A, B>::BToA, BoxChange>) {
    if (!trees.b_to_a.turned()) {
      return visit(ChangingPairing(trees, trees.b_to_a.straight(), trees.a_to_b.straight()));
    }
    // Only a mesh is turned.
    if constexpr (std::is_same_v<B, MeshTree>) {
      return visit(ChangingPairing(trees, *trees.b_to_a.turned(), *trees.a_to_b.turned()));
    }
    assert(false);
    return Visit::kContinue;
  } else if constexpr (Kernels<A>::kMoves) {
    return withAnyPairing<Inlined>(trees, visit);
  } else {
    return visit(ChangingPairing(trees, trees.b_to_a, trees.a_to_b));
  }
}
///@}

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
