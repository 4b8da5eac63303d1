// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include <fcl_fibers/fiber_collision_manager.h>

namespace fcl_fibers {

/// The wrapped spheres of Sobottka, Varnik and Weber, 2005, sections 2.2, 2.3 and 3.1: each node
/// keeps its cage, which is the minimum enclosing sphere of the spheres of all segments below it,
/// and the one to four spheres that determine it. An update verifies the cages bottom-up and
/// recomputes those that fail. Under Report::kVolumes an object without bounds, such as a plane, is
/// paired with every other one.
template <typename S>
class FCL_FIBERS_EXPORT WrappedSphereTreeCollisionManager : public FiberCollisionManager<S> {
 public:
  using typename FiberCollisionManager<S>::Object;

  /// Throws std::invalid_argument if an option is out of range, and std::runtime_error if FCL's
  /// objects have another layout than the library was compiled for.
  explicit WrappedSphereTreeCollisionManager(const FiberManagerOptions& options = {});

  /// Takes over the other's objects and options. The other is then as newly constructed with its
  /// options. The behaviour is undefined while a query of either runs.
  ///@{
  WrappedSphereTreeCollisionManager(WrappedSphereTreeCollisionManager&&) noexcept = default;
  WrappedSphereTreeCollisionManager& operator=(WrappedSphereTreeCollisionManager&&) noexcept =
      default;
  ///@}

  /// See LayeredAABBTreeCollisionManager::clone().
  std::unique_ptr<WrappedSphereTreeCollisionManager> clone(
      const std::vector<Object*>& objects) const;

 private:
  WrappedSphereTreeCollisionManager(const WrappedSphereTreeCollisionManager& original,
                                    const std::vector<Object*>& objects);
};

/// The manager for objects of float.
using WrappedSphereTreeCollisionManagerf = WrappedSphereTreeCollisionManager<float>;
/// The manager for objects of double.
using WrappedSphereTreeCollisionManagerd = WrappedSphereTreeCollisionManager<double>;

extern template class WrappedSphereTreeCollisionManager<float>;
extern template class WrappedSphereTreeCollisionManager<double>;

}  // namespace fcl_fibers
