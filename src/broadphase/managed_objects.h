// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstddef>
#include <limits>
#include <mutex>
#include <string>
#include <vector>

#include "broadphase/object_registry.h"
#include "broadphase/object_source.h"
#include "fibers/options.h"

namespace fcl_fibers::broadphase {

/// The registered objects of a manager, and whether its indexes are up to date. The first query or
/// update after a change brings them up to date.
///
/// Queries are const and may run at the same time. Calls that change the manager throw while a
/// query runs. `call` names the public function in error texts.
template <typename S, class ManagedObject>
class ManagedObjects {
 public:
  using Scalar = S;
  using Object = ManagedObject;
  using Objects = std::vector<Object*>;
  using Registry = ObjectRegistry<S, Object>;
  using Kind = typename Registry::Kind;

  void setup(const char* call) {
    if (state_ == State::kReady) return;
    refuseDuringQuery(call);
    catchUp(call);
  }

  /// Brings the indexes up to date and forbids changes while a query runs.
  class QueryScope {
   public:
    QueryScope(const ManagedObjects& objects, const char* call) : objects_(objects) {
      ++objects_.running_queries_;
      try {
        objects_.makeReady(call);
      } catch (...) {
        --objects_.running_queries_;
        throw;
      }
    }
    ~QueryScope() { --objects_.running_queries_; }
    QueryScope(const QueryScope&) = delete;
    QueryScope& operator=(const QueryScope&) = delete;

   private:
    const ManagedObjects& objects_;
  };

  const Registry& registry() const { return registry_; }

  /// The id of an object. Throws with `name` if the object is null or not registered.
  SegmentId managedId(const char* call, const Object* object, const std::string& name) const;

 protected:
  enum class State {
    kStale,   ///< objects were registered or unregistered; the next query reads all and builds
    kGrown,   ///< a few objects were registered; the next query builds the young index
    kCloned,  ///< the indexes fit the original's objects; the next query reads all and refits
    kReady,   ///< the indexes may be searched
    kFailed,  ///< the last update failed; the indexes may be inconsistent
  };

  /// Those of some objects that are managed.
  struct Found {
    std::vector<SegmentId> ids;
    std::vector<std::size_t> positions;  ///< of each id, among the objects
  };

  explicit ManagedObjects(const fibers::NeighborRule& rule) : registry_(rule) {}
  ~ManagedObjects() = default;

  /// Reads what is not up to date and makes it ready.
  virtual void catchUp(const char* call) const = 0;

  void refuseDuringQuery(const char* call) const {
    if (running_queries_ > 0) fibers::throwQueryRuns(call);
  }
  /// See ObjectRegistry. Throws std::invalid_argument if an object is repeated or managed, or if
  /// there are too many.
  void addToRegistry(const char* call, const Objects& added, const std::vector<bool>& starts_fiber,
                     const Kind& kind, const std::vector<double>& lengths);
  /// Throws std::invalid_argument if an object is null.
  Found findManaged(const char* call, const Objects& objects) const;
  /// One sweep over all nodes costs less than the way up from each of many segments.
  bool areMany(const std::vector<SegmentId>& ids) const {
    return 4 * ids.size() > registry_.size();
  }

  bool hasTree() const {
    return state_ == State::kReady || state_ == State::kGrown || state_ == State::kCloned;
  }
  void markStale() {
    if (hasTree()) state_ = State::kStale;
  }

  Registry registry_;
  // The first query after registering builds the indexes, on whichever thread it runs.
  mutable std::mutex build_mutex_;
  mutable std::atomic<State> state_{State::kStale};

 private:
  void makeReady(const char* call) const;

  mutable std::atomic<int> running_queries_{0};
};

/// Several threads may query first; one of them builds.
template <typename S, class O>
void ManagedObjects<S, O>::makeReady(const char* call) const {
  if (state_.load(std::memory_order_acquire) == State::kReady) return;
  const std::lock_guard<std::mutex> lock(build_mutex_);
  if (state_ == State::kReady) return;
  if (state_ == State::kFailed) {
    fibers::throwInvalidArgument(
        call, "the last update failed; repair the object that it named and call update()");
  }
  catchUp(call);
}

template <typename S, class O>
SegmentId ManagedObjects<S, O>::managedId(const char* call, const Object* object,
                                          const std::string& name) const {
  if (object == nullptr) {
    fibers::throwInvalidArgument(call, name + " is null; pass a registered object");
  }
  const SegmentId id = registry_.find(object);
  if (id == Registry::kNotFound) {
    fibers::throwInvalidArgument(call, name + " is not registered; register it first");
  }
  return id;
}

template <typename S, class O>
void ManagedObjects<S, O>::addToRegistry(const char* call, const Objects& added,
                                         const std::vector<bool>& starts_fiber, const Kind& kind,
                                         const std::vector<double>& lengths) {
  constexpr auto kMost = static_cast<std::size_t>(std::numeric_limits<SegmentId>::max()) / 2;
  if (added.size() > kMost - registry_.objects().size()) {
    fibers::throwInvalidArgument(call,
                                 "a manager holds at most 2^30 - 1 objects; use several managers");
  }
  if (const auto duplicate = registry_.add(added, starts_fiber, kind, lengths)) {
    fibers::throwInvalidArgument(
        call, nameOf(*duplicate) + " is registered already; register each object once");
  }
}

template <typename S, class O>
typename ManagedObjects<S, O>::Found ManagedObjects<S, O>::findManaged(
    const char* call, const Objects& objects) const {
  Found found;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (objects[i] == nullptr) {
      fibers::throwInvalidArgument(call, nameOf(i) + " is null; pass registered objects");
    }
    const SegmentId id = registry_.find(objects[i]);
    if (id == Registry::kNotFound) continue;
    found.ids.push_back(id);
    found.positions.push_back(i);
  }
  return found;
}

}  // namespace fcl_fibers::broadphase
