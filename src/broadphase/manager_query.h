// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <fcl/broadphase/broadphase_collision_manager.h>

#include <fcl_fibers/fiber_collision_manager.h>

#include "broadphase/manager_state.h"

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

}  // namespace fcl_fibers::broadphase
