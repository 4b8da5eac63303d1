// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/continuous_state.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "broadphase/motion_bounds.h"
#include "broadphase/new_objects.h"
#include "fibers/options.h"

namespace fcl_fibers::broadphase {

using fibers::throwInvalidArgument;
using geometry::MovingSegment;
using MovingSegments = ContinuousIndex::MovingSegments;

namespace {

template <typename S, class Name>
MovingSegment read(const char* call, const fcl::ContinuousCollisionObject<S>& object,
                   const Name& name) {
  MovingSegment moving;
  if (const char* problem = readMoving(object, moving)) {
    throwInvalidArgument(call, name() + ": " + problem);
  }
  return moving;
}

}  // namespace

template <typename S>
ContinuousState<S>::ContinuousState(const FiberOptions& options)
    : options_(options),
      registry_(fibers::neighborRule(options)),
      index_(fibers::indexOptions(options, /*wrapped_spheres=*/false)) {}

// --- Registering ---

template <typename S>
void ContinuousState<S>::add(const char* call, const Objects& added,
                             const typename Registry::Kind& kind) {
  refuseDuringQuery(call);
  if (added.size() > static_cast<std::size_t>(std::numeric_limits<SegmentId>::max()) / 2 -
                         registry_.objects().size()) {
    throwInvalidArgument(call, "a manager holds at most 2^30 - 1 objects; use several managers");
  }
  std::vector<bool> starts_fiber(added.size(), !kind.has_neighbors);
  if (!added.empty()) starts_fiber[0] = true;
  std::vector<double> lengths(options_.ignored_arc_length > 0 ? added.size() : 0);
  for (std::size_t i = 0; i < added.size(); ++i) {
    const auto name = [i] { return broadphase::nameOf(i); };
    if (added[i] == nullptr) {
      throwInvalidArgument(call, name() + " is null; pass a pointer to an object");
    }
    // The build reads it again, because it may have changed by then.
    read(call, *added[i], name);
    const std::optional<double> length = lengthInFiber(*added[i]->collisionGeometry());
    if (kind.has_neighbors && !length) {
      throwInvalidArgument(
          call, name() + " is not a capsule, cylinder or box; register it by registerObject()");
    }
    if (!lengths.empty()) lengths[i] = length.value_or(0);
  }
  if (const auto duplicate = registry_.add(added, starts_fiber, kind, lengths)) {
    throwInvalidArgument(
        call, broadphase::nameOf(*duplicate) + " is registered already; register each object once");
  }
  if (!added.empty() && state_ == State::kReady) state_ = State::kStale;
}

template <typename S>
void ContinuousState<S>::remove(const char* call, const Object* object) {
  refuseDuringQuery(call);
  managedId(call, object, "object");
  const bool keeps_ids = registry_.remove(object);
  ++removed_;
  const bool pays = !keeps_ids || removed_ > registry_.size() / 8;
  if (pays && state_ == State::kReady) state_ = State::kStale;
  if (registry_.size() == 0) state_ = State::kStale;  // no object is left that could be refused
}

template <typename S>
void ContinuousState<S>::clear(const char* call) {
  refuseDuringQuery(call);
  registry_.clear();
  index_.clear();
  state_ = State::kStale;
}

// --- Reading the objects ---

template <typename S>
void ContinuousState<S>::setup(const char* call) {
  if (state_ == State::kReady) return;
  refuseDuringQuery(call);
  readAndBuild(call);
}

template <typename S>
void ContinuousState<S>::update(const char* call) {
  refuseDuringQuery(call);
  const bool is_built = state_ == State::kReady;
  state_ = State::kFailed;
  if (!is_built || !index_.refit(readAll(call))) return readAndBuild(call);
  state_ = State::kReady;
}

template <typename S>
void ContinuousState<S>::update(const char* call, const Objects& moved) {
  refuseDuringQuery(call);
  std::vector<SegmentId> ids;
  std::vector<std::size_t> positions;
  for (std::size_t i = 0; i < moved.size(); ++i) {
    if (moved[i] == nullptr) {
      throwInvalidArgument(call, broadphase::nameOf(i) + " is null; pass registered objects");
    }
    const SegmentId id = registry_.find(moved[i]);
    if (id == Registry::kNotFound) continue;
    ids.push_back(id);
    positions.push_back(i);
  }
  if (ids.empty()) return;
  // One sweep over all nodes costs less than the way up from each of many segments.
  if (state_ != State::kReady || 4 * ids.size() > registry_.size()) return update(call);
  state_ = State::kFailed;
  MovingSegments segments(ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    segments[i] = read(call, *registry_[ids[i]], [&] { return broadphase::nameOf(positions[i]); });
  }
  if (!index_.refitSome(ids, segments)) return readAndBuild(call);
  state_ = State::kReady;
}

template <typename S>
void ContinuousState<S>::refuseDuringQuery(const char* call) const {
  if (running_queries_ == 0) return;
  throwInvalidArgument(call, "a query is running; make the change after the query has ended");
}

/// Several threads may query first; one of them builds.
template <typename S>
void ContinuousState<S>::makeReady(const char* call) const {
  if (state_.load(std::memory_order_acquire) == State::kReady) return;
  const std::lock_guard<std::mutex> lock(build_mutex_);
  if (state_ == State::kReady) return;
  if (state_ == State::kFailed) {
    throwInvalidArgument(
        call, "the last update failed; repair the object that it named and call update()");
  }
  readAndBuild(call);
}

template <typename S>
MovingSegments ContinuousState<S>::readAll(const char* call) const {
  const Objects& objects = registry_.objects();
  MovingSegments moving(objects.size());
  std::atomic<std::size_t> first_refused{objects.size()};
  constexpr std::size_t kGrain = 256;
  index_.forRanges(objects.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (objects[i] == nullptr) {
        // The index has it still, unless it is about to be built.
        if (i < index_.moving().size()) moving[i] = index_.moving()[i];
        continue;
      }
      if (readMoving(*objects[i], moving[i]) == nullptr) continue;
      std::size_t first = first_refused;
      while (i < first && !first_refused.compare_exchange_weak(first, i)) {
      }
    }
  });
  if (first_refused == objects.size()) return moving;
  const auto id = static_cast<SegmentId>(first_refused.load());
  read(call, *registry_[id], [&] { return nameOf(id); });
  // If the object can be read now, another thread has changed it meanwhile.
  throwInvalidArgument(call, "an object has changed during the call; change objects after it");
}

