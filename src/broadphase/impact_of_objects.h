// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/fiber_collision_manager.h>

#include "broadphase/manager_state.h"

namespace fcl_fibers::broadphase {

/// See FiberCollisionManager::findImpact().
/// @param other  the manager of b, or null
template <typename S>
bool findImpact(const ManagerState<S>& state, const ManagerState<S>* other,
                const fcl::CollisionObject<S>* a, const fcl::CollisionObject<S>* b,
                TimedContact& contact);

}  // namespace fcl_fibers::broadphase
