// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <fcl_fibers/fiber_collision_manager.h>

#include "broadphase/manager_state.h"

namespace fcl_fibers::broadphase {

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
