// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include <fcl_fibers/fiber_collision_manager.h>

namespace fcl_fibers {

/// Finds the pairs of objects that touch by a tree of spheres: the wrapped spheres of Sobottka,
/// Varnik and Weber, 2005, sections 2.2, 2.3 and 3.1. Use it to compare with the paper;
/// LayeredAABBTreeCollisionManager is faster. FiberCollisionManager documents its calls.
///
///     WrappedSphereTreeCollisionManagerd manager;
///     for (const auto& fiber : fibers) manager.registerFiber(fiber);  // pointers to capsules
///     manager.collide(&data, callback);  // calls callback(a, b, &data) for each pair
///
/// Each node keeps its cage, which is the minimum enclosing sphere of the spheres of all segments
/// below it, and the one to four spheres that determine the cage. An update verifies the cages
/// bottom-up and recomputes those that fail. A plane or half-space has no sphere: its box counts.
template <typename S>
class FCL_FIBERS_EXPORT WrappedSphereTreeCollisionManager : public FiberCollisionManager<S> {
 public:
  using typename FiberCollisionManager<S>::Object;

  /// Makes an empty manager. Throws std::invalid_argument if an option is out of range, or if
  /// FiberManagerOptions::motion or skin is set, which spheres do not have. Throws
  /// std::runtime_error if FCL's objects have another layout than the library was compiled for.
  explicit WrappedSphereTreeCollisionManager(const FiberManagerOptions& options = {});

  /// Takes over the objects and options of the other manager. The other one is then empty and keeps
  /// its options. The behaviour is undefined while a query of either runs.
  ///@{
  WrappedSphereTreeCollisionManager(WrappedSphereTreeCollisionManager&&) noexcept = default;
  WrappedSphereTreeCollisionManager& operator=(WrappedSphereTreeCollisionManager&&) noexcept =
      default;
  ///@}

  /// Returns a manager with the same options, fibers and groups over other objects. See
  /// LayeredAABBTreeCollisionManager::clone().
  std::unique_ptr<WrappedSphereTreeCollisionManager> clone(
      const std::vector<Object*>& objects) const;

  /// Returns how many cages the tree has, and how many of them were recomputed when it was fitted
  /// last. All others passed the cascade verification (Sobottka, Varnik and Weber, 2005, section
  /// 3.1), or nothing below them had moved. Counts of earlier updates do not add up. An update may
  /// fit the tree twice; then the last time counts. The call first does the work that an update has
  /// left to the next query. The few objects that were registered last do not count while they are
  /// in a tree of their own. Throws std::invalid_argument if an object cannot be read.
  ///@{
  std::size_t cageCount() const;
  std::size_t cagesRecomputed() const;
  ///@}

 private:
  WrappedSphereTreeCollisionManager(const WrappedSphereTreeCollisionManager& original,
                                    const std::vector<Object*>& objects);
};

/// The manager for objects whose numbers are floats.
using WrappedSphereTreeCollisionManagerf = WrappedSphereTreeCollisionManager<float>;
/// The manager for objects whose numbers are doubles.
using WrappedSphereTreeCollisionManagerd = WrappedSphereTreeCollisionManager<double>;

extern template class WrappedSphereTreeCollisionManager<float>;
extern template class WrappedSphereTreeCollisionManager<double>;

}  // namespace fcl_fibers
