// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/fiber_collision_manager.h>

#include "broadphase/continuous_state.h"
#include "broadphase/manager_state.h"

namespace fcl_fibers::broadphase {

/// See FiberCollisionManager::findImpact().
/// @param other  the manager of b, or null
template <typename S>
bool findImpact(const ManagerState<S>& state, const ManagerState<S>* other,
                const fcl::CollisionObject<S>* a, const fcl::CollisionObject<S>* b,
                TimedContact& contact);

/// See ContinuousFiberCollisionManager::findImpact().
template <typename S>
bool findImpact(const ContinuousState<S>& state, const ContinuousState<S>* other,
                const fcl::ContinuousCollisionObject<S>* a,
                const fcl::ContinuousCollisionObject<S>* b, TimedContact& contact);

}  // namespace fcl_fibers::broadphase
