// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/continuous_state.h"

#include <atomic>
#include <optional>
#include <utility>

#include "broadphase/motion_bounds.h"
#include "broadphase/new_objects.h"

namespace fcl_fibers::broadphase {

using fibers::throwInvalidArgument;
using MovingSegments = ContinuousIndex::MovingSegments;

template <typename S>
ContinuousState<S>::ContinuousState(const FiberOptions& options)
    : Base(fibers::neighborRule(options)),
      options_(options),
      index_(fibers::indexOptions(options, /*wrapped_spheres=*/false)) {}

// --- Registering ---

template <typename S>
void ContinuousState<S>::add(const char* call, const Objects& added, const Kind& kind) {
  refuseDuringQuery(call);
  std::vector<bool> starts_fiber(added.size(), !kind.has_neighbors);
  if (!added.empty()) starts_fiber[0] = true;
  std::vector<double> lengths(options_.ignored_arc_length > 0 ? added.size() : 0);
  for (std::size_t i = 0; i < added.size(); ++i) {
    const auto name = [i] { return nameOf(i); };
    if (added[i] == nullptr) {
      throwInvalidArgument(call, name() + " is null; pass a pointer to an object");
    }
    // The build reads it again, because it may have changed by then.
    readMoving(call, *added[i], name);
    const std::optional<double> length = lengthInFiber(*added[i]->collisionGeometry());
    if (kind.has_neighbors && !length) {
      throwInvalidArgument(
          call, name() + " is not a capsule, cylinder or box; register it by registerObject()");
    }
    if (!lengths.empty()) lengths[i] = length.value_or(0);
  }
  this->addToRegistry(call, added, starts_fiber, kind, lengths);
  if (!added.empty()) markStale();
}

template <typename S>
void ContinuousState<S>::remove(const char* call, const Object* object) {
  refuseDuringQuery(call);
  this->managedId(call, object, "object");
  const bool keeps_ids = registry_.remove(object);
  ++removed_;
  if (!keeps_ids || removed_ > registry_.size() / 8) markStale();
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
void ContinuousState<S>::update(const char* call) {
  refuseDuringQuery(call);
  const bool is_built = state_ == State::kReady;
  state_ = State::kFailed;
  if (!is_built || !index_.refit(readAll(call))) return catchUp(call);
  state_ = State::kReady;
}

template <typename S>
void ContinuousState<S>::update(const char* call, const Objects& moved) {
  refuseDuringQuery(call);
  const auto [ids, positions] = this->findManaged(call, moved);
  if (ids.empty()) return;
  if (state_ != State::kReady || this->areMany(ids)) return update(call);
  state_ = State::kFailed;
  MovingSegments segments(ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const std::size_t position = positions[i];
    segments[i] = readMoving(call, *moved[position], [&] { return nameOf(position); });
  }
  if (!index_.refitSome(ids, segments)) return catchUp(call);
  state_ = State::kReady;
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
  readMoving(call, *registry_[id], [&] { return nameOf(objects, id); });
  // If the object can be read now, another thread has changed it meanwhile.
  throwInvalidArgument(call, "an object has changed during the call; change objects after it");
}

template <typename S>
void ContinuousState<S>::catchUp(const char* call) const {
  index_.build(readAll(call), registry_.fibersFrom(0, [](SegmentId) { return true; }));
  removed_ = 0;
  state_.store(State::kReady, std::memory_order_release);
}

template <typename S>
std::size_t ContinuousState<S>::memoryUsage() const {
  const std::lock_guard<std::mutex> lock(build_mutex_);  // a first query may be building
  return sizeof(*this) + registry_.memoryUsage() + index_.memoryUsage();
}

template class ContinuousState<float>;
template class ContinuousState<double>;

}  // namespace fcl_fibers::broadphase
