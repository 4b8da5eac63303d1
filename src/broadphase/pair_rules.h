// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "broadphase/manager_state.h"

namespace fcl_fibers::broadphase {

/// Decides which pairs of an index are reported. It leaves out pairs of removed objects, of
/// neighbours along a fiber and of one group.
template <typename S>
class PairRules {
 public:
  using Object = fcl::CollisionObject<S>;

  explicit PairRules(const ManagerState<S>& state)
      : registry_(state.registry()),
        young_begin_(state.generations().youngBegin()),
        ignores_neighbors_(state.registry().fibers().hasNeighbors()) {}

  /// @pre a < b
  bool reports(SegmentId a, SegmentId b) const {
    // Within one index, the search has excluded groups.
    const bool is_across = a < young_begin_ && b >= young_begin_;
    return registry_[a] != nullptr && registry_[b] != nullptr && !areNeighbors(a, b) &&
           !(is_across && registry_.fibers().shareGroup(a, b));
  }

  /// Whether a pair with the object of a query is reported.
  /// @param own_id  the object's id, kNotFound if it is not managed here
  bool reportsWith(SegmentId a, SegmentId own_id) const {
    if (registry_[a] == nullptr) return false;
    return own_id == ObjectRegistry<S>::kNotFound ||
           (a != own_id && !areNeighbors(a, own_id) && !registry_.fibers().shareGroup(a, own_id));
  }

  /// Whether a pair with another manager's object is reported. `partner` is null if it was removed.
  bool reportsWith(SegmentId a, const Object* partner) const {
    if (partner == nullptr || registry_[a] == nullptr || registry_[a] == partner) return false;
    // The partner may be managed here, too. It is looked up only if a rule depends on that.
    const bool matters = ignores_neighbors_ || registry_.fibers().hasGroups();
    return !matters || reportsWith(a, registry_.find(partner));
  }

 private:
  bool areNeighbors(SegmentId a, SegmentId b) const {
    return ignores_neighbors_ && registry_.fibers().areNeighbors(a, b);
  }

  const ObjectRegistry<S>& registry_;
  const SegmentId young_begin_;
  const bool ignores_neighbors_;
};

}  // namespace fcl_fibers::broadphase
