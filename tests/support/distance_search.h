// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_collision_manager.h>

#include "support/pair_oracle.h"
#include "support/pair_queries.h"

namespace fcl_fibers::test {

/// A distance callback that knows the exact distances, and a record of what it was given.
template <typename S>
struct DistanceSearch {
  explicit DistanceSearch(const PairOracle<S>& truth) : oracle(&truth) {}

  using Manager = fcl::BroadPhaseCollisionManager<S>;

  const PairOracle<S>* oracle;
  bool lowers = true;  ///< false: leaves the distance as it came
  std::size_t stop_at = kNever;
  std::size_t throw_at = kNever;
  Calls<S> calls;
  std::vector<S> received;  ///< the distance at each call
  std::vector<S> left;      ///< the distance after each call

  static bool visit(fcl::CollisionObject<S>* a, fcl::CollisionObject<S>* b, void* data, S& dist) {
    auto& self = *static_cast<DistanceSearch*>(data);
    self.calls.emplace_back(a, b);
    self.received.push_back(dist);
    if (self.calls.size() == self.throw_at) throw CallbackError();
    if (self.lowers) dist = std::min(dist, self.oracle->distance(a, b));
    self.left.push_back(dist);
    return self.calls.size() == self.stop_at;
  }

  /// What was asked for, as run() sees it.
  struct Query {
    std::vector<fcl::CollisionObject<S>*> managed;  ///< in the order of registration
    std::optional<std::vector<fcl::CollisionObject<S>*>> partners;
    bool keeps_promises = false;  ///< of ours: the order of arguments, and each pair is seen
  };
  std::optional<Query> asked;

  void run(const Manager& manager, const QueryPartner<S>& partner = {}) {
    asked = Query{};
    manager.getObjects(asked->managed);
    asked->keeps_promises = dynamic_cast<const FiberCollisionManager<S>*>(&manager) != nullptr;
    if (!partner.isSelf() && partner.manager != &manager) asked->partners = partner.objects;
    partner.distance(manager, this, &visit);
  }

  S result() const { return left.empty() ? std::numeric_limits<S>::max() : left.back(); }

  /// One value per query: max() at first, then what the call before left. Each pair is of those
  /// asked for, their arguments in the order that is promised, and none is repeated, ignored, or of
  /// an object with itself. A search that lowers nothing and runs to its end misses none.
  testing::AssertionResult keepsToTheRules() const {
    std::set<std::pair<const void*, const void*>> seen;
    for (std::size_t i = 0; i < calls.size(); ++i) {
      const auto wrong = [&](const char* what) {
        return testing::AssertionFailure() << "call " << i << ": " << what << " pair";
      };
      const S expected = i == 0 ? std::numeric_limits<S>::max() : left[i - 1];
      if (received[i] != expected) {
        return testing::AssertionFailure() << "call " << i << " was given " << received[i]
                                           << ", the call before had left " << expected;
      }
      const auto [a, b] = calls[i];
      if (!oracle->knows(a) || !oracle->knows(b)) return wrong("unknown");
      if (a == b) return wrong("self");
      if (!seen.insert(std::minmax<const void*>(a, b)).second) return wrong("repeated");
      if (oracle->ignored(a, b)) return wrong("ignored");
      if (!asked) continue;
      const bool is_turned = !isForward(a, b);
      if (is_turned && !isForward(b, a)) return wrong("unasked");
      if (is_turned && asked->keeps_promises) return wrong("turned");
    }
    if (!asked || !asked->keeps_promises || lowers || stop_at != kNever || throw_at != kNever) {
      return testing::AssertionSuccess();
    }
    for (auto* a : asked->managed) {
      for (auto* b : asked->partners ? *asked->partners : asked->managed) {
        if (a == b || oracle->ignored(a, b) || seen.count(std::minmax<const void*>(a, b)) != 0) {
          continue;
        }
        return testing::AssertionFailure() << "missing pair, one of " << oracle->distance(a, b)
                                           << " apart, after " << calls.size() << " calls";
      }
    }
    return testing::AssertionSuccess();
  }

 private:
  bool isForward(const fcl::CollisionObject<S>* a, const fcl::CollisionObject<S>* b) const {
    const auto find = [](const auto& objects, const void* object) {
      return std::find(objects.begin(), objects.end(), object);
    };
    const auto first = find(asked->managed, a);
    if (first == asked->managed.end()) return false;
    if (asked->partners) return find(*asked->partners, b) != asked->partners->end();
    const auto second = find(asked->managed, b);
    return second != asked->managed.end() && first < second;
  }
};

}  // namespace fcl_fibers::test
