// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include <fcl/narrowphase/collision_object.h>

#include "broadphase/object_registry.h"
#include "fibers/fiber_table.h"
#include "simd/always_inline.h"

namespace fcl_fibers::broadphase {

/// Decides which pairs of an object a of a manager and a partner b are reported. It leaves out
/// removed objects, an object with itself, neighbours along a fiber, pairs of one group, and a
/// fiber and an obstacle that it does not meet. Several threads may ask.
template <typename S>
class PairRules {
 public:
  using Registry = ObjectRegistry<S>;
  using Object = fcl::CollisionObject<S>;

  /// @param others       the registry of the partners, which may be the same; null if they are in
  ///                     none, and so are obstacles of all categories
  /// @param young_begin  if it is given, the search leaves out pairs of one group, unless this id
  ///                     is between the two
  PairRules(const Registry& registry, const Registry* others,
            SegmentId young_begin = Registry::kNotFound)
      : registry_(&registry),
        others_(others),
        young_begin_(young_begin),
        has_obstacle_rules_(registry.fibers().hasObstacleRules() ||
                            (others != nullptr && others->fibers().hasObstacleRules())),
        ignores_neighbors_(registry.fibers().hasNeighbors()),
        has_groups_(registry.fibers().hasGroups()),
        has_own_rules_(ignores_neighbors_ || has_groups_),
        are_neighbors_(registry.fibers()) {}

  /// @param partner  the object b
  FCL_FIBERS_ALWAYS_INLINE bool report(SegmentId a, SegmentId b, const Object* partner) const {
    const Object* own = (*registry_)[a];
    if (own == nullptr || partner == nullptr || own == partner) return false;
    // A partner of another manager may be managed here, too.
    SegmentId id = b;
    if (others_ == registry_ ||
        (has_own_rules_ && (id = registry_->find(partner)) != Registry::kNotFound)) {
      if (ignores_neighbors_ && are_neighbors_(std::min(a, id), std::max(a, id))) return false;
      if (has_groups_ && !isLeftOut(a, id) && registry_->fibers().shareGroup(a, id)) return false;
    }
    return !has_obstacle_rules_ || mayMeet(a, b);
  }

 private:
  bool mayMeet(SegmentId a, SegmentId b) const {
    using Party = fibers::FiberTable::Party;
    const Party party =
        others_ == nullptr ? Party{true, tree::kAllCategories} : others_->fibers().partyOf(b);
    return registry_->fibers().partyOf(a).meets(party);
  }
  /// Whether the search has left out the pair if it is of one group.
  bool isLeftOut(SegmentId a, SegmentId b) const {
    return young_begin_ != Registry::kNotFound && (a < young_begin_) == (b < young_begin_);
  }

  const Registry* registry_;
  const Registry* others_;
  SegmentId young_begin_;
  bool has_obstacle_rules_, ignores_neighbors_, has_groups_, has_own_rules_;
  fibers::FiberTable::NeighborTest are_neighbors_;
};

}  // namespace fcl_fibers::broadphase
