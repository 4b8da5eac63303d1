// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

#include <fcl/broadphase/broadphase_collision_manager.h>

#include <fcl_fibers/fiber_collision_manager.h>

#include "broadphase/manager_state.h"
#include "simd/always_inline.h"

namespace fcl_fibers::broadphase {

/// What a program asks a manager for: the pairs that collide, or those nearer than the least
/// distance so far. One of the callbacks is set.
template <typename S>
struct ManagerQuery {
  void* cdata;
  fcl::CollisionCallBack<S> collision;
  fcl::DistanceCallBack<S> distance;
  bool is_for_distances;

  ManagerQuery(void* data, fcl::CollisionCallBack<S> callback)
      : cdata(data), collision(callback), distance(nullptr), is_for_distances(false) {}
  ManagerQuery(void* data, fcl::DistanceCallBack<S> callback)
      : cdata(data), collision(nullptr), distance(callback), is_for_distances(true) {}

  const char* name() const { return is_for_distances ? "distance" : "collide"; }
};

/// @name Asks about the pairs of a manager's objects
/// They throw std::invalid_argument if the callback is null.
///@{

/// Among themselves.
template <typename S>
void ask(const ManagerState<S>& state, const ManagerQuery<S>& query);
/// With those of another manager, which may be the same.
template <typename S>
void ask(const ManagerState<S>& state, const ManagerQuery<S>& query, const ManagerState<S>& other);
/// With one object, managed or not.
template <typename S>
void ask(const ManagerState<S>& state, const ManagerQuery<S>& query,
         fcl::CollisionObject<S>* object);
/// With those of another class of manager. It reads each object only when its turn comes, which
/// saves time if the query ends early.
template <typename S>
void ask(const ManagerState<S>& state, const ManagerQuery<S>& query,
         const std::vector<fcl::CollisionObject<S>*>& others);
///@}

/// See FiberCollisionManager::findMeshContacts().
template <typename S>
bool findMeshContacts(const ManagerState<S>& state, const fcl::CollisionObject<S>* capsule,
                      const fcl::CollisionObject<S>* mesh, double margin,
                      std::vector<MeshContact>& contacts);

/// See FiberCollisionManager::findImpact().
/// @param other  the manager of b, or null
template <typename S>
bool findImpact(const ManagerState<S>& state, const ManagerState<S>* other,
                const fcl::CollisionObject<S>* a, const fcl::CollisionObject<S>* b,
                TimedContact& contact);

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
