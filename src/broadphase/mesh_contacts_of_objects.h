// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <fcl_fibers/contact.h>

#include "broadphase/manager_state.h"

namespace fcl_fibers::broadphase {

/// See FiberCollisionManager::findMeshContacts().
template <typename S>
bool findMeshContacts(const ManagerState<S>& state, const fcl::CollisionObject<S>* capsule,
                      const fcl::CollisionObject<S>* mesh, double margin,
                      std::vector<MeshContact>& contacts);

}  // namespace fcl_fibers::broadphase
