// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <set>
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

/// What has come, each pair once.
template <typename S>
auto asSet(const Calls<S>& calls) {
  const std::set<typename Calls<S>::value_type> set(calls.begin(), calls.end());
  EXPECT_EQ(set.size(), calls.size()) << "a pair comes twice";
  return set;
}

/// The same by the places of the objects in a list, the first one first.
template <typename S>
std::set<std::pair<std::size_t, std::size_t>> numbersOf(
    const Calls<S>& calls, const std::vector<fcl::CollisionObject<S>*>& all) {
  std::set<std::pair<std::size_t, std::size_t>> numbers;
  for (const auto& [a, b] : calls) {
    const auto numberOf = [&](const auto* object) {
      return static_cast<std::size_t>(std::find(all.begin(), all.end(), object) - all.begin());
    };
    EXPECT_TRUE(numbers.insert(std::minmax(numberOf(a), numberOf(b))).second);
  }
  return numbers;
}

/// What a manager is asked about: itself, one object, or another manager and the objects in it.
template <typename S>
struct QueryPartner {
  using Object = fcl::CollisionObject<S>;
  using Manager = fcl::BroadPhaseCollisionManager<S>;

  QueryPartner() = default;
  QueryPartner(Object* one) : object(one), objects{one} {}
  QueryPartner(Manager& other, std::vector<Object*> others)
      : manager(&other), objects(std::move(others)) {}
  QueryPartner(Manager& other) : manager(&other) { other.getObjects(objects); }

  bool isSelf() const { return object == nullptr && manager == nullptr; }

  void collide(const Manager& asked, void* data, fcl::CollisionCallBack<S> callback) const {
    if (manager != nullptr) return asked.collide(manager, data, callback);
    if (object != nullptr) return asked.collide(object, data, callback);
    asked.collide(data, callback);
  }
  void distance(const Manager& asked, void* data, fcl::DistanceCallBack<S> callback) const {
    if (manager != nullptr) return asked.distance(manager, data, callback);
    if (object != nullptr) return asked.distance(object, data, callback);
    asked.distance(data, callback);
  }

  Object* object = nullptr;
  Manager* manager = nullptr;
  std::vector<Object*> objects;
};

}  // namespace fcl_fibers::test
