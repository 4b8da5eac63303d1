// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fcl/broadphase/broadphase_collision_manager.h>

namespace fcl_fibers::test {

/// What a manager passed to its callback, in order.
template <typename S>
using Calls = std::vector<std::pair<fcl::CollisionObject<S>*, fcl::CollisionObject<S>*>>;

/// What a test's callback throws, so that nothing else is mistaken for it.
struct CallbackError : std::runtime_error {
  CallbackError() : std::runtime_error("thrown by the callback") {}
};

constexpr std::size_t kNever = std::numeric_limits<std::size_t>::max();

/// Records collision callbacks.
template <typename S>
struct PairCollector {
  Calls<S> calls;
  std::size_t stop_at = kNever;   ///< the call, counted from 1, that returns true
  std::size_t throw_at = kNever;  ///< the call that throws CallbackError

  static bool collide(fcl::CollisionObject<S>* a, fcl::CollisionObject<S>* b, void* data) {
    auto& self = *static_cast<PairCollector*>(data);
    self.calls.emplace_back(a, b);
    if (self.calls.size() == self.throw_at) throw CallbackError();
    return self.calls.size() == self.stop_at;
  }
};

template <typename S>
Calls<S> selfPairs(const fcl::BroadPhaseCollisionManager<S>& manager) {
  PairCollector<S> collector;
  manager.collide(&collector, &PairCollector<S>::collide);
  return collector.calls;
}

/// Partner is an object or a manager.
template <typename S, typename Partner>
Calls<S> pairsWith(const fcl::BroadPhaseCollisionManager<S>& manager, Partner& partner) {
  PairCollector<S> collector;
  manager.collide(&partner, &collector, &PairCollector<S>::collide);
  return collector.calls;
}

}  // namespace fcl_fibers::test