template <typename S>
void ContinuousState<S>::readAndBuild(const char* call) const {
  index_.build(readAll(call), registry_.fibersFrom(0, [](SegmentId) { return true; }));
  removed_ = 0;
  state_.store(State::kReady, std::memory_order_release);
}

template <typename S>
std::string ContinuousState<S>::nameOf(SegmentId id) const {
  const auto begin = registry_.objects().begin();
  return "object " + std::to_string(id - std::count(begin, begin + id, nullptr)) +
         " in order of registration";
}

// --- Asking ---

template <typename S>
ContinuousState<S>::QueryScope::QueryScope(const ContinuousState& state, const char* call)
    : state_(state) {
  ++state_.running_queries_;
  try {
    state_.makeReady(call);
  } catch (...) {
    --state_.running_queries_;
    throw;
  }
}

template <typename S>
std::unique_ptr<ContinuousIndex> ContinuousState<S>::indexOf(const char* call,
                                                             const Objects& objects,
                                                             const Name& name) const {
  MovingSegments moving(objects.size());
  tree::Fibers fibers;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (objects[i] == nullptr) {
      throwInvalidArgument(call, name(i) + " is null; remove it from that manager");
    }
    moving[i] = read(call, *objects[i], [&] { return name(i); });
    fibers.ids.push_back(static_cast<SegmentId>(i));
    fibers.endFiber();
  }
  index::IndexOptions options = index_.options();
  if (objects.size() == 1) options.threads = 1;
  auto result = std::make_unique<ContinuousIndex>(options);
  result->build(std::move(moving), fibers, index_.frame());
  return result;
}

template <typename S>
SegmentId ContinuousState<S>::managedId(const char* call, const Object* object,
                                        const std::string& name) const {
  if (object == nullptr) throwInvalidArgument(call, name + " is null; pass a registered object");
  const SegmentId id = registry_.find(object);
  if (id == Registry::kNotFound) {
    throwInvalidArgument(call, name + " is not registered; register it first");
  }
  return id;
}

template class ContinuousState<float>;
template class ContinuousState<double>;

}  // namespace fcl_fibers::broadphase
