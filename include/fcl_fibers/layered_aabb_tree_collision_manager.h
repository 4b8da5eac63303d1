// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include <fcl_fibers/fiber_collision_manager.h>

namespace fcl_fibers {

/// A tree of axis-aligned boxes, which an update fits bottom-up in linear time: Sobottka, Varnik
/// and Weber, 2005, sections 2.3 and 3.1. It is the manager to start with.
template <typename S>
class FCL_FIBERS_EXPORT LayeredAABBTreeCollisionManager : public FiberCollisionManager<S> {
 public:
  using typename FiberCollisionManager<S>::Object;

  /// Throws std::invalid_argument if an option is out of range, and std::runtime_error if FCL's
  /// objects have another layout than the library was compiled for.
  explicit LayeredAABBTreeCollisionManager(const FiberManagerOptions& options = {});

  /// Takes over the other's objects and options. The other is then as newly constructed with its
  /// options. The behaviour is undefined while a query of either runs.
  ///@{
  LayeredAABBTreeCollisionManager(LayeredAABBTreeCollisionManager&&) noexcept = default;
  LayeredAABBTreeCollisionManager& operator=(LayeredAABBTreeCollisionManager&&) noexcept = default;
  ///@}

  /// A manager with the same options, fibers and groups over other objects, for a program that
  /// copies a scene for each of its threads. objects[i] takes the place of the i-th object of
  /// getObjects(), with its fiber and segment number and its neighbours; arc lengths are those of
  /// the original. In place of one of several segments of a fiber it has to be a capsule, cylinder
  /// or box; otherwise the shapes may differ. An object may be in both managers.
  ///
  /// The tree is copied, so the first query or setup() of the clone costs about an update().
  /// Queries of the original may run meanwhile. Throws std::invalid_argument if there are too few
  /// or too many objects, or if one is null, repeated or broken.
  std::unique_ptr<LayeredAABBTreeCollisionManager> clone(const std::vector<Object*>& objects) const;

 private:
  LayeredAABBTreeCollisionManager(const LayeredAABBTreeCollisionManager& original,
                                  const std::vector<Object*>& objects);
};

/// The manager for objects of float.
using LayeredAABBTreeCollisionManagerf = LayeredAABBTreeCollisionManager<float>;
/// The manager for objects of double.
using LayeredAABBTreeCollisionManagerd = LayeredAABBTreeCollisionManager<double>;

extern template class LayeredAABBTreeCollisionManager<float>;
extern template class LayeredAABBTreeCollisionManager<double>;

}  // namespace fcl_fibers
