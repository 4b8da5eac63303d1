// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcl_fibers/fiber_collision_manager.h>

namespace fcl_fibers {

/// The chain-aligned tree of axis-aligned boxes of Sobottka, Varnik and Weber, sections 2.3
/// and 3.1: built and updated bottom-up in linear time. The manager to start with.
template <typename S>
class FCL_FIBERS_EXPORT LayeredAABBTreeCollisionManager : public FiberCollisionManager<S> {
 public:
  /// Throws std::invalid_argument if the options are out of range, and std::runtime_error if FCL's
  /// objects have another layout than the library was compiled for.
  explicit LayeredAABBTreeCollisionManager(const FiberManagerOptions& options = {});
};

/// Of objects of float.
using LayeredAABBTreeCollisionManagerf = LayeredAABBTreeCollisionManager<float>;
/// Of objects of double.
using LayeredAABBTreeCollisionManagerd = LayeredAABBTreeCollisionManager<double>;

extern template class LayeredAABBTreeCollisionManager<float>;
extern template class LayeredAABBTreeCollisionManager<double>;

}  // namespace fcl_fibers
