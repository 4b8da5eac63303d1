// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include <fcl_fibers/fiber_collision_manager.h>

namespace fcl_fibers {

/// The chain-aligned tree of axis-aligned boxes of Sobottka, Varnik and Weber, sections 2.3
/// and 3.1: built and updated bottom-up in linear time. The manager to start with.
template <typename S>
class FCL_FIBERS_EXPORT LayeredAABBTreeCollisionManager : public FiberCollisionManager<S> {
 public:
  using typename FiberCollisionManager<S>::Object;

  /// Throws std::invalid_argument if the options are out of range, and std::runtime_error if FCL's
  /// objects have another layout than the library was compiled for.
  explicit LayeredAABBTreeCollisionManager(const FiberManagerOptions& options = {});

  /// Takes over the other's objects and options. The other is then as newly constructed with its
  /// options. While a query of either runs, in its callback for instance, the behaviour is
  /// undefined.
  ///@{
  LayeredAABBTreeCollisionManager(LayeredAABBTreeCollisionManager&&) noexcept = default;
  LayeredAABBTreeCollisionManager& operator=(LayeredAABBTreeCollisionManager&&) noexcept = default;
  ///@}

  /// The same manager over other objects, for a program that copies a scene for each of its
  /// threads: objects[i] stands in the place of the i-th object of getObjects(), in its fiber and
  /// group, under its fiber and segment number, with its neighbours (those of ignored_arc_length as
  /// they were measured for the original). Where the original has a capsule, so must `objects`; the
  /// shapes may be others. An object may be in both managers. The tree is copied, so that the first
  /// query or setup() of the clone costs about an update(). Const: queries of the original may run
  /// meanwhile. Throws std::invalid_argument if objects are too few or too many, null, there twice
  /// or broken.
  std::unique_ptr<LayeredAABBTreeCollisionManager> clone(const std::vector<Object*>& objects) const;

 private:
  LayeredAABBTreeCollisionManager(const LayeredAABBTreeCollisionManager& original,
                                  const std::vector<Object*>& objects);
};

/// Of objects of float.
using LayeredAABBTreeCollisionManagerf = LayeredAABBTreeCollisionManager<float>;
/// Of objects of double.
using LayeredAABBTreeCollisionManagerd = LayeredAABBTreeCollisionManager<double>;

extern template class LayeredAABBTreeCollisionManager<float>;
extern template class LayeredAABBTreeCollisionManager<double>;

}  // namespace fcl_fibers
