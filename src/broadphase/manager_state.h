// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_collision_manager.h>

#include "broadphase/generations.h"
#include "broadphase/object_registry.h"
#include "broadphase/object_source.h"
#include "broadphase/obstacles.h"
#include "fibers/options.h"
#include "live/live_list.h"

namespace fcl_fibers::broadphase {

/// How many of the first segments of a fiber meet no obstacle. Throws std::invalid_argument if an
/// option is out of range. Objects that registering will refuse count as of length 0.
template <typename S>
SegmentId rootsOf(const char* call, const std::vector<fcl::CollisionObject<S>*>& fiber,
                  const FiberObstacles& obstacles);

/// The registered objects of a manager and the indexes over them. The first query or update after a
/// change brings the indexes up to date.
///
/// Queries are const and may run at the same time. Calls that change the manager throw while a
/// query runs. `call` names the public function in error texts.
template <typename S>
class ManagerState {
 public:
  using Scalar = S;
  using Registry = ObjectRegistry<S>;
  using Object = typename Registry::Object;
  using Objects = std::vector<Object*>;
  using Kind = typename Registry::Kind;
  using Source = ObjectSource<S>;

  ManagerState(bool wrapped_spheres, const FiberManagerOptions& options);

  /// Copies `original` for these objects. Queries of the original may run meanwhile.
  ManagerState(const char* call, const ManagerState& original, const Objects& objects);

  void add(const char* call, const Objects& added, const Kind& kind,
           const std::vector<FiberJoint<Object>>& joints = {});
  void remove(const char* call, const Object* object);
  void clear(const char* call);

  /// Reads all objects, and renews the list if there is one.
  void update(const char* call);
  void update(const char* call, const Objects& moved);
  void setup(const char* call) {
    if (state_ == State::kReady) return;
    refuseDuringQuery(call);
    catchUp(call, state_);
  }

  /// Brings the indexes up to date and forbids changes while a query runs.
  class QueryScope {
   public:
    QueryScope(const ManagerState& state, const char* call) : state_(state) {
      ++state_.running_queries_;
      try {
        state_.makeReady(call);
      } catch (...) {
        --state_.running_queries_;
        throw;
      }
    }
    ~QueryScope() { --state_.running_queries_; }
    QueryScope(const QueryScope&) = delete;
    QueryScope& operator=(const QueryScope&) = delete;

   private:
    const ManagerState& state_;
  };

  /// Begins a step at the objects as they were read last, or ends it. To begin one reads what has
  /// not been read.
  void setStep(const char* call, bool begins);

  const Registry& registry() const { return registry_; }
  /// The id of an object. Throws with `name` if the object is null or not registered.
  SegmentId managedId(const char* call, const Object* object, const std::string& name) const;
  const FiberManagerOptions& options() const { return options_; }
  /// @pre a QueryScope exists
  const Generations& generations() const { return generations_; }
  const geometry::Frame& frame() const { return generations_.frame(); }
  /// @pre a QueryScope exists
  const Obstacles<S>& obstacles() const { return obstacles_; }

  /// A mesh in the frame of the indexes, during the step. See BesideEntry::moving().
  std::shared_ptr<const index::PosedMesh> movingMesh(
      const typename Obstacles<S>::BesideEntry& entry) const {
    return entry.moving(frame(), generations_.executor());
  }

  /// Reads the objects as they are now.
  Source source(const char* call) const {
    return {call, registry_.objects(), options_.bounds, &obstacles_.beside().ids(),
            countsTriangles(options_)};
  }

  /// The triangles of an object as they were read last, or null. Another thread may be making the
  /// first query.
  std::shared_ptr<const Mesh> knownMesh(const Object& object) const;

  /// @name The list
  /// It is as of the last update() of all objects.
  ///@{
  /// Throws if the manager has none.
  const live::LiveList& live(const char* call) const;
  /// Replaces the content of `pairs` by the entries that have a slot, with objects in place of ids.
  template <class Entries>
  void name(const Entries& entries, std::vector<LiveObjectPair<S>>& pairs) const {
    pairs.clear();
    for (const live::LiveList::Entry& entry : entries) {
      if (entry.slot < 0) continue;
      pairs.push_back({listedObject(entry.pair.a), listedObject(entry.pair.b), entry.slot});
    }
  }
  ///@}

  bool movedSinceUpdate() const;
  std::size_t memoryUsage() const;

 private:
  enum class State {
    kStale,   ///< objects were registered or unregistered; the next query reads all and builds
    kGrown,   ///< a few objects were registered; the next query builds the young index
    kUnread,  ///< the indexes are the original's; the next query reads all and refits
    kRead,    ///< all is read; the next query builds the young index of what is in young_
    kReady,   ///< the indexes may be searched, and perhaps have been
    kFailed,  ///< the last update failed; the indexes may be inconsistent
  };

  /// The objects by the ids that they had at the last update() of the list, and their ids now.
  struct LastIds {
    Objects objects;
    std::vector<SegmentId> now;
  };
  class OwnPairing;

  std::vector<fibers::Joint> jointsOf(const char* call, const Objects& fiber,
                                      const std::vector<FiberJoint<Object>>& joints) const;
  void readAll(const char* call, bool keeps_tree);
  void renewList();
  void keepLastIds();
  SegmentId idNow(SegmentId last) const;
  Object* listedObject(SegmentId id) const {
    if (id < 0) return ended_[static_cast<std::size_t>(~id)];
    return last_ids_ ? last_ids_->objects[static_cast<std::size_t>(id)] : registry_[id];
  }

  void refuseDuringQuery(const char* call) const {
    if (running_queries_ > 0) fibers::throwQueryRuns(call);
  }
  static bool hasTree(State state) { return state != State::kStale && state != State::kFailed; }
  bool hasTree() const { return hasTree(state_); }
  void markStale() {
    if (hasTree()) state_ = State::kStale;
  }
  bool hasTooManyYoung() const;
  bool hasFewUnread() const;
  bool readYoung(const Source& source) const;
  tree::Fibers segmentsFrom(SegmentId begin) const;
  void requireMesh(const Objects& objects, std::size_t i, bool is_solid);
  void makeReady(const char* call) const;
  void catchUp(const char* call, State state, bool builds_young = true) const;

  const FiberManagerOptions options_;
  Registry registry_;
  std::optional<geometry::Segment> last_registered_;  ///< a capsule that the next object may
                                                      ///< continue
  /// Objects removed since the build. The indexes still have them.
  mutable std::size_t removed_ = 0, removed_young_ = 0;

  // Queries catch up, on whichever thread they run.
  mutable std::mutex build_mutex_;
  mutable std::atomic<State> state_{State::kStale};
  mutable std::atomic<int> running_queries_{0};
  mutable Generations generations_;
  /// The segments from youngBegin() on, as an update has read them before their index is built.
  mutable std::vector<geometry::Segment> young_;
  mutable Obstacles<S> obstacles_;

  std::optional<live::LiveList> live_;
  std::optional<LastIds> last_ids_;  ///< if an object has gone since the last update() of the list
  Objects ended_;                    ///< those of the update() before it, if one had gone
  /// SegmentIndex::buildCount() and frame() of that update().
  ///@{
  std::size_t listed_build_ = 0;
  geometry::Frame listed_frame_;
  ///@}
};

extern template class ManagerState<float>;
extern template class ManagerState<double>;

}  // namespace fcl_fibers::broadphase
