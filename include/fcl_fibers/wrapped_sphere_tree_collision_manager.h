// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include <fcl_fibers/fiber_collision_manager.h>

namespace fcl_fibers {

/// The wrapped sphere tree of Sobottka, Varnik and Weber, sections 2.2, 2.3 and 3.1: each node
/// keeps the minimum enclosing sphere (cage) of the spheres of all segments below it and the one to
/// four spheres that determine it; an update verifies cages bottom-up and recomputes those that
/// fail.
template <typename S>
class FCL_FIBERS_EXPORT WrappedSphereTreeCollisionManager : public FiberCollisionManager<S> {
 public:
  using typename FiberCollisionManager<S>::Object;

  /// Throws std::invalid_argument if the options are out of range, and std::runtime_error if FCL's
  /// objects have another layout than the library was compiled for.
  explicit WrappedSphereTreeCollisionManager(const FiberManagerOptions& options = {});

  /// Takes over the other's objects and options. The other is then as newly constructed with its
  /// options. While a query of either runs, in its callback for instance, the behaviour is
  /// undefined.
  ///@{
  WrappedSphereTreeCollisionManager(WrappedSphereTreeCollisionManager&&) noexcept = default;
  WrappedSphereTreeCollisionManager& operator=(WrappedSphereTreeCollisionManager&&) noexcept =
      default;
  ///@}

  /// As LayeredAABBTreeCollisionManager::clone().
  std::unique_ptr<WrappedSphereTreeCollisionManager> clone(
      const std::vector<Object*>& objects) const;

 private:
  WrappedSphereTreeCollisionManager(const WrappedSphereTreeCollisionManager& original,
                                    const std::vector<Object*>& objects);
};

/// Of objects of float.
using WrappedSphereTreeCollisionManagerf = WrappedSphereTreeCollisionManager<float>;
/// Of objects of double.
using WrappedSphereTreeCollisionManagerd = WrappedSphereTreeCollisionManager<double>;

extern template class WrappedSphereTreeCollisionManager<float>;
extern template class WrappedSphereTreeCollisionManager<double>;

}  // namespace fcl_fibers
