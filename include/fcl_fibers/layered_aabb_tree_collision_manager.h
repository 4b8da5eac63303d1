// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include <fcl_fibers/fiber_collision_manager.h>

namespace fcl_fibers {

/// Finds the pairs of objects that touch among thousands of fibers, by a tree of axis-aligned
/// boxes. This is the manager to start with. It replaces FCL's DynamicAABBTreeCollisionManager;
/// FiberCollisionManager documents its calls.
///
///     LayeredAABBTreeCollisionManagerd manager;
///     for (const auto& fiber : fibers) manager.registerFiber(fiber);  // pointers to capsules
///     manager.collide(&data, callback);  // calls callback(a, b, &data) for each pair
///
/// An update fits the boxes bottom-up in linear time: Sobottka, Varnik and Weber, 2005, sections
/// 2.3 and 3.1.
template <typename S>
class FCL_FIBERS_EXPORT LayeredAABBTreeCollisionManager : public FiberCollisionManager<S> {
 public:
  using typename FiberCollisionManager<S>::Object;

  /// Makes an empty manager. Throws std::invalid_argument if an option is out of range, and
  /// std::runtime_error if FCL's objects have another layout than the library was compiled for.
  explicit LayeredAABBTreeCollisionManager(const FiberManagerOptions& options = {});

  /// Takes over the objects and options of the other manager. The other one is then empty and keeps
  /// its options. The behaviour is undefined while a query of either runs.
  ///@{
  LayeredAABBTreeCollisionManager(LayeredAABBTreeCollisionManager&&) noexcept = default;
  LayeredAABBTreeCollisionManager& operator=(LayeredAABBTreeCollisionManager&&) noexcept = default;
  ///@}

  /// Returns a manager with the same options, fibers and groups over other objects, for a program
  /// that copies a scene for each of its threads. objects[i] takes the place of the i-th object of
  /// getObjects(), with its fiber and segment number and its neighbours. Arc lengths are those of
  /// the original. The shape may differ, but a segment of a fiber of several segments has to be
  /// replaced by a capsule, cylinder or box. An object may be in both managers.
  ///
  ///     auto copy = manager.clone(objects_of_thread);
  ///     copy->collide(&data, callback);
  ///
  /// The tree is copied, so the first query or setup() of the clone costs about as much as an
  /// update(). Queries of the original may run during the call. Throws std::invalid_argument if
  /// there are too few or too many objects, if one is null, repeated or cannot be read, if a
  /// segment is replaced by another shape than those above, or if a mesh that is to be solid leaks.
  std::unique_ptr<LayeredAABBTreeCollisionManager> clone(const std::vector<Object*>& objects) const;

 private:
  LayeredAABBTreeCollisionManager(const LayeredAABBTreeCollisionManager& original,
                                  const std::vector<Object*>& objects);
};

/// The manager for objects whose numbers are floats.
using LayeredAABBTreeCollisionManagerf = LayeredAABBTreeCollisionManager<float>;
/// The manager for objects whose numbers are doubles.
using LayeredAABBTreeCollisionManagerd = LayeredAABBTreeCollisionManager<double>;

extern template class LayeredAABBTreeCollisionManager<float>;
extern template class LayeredAABBTreeCollisionManager<double>;

}  // namespace fcl_fibers
