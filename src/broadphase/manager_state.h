// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>

#include <fcl_fibers/fiber_manager_options.h>

#include "broadphase/generations.h"
#include "broadphase/managed_objects.h"
#include "broadphase/obstacles.h"

namespace fcl_fibers::broadphase {

/// The registered objects of a manager and the indexes over them.
template <typename S>
class ManagerState : public ManagedObjects<S, fcl::CollisionObject<S>> {
  using Base = ManagedObjects<S, fcl::CollisionObject<S>>;

 public:
  using typename Base::Kind;
  using typename Base::Object;
  using typename Base::Objects;
  using typename Base::Registry;
  using typename Base::Scalar;
  using Source = ObjectSource<S>;

  ManagerState(bool wrapped_spheres, const FiberManagerOptions& options);

  /// Copies `original` for these objects. Queries of the original may run meanwhile.
  ManagerState(const char* call, const ManagerState& original, const Objects& objects);

  void add(const char* call, const Objects& added, const Kind& kind);
  void remove(const char* call, const Object* object);
  void clear(const char* call);

  void update(const char* call);
  void update(const char* call, const Objects& moved);

  using typename Base::QueryScope;
  /// To call after a query that has looked at the step, so that the next update begins a new one.
  void seeStep() const { step_is_seen_ = true; }

  const FiberManagerOptions& options() const { return options_; }
  /// @pre a QueryScope exists
  const Generations& generations() const { return generations_; }
  const geometry::Frame& frame() const { return generations_.frame(); }
  /// @pre a QueryScope exists
  const Obstacles<S>& obstacles() const { return obstacles_; }

  /// A mesh in the frame of the indexes, during the step. See BesideEntry::moving().
  std::shared_ptr<const index::MovingMesh> movingMesh(
      const typename Obstacles<S>::BesideEntry& entry) const {
    return entry.moving(frame(), generations_.executor());
  }

  /// Reads the objects as they are now.
  Source source(const char* call) const {
    return {call, registry_.objects(), options_.bounds, &obstacles_.beside().ids(),
            countsTriangles(options_)};
  }

  /// What the manager has of an object that is a mesh. Another thread may be making the first
  /// query.
  std::optional<typename Obstacles<S>::BesideEntry> readMeshOf(const Object* object) const;

  bool movedSinceUpdate() const;
  std::size_t memoryUsage() const;

 private:
  using Base::build_mutex_, Base::hasTree, Base::markStale, Base::refuseDuringQuery,
      Base::registry_, Base::state_;
  using typename Base::State;

  void beginStep(bool all);
  tree::Fibers segmentsFrom(SegmentId begin) const;
  void readObstacles(const char* call, bool all) const;
  void catchUp(const char* call) const override;
  void readAndBuild(const char* call) const;
  void readAndFit(const char* call) const;
  void readYoung(const char* call) const;
  void setReady() const;

  const FiberManagerOptions options_;
  std::optional<geometry::Segment> last_registered_;  ///< a capsule that the next object may
                                                      ///< continue
  /// Objects removed since the build. The indexes still have them.
  mutable std::size_t removed_ = 0, removed_young_ = 0;

  // Queries catch up, on whichever thread they run.
  mutable Generations generations_;
  mutable Obstacles<S> obstacles_;
  mutable std::atomic<bool> step_is_seen_{false};  ///< whether a query has looked at the step
};

extern template class ManagerState<float>;
extern template class ManagerState<double>;

}  // namespace fcl_fibers::broadphase
