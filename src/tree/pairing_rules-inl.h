// SPDX-License-Identifier: BSD-3-Clause
#if defined(FCL_FIBERS_TREE_PAIRING_RULES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FCL_FIBERS_TREE_PAIRING_RULES_INL_H
#undef FCL_FIBERS_TREE_PAIRING_RULES_INL_H
#else
#define FCL_FIBERS_TREE_PAIRING_RULES_INL_H
#endif

#include <cstdint>
#include <vector>

#include "simd/lanes-inl.h"
#include "tree/topology.h"
#include "tree/traversal_task.h"

HWY_BEFORE_NAMESPACE();
namespace fcl_fibers::tree::HWY_NAMESPACE {

// A group filter tells which leaves of two trees A and B may be paired. It is one of these, chosen
// before a traversal starts.

/// The filter of a tree without groups, and of two trees.
struct AllGroups {
  /// The children of a node of A that may be paired with what is below a slot of B, and the other
  /// way round. Bits beyond the children are set.
  ///@{
  FCL_FIBERS_ALWAYS_INLINE simd::LaneMask lanesOfA(std::int32_t /*b_slot*/,
                                                   std::int32_t /*a_node*/) const {
    return ~simd::LaneMask{0};
  }
  FCL_FIBERS_ALWAYS_INLINE simd::LaneMask lanesOfB(std::int32_t /*a_slot*/,
                                                   std::int32_t /*b_node*/) const {
    return ~simd::LaneMask{0};
  }
  ///@}
  /// Whether segments below a slot may be paired with one another.
  FCL_FIBERS_ALWAYS_INLINE bool passesSelf(std::int32_t /*slot*/) const { return true; }
};

/// The filter of a tree with groups. It excludes pairs of children whose segments are all of one
/// group.
template <int Arity>
class OtherGroups {
 public:
  explicit OtherGroups(const std::vector<Group>& by_slot) : by_slot_(by_slot.data()) {}

  FCL_FIBERS_ALWAYS_INLINE simd::LaneMask lanesOfA(std::int32_t slot, std::int32_t node) const {
    return lanesOf(by_slot_[slot], node);
  }
  FCL_FIBERS_ALWAYS_INLINE simd::LaneMask lanesOfB(std::int32_t slot, std::int32_t node) const {
    return lanesOf(by_slot_[slot], node);
  }
  FCL_FIBERS_ALWAYS_INLINE bool passesSelf(std::int32_t slot) const {
    return by_slot_[slot] == kNoGroup;
  }
  FCL_FIBERS_ALWAYS_INLINE simd::LaneMask lanesOf(Group group, std::int32_t node) const {
    if (group == kNoGroup) return ~simd::LaneMask{0};
    return ~simd::HWY_NAMESPACE::lanesEqual<Arity>(by_slot_ + Arity * node, group);
  }

 private:
  const Group* by_slot_;
};

/// The filter of a tree A whose segments may meet only some obstacles, and a tree B of one
/// obstacle.
template <int Arity>
class MeetingCategories : public AllGroups {
 public:
  MeetingCategories(const std::vector<Categories>& by_slot, Categories categories)
      : by_slot_(by_slot.data()), categories_(categories) {}

  FCL_FIBERS_ALWAYS_INLINE simd::LaneMask lanesOfA(std::int32_t /*b_slot*/,
                                                   std::int32_t a_node) const {
    simd::LaneMask mask = 0;
    for (int lane = 0; lane < Arity; ++lane) {
      const bool meets = (by_slot_[Arity * a_node + lane] & categories_) != 0;
      mask |= simd::LaneMask{meets} << lane;
    }
    return mask;
  }

 private:
  const Categories* by_slot_;
  Categories categories_;
};

/// Calls visit(filter) with the filter of the segments of a tree that may meet an obstacle of these
/// categories.
template <class Tree, class F>
FCL_FIBERS_ALWAYS_INLINE Visit withMeeting(const Tree& tree, Categories categories, F&& visit) {
  if (tree.meets().empty()) return visit(AllGroups());
  return visit(MeetingCategories<Tree::kArity>(tree.meets(), categories));
}

}  // namespace fcl_fibers::tree::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
