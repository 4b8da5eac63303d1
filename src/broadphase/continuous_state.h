// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <fcl/narrowphase/continuous_collision_object.h>

#include <fcl_fibers/fiber_options.h>

#include "broadphase/continuous_index.h"
#include "broadphase/managed_objects.h"

namespace fcl_fibers::broadphase {

/// The registered objects of a manager of continuous objects, and the index over them.
template <typename S>
class ContinuousState : public ManagedObjects<S, fcl::ContinuousCollisionObject<S>> {
  using Base = ManagedObjects<S, fcl::ContinuousCollisionObject<S>>;

 public:
  using typename Base::Kind;
  using typename Base::Object;
  using typename Base::Objects;
  using Source = ContinuousIndex::Source;

  explicit ContinuousState(const FiberOptions& options);

  void add(const char* call, const Objects& added, const Kind& kind);
  void remove(const char* call, const Object* object);
  void clear(const char* call);

  void update(const char* call);
  void update(const char* call, const Objects& moved);

  const FiberOptions& options() const { return options_; }
  /// @pre a QueryScope exists
  const ContinuousIndex& index() const { return index_; }
  const geometry::Frame& frame() const { return index_.frame(); }
  Source source(const char* /*call*/) const { return index_.whole(); }

  std::size_t memoryUsage() const;

 private:
  using Base::build_mutex_, Base::markStale, Base::refuseDuringQuery, Base::registry_, Base::state_;
  using typename Base::State;

  void catchUp(const char* call) const override;
  ContinuousIndex::MovingSegments readAll(const char* call) const;

  const FiberOptions options_;
  mutable std::size_t removed_ = 0;  ///< objects removed since the build; the index has them
  mutable ContinuousIndex index_;    ///< queries catch up, on whichever thread they run
};

extern template class ContinuousState<float>;
extern template class ContinuousState<double>;

}  // namespace fcl_fibers::broadphase
