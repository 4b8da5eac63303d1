// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstddef>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_manager_options.h>

#include "broadphase/generations.h"
#include "broadphase/object_registry.h"
#include "broadphase/object_source.h"
#include "broadphase/obstacles.h"

namespace fcl_fibers::broadphase {

/// The registered objects of a manager and the indexes over them. The first query or update after a
/// change brings the indexes up to date.
///
/// Queries are const and may run at the same time. Calls that change the manager throw while a
/// query runs. `call` names the public function in error texts.
template <typename S>
class ManagerState {
 public:
  using Object = fcl::CollisionObject<S>;
  using Objects = std::vector<Object*>;
  using Registry = ObjectRegistry<S>;
  using Kind = typename Registry::Kind;

  ManagerState(bool wrapped_spheres, const FiberManagerOptions& options);

  /// Copies `original` for these objects. Queries of the original may run meanwhile.
  ManagerState(const char* call, const ManagerState& original, const Objects& objects);

  /// @param is_solid  whether the inside of a mesh counts
  void add(const char* call, const Objects& added, const Kind& kind, bool is_solid = false);
  void remove(const char* call, const Object* object);
  void clear(const char* call);

  void setup(const char* call);
  void update(const char* call);
  void update(const char* call, const Objects& moved);

  /// Brings the indexes up to date and forbids changes while a query runs.
  class QueryScope {
   public:
    /// @param sees_step  whether the next update begins a new step
    QueryScope(const ManagerState& state, const char* call, bool sees_step);
    ~QueryScope() { --state_.running_queries_; }
    QueryScope(const QueryScope&) = delete;
    QueryScope& operator=(const QueryScope&) = delete;

   private:
    const ManagerState& state_;
  };

  const FiberManagerOptions& options() const { return options_; }
  const Registry& registry() const { return registry_; }
  /// @pre a QueryScope exists
  const Generations& generations() const { return generations_; }
  /// @pre a QueryScope exists
  const Obstacles<S>& obstacles() const { return obstacles_; }

  /// Reads the objects as they are now.
  ObjectSource<S> source(const char* call) const {
    if (!countsTriangles(options_)) return {call, registry_.objects(), options_.bounds};
    return {call, registry_.objects(), options_.bounds,
            [this](SegmentId id) { return obstacles_.isMesh(id); }};
  }

  /// What the manager has of an object that is a mesh. Another thread may be making the first
  /// query.
  std::optional<typename Obstacles<S>::MeshEntry> readMeshOf(const Object* object) const;

  bool movedSinceUpdate() const;
  std::size_t memoryUsage() const;

  /// The id of an object. Throws with `name` if the object is null or not registered.
  SegmentId managedId(const char* call, const Object* object, const std::string& name) const;

 private:
  enum class State {
    kStale,   ///< objects were registered or unregistered; the next query reads all and builds
    kGrown,   ///< a few objects were registered; the next query builds the young index
    kCloned,  ///< the indexes fit the original's objects; the next query reads all and refits
    kReady,   ///< the indexes may be searched
    kFailed,  ///< the last update failed; the indexes may be inconsistent
  };

  void refuseDuringQuery(const char* call) const;
  void beginStep(bool all);
  tree::Fibers segmentsFrom(SegmentId begin) const;
  void readObstacles(const char* call, bool all) const;
  void makeReady(const char* call) const;
  bool hasTree() const {
    return state_ == State::kReady || state_ == State::kGrown || state_ == State::kCloned;
  }
  void markStale() {
    if (hasTree()) state_ = State::kStale;
  }
  void catchUp(const char* call) const;
  void readAndBuild(const char* call) const;
  void readAndFit(const char* call) const;
  void readYoung(const char* call) const;
  void setReady() const;

  const FiberManagerOptions options_;
  Registry registry_;
  std::optional<geometry::Segment> last_registered_;  ///< a capsule that the next object may
                                                      ///< continue
  /// Objects removed since the build. The indexes still have them.
  mutable std::size_t removed_ = 0, removed_young_ = 0;

  // The first query after registering builds the indexes, on whichever thread it runs.
  mutable Generations generations_;
  mutable Obstacles<S> obstacles_;
  mutable std::mutex build_mutex_;
  mutable std::atomic<State> state_{State::kStale};
  mutable std::atomic<int> running_queries_{0};
  mutable std::atomic<bool> step_is_seen_{false};  ///< whether a query has looked at the step
};

extern template class ManagerState<float>;
extern template class ManagerState<double>;

}  // namespace fcl_fibers::broadphase
