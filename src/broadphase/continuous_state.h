// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <fcl/narrowphase/continuous_collision_object.h>

#include <fcl_fibers/fiber_options.h>

#include "broadphase/continuous_index.h"
#include "broadphase/object_registry.h"
#include "broadphase/object_source.h"

namespace fcl_fibers::broadphase {

/// The registered objects of a manager of continuous objects, and the index over them. The first
/// query or setup() after a change brings the index up to date. It is what ManagerState is for
/// objects at rest: queries are const and may run at the same time, calls that change the manager
/// throw while a query runs, and `call` names the public function in error texts.
template <typename S>
class ContinuousState {
 public:
  using Object = fcl::ContinuousCollisionObject<S>;
  using Objects = std::vector<Object*>;
  using Registry = ObjectRegistry<S, Object>;
  using Name = std::function<std::string(std::size_t)>;

  explicit ContinuousState(const FiberOptions& options);

  void add(const char* call, const Objects& added, const typename Registry::Kind& kind);
  void remove(const char* call, const Object* object);
  void clear(const char* call);

  void setup(const char* call);
  void update(const char* call);
  void update(const char* call, const Objects& moved);

  /// Brings the index up to date and forbids changes while a query runs.
  class QueryScope {
   public:
    QueryScope(const ContinuousState& state, const char* call);
    ~QueryScope() { --state_.running_queries_; }
    QueryScope(const QueryScope&) = delete;
    QueryScope& operator=(const QueryScope&) = delete;

   private:
    const ContinuousState& state_;
  };

  const FiberOptions& options() const { return options_; }
  const Registry& registry() const { return registry_; }
  /// @pre a QueryScope exists
  const ContinuousIndex& index() const { return index_; }

  /// An index of other objects, by their positions. Throws with `name` if one cannot be read.
  /// @pre a QueryScope exists
  std::unique_ptr<ContinuousIndex> indexOf(const char* call, const Objects& objects,
                                           const Name& name) const;

  /// The id of an object. Throws with `name` if the object is null or not registered.
  SegmentId managedId(const char* call, const Object* object, const std::string& name) const;

 private:
  enum class State {
    kStale,   ///< objects came or went; the next query reads all and builds
    kReady,   ///< the index may be searched
    kFailed,  ///< the last update failed
  };

  void refuseDuringQuery(const char* call) const;
  void makeReady(const char* call) const;
  ContinuousIndex::MovingSegments readAll(const char* call) const;
  void readAndBuild(const char* call) const;
  std::string nameOf(SegmentId id) const;

  const FiberOptions options_;
  Registry registry_;
  mutable std::size_t removed_ = 0;  ///< objects removed since the build; the index has them

  // The first query after a change builds the index, on whichever thread it runs.
  mutable ContinuousIndex index_;
  mutable std::mutex build_mutex_;
  mutable std::atomic<State> state_{State::kStale};
  mutable std::atomic<int> running_queries_{0};
};

extern template class ContinuousState<float>;
extern template class ContinuousState<double>;

}  // namespace fcl_fibers::broadphase
