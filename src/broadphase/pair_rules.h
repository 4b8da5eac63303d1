// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "broadphase/object_registry.h"

namespace fcl_fibers::broadphase {

/// Decides which pairs of an index are reported. It leaves out pairs of removed objects, of
/// neighbours along a fiber, of one group, and of a fiber and an obstacle that it does not meet.
template <class Registry>
class PairRules {
 public:
  using Object = typename Registry::Object;

  /// @param young_begin  ids from here on are in an index of their own
  PairRules(const Registry& registry, SegmentId young_begin)
      : registry_(registry),
        young_begin_(young_begin),
        ignores_neighbors_(registry.fibers().hasNeighbors()),
        has_obstacle_rules_(registry.fibers().hasObstacleRules()) {}

  /// @param is_beside  whether one of the two is beside the tree
  /// @pre a < b
  bool reports(SegmentId a, SegmentId b, bool is_beside) const {
    // Within one index, the search has excluded groups.
    const bool is_across = is_beside || (a < young_begin_ && b >= young_begin_);
    return registry_[a] != nullptr && registry_[b] != nullptr && !areNeighbors(a, b) &&
           !(is_across && registry_.fibers().shareGroup(a, b)) && mayMeet(a, registry_, b);
  }

  /// Whether a pair with the object of a query is reported.
  /// @param own_id  the object's id, kNotFound if it is not managed here
  bool reportsWith(SegmentId a, SegmentId own_id) const {
    if (registry_[a] == nullptr) return false;
    if (own_id == Registry::kNotFound) {
      // An object that is not managed is an obstacle of all categories.
      return !has_obstacle_rules_ ||
             registry_.fibers().partyOf(a).meets({true, tree::kAllCategories});
    }
    return isNotOwn(a, own_id) && mayMeet(a, registry_, own_id);
  }

  /// Whether a pair with the object b of another manager is reported.
  bool reportsWith(SegmentId a, const Registry& other, SegmentId b) const {
    const Object* partner = other[b];
    if (partner == nullptr || registry_[a] == nullptr || registry_[a] == partner) return false;
    if (!mayMeet(a, other, b)) return false;
    // The partner may be managed here, too. It is looked up only if a rule depends on that.
    if (!ignores_neighbors_ && !registry_.fibers().hasGroups()) return true;
    const SegmentId own_id = registry_.find(partner);
    return own_id == Registry::kNotFound || isNotOwn(a, own_id);
  }

 private:
  bool isNotOwn(SegmentId a, SegmentId own_id) const {
    return a != own_id && !areNeighbors(a, own_id) && !registry_.fibers().shareGroup(a, own_id);
  }
  bool mayMeet(SegmentId a, const Registry& of_b, SegmentId b) const {
    if (!has_obstacle_rules_ && !of_b.fibers().hasObstacleRules()) return true;
    return registry_.fibers().partyOf(a).meets(of_b.fibers().partyOf(b));
  }
  bool areNeighbors(SegmentId a, SegmentId b) const {
    return ignores_neighbors_ && registry_.fibers().areNeighbors(a, b);
  }

  const Registry& registry_;
  const SegmentId young_begin_;
  const bool ignores_neighbors_, has_obstacle_rules_;
};

}  // namespace fcl_fibers::broadphase
