// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "support/pair_oracle.h"
#include "support/pair_queries.h"

namespace fcl_fibers::test {

/// A distance callback that knows the exact distances, and a record of what it was given.
template <typename S>
struct DistanceSearch {
  explicit DistanceSearch(const PairOracle<S>& truth) : oracle(&truth) {}

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

  void run(const fcl::BroadPhaseCollisionManager<S>& manager) { manager.distance(this, &visit); }

  /// Partner is an object or a manager.
  template <typename Partner>
  void run(const fcl::BroadPhaseCollisionManager<S>& manager, Partner& partner) {
    manager.distance(&partner, this, &visit);
  }

  S result() const { return left.empty() ? std::numeric_limits<S>::max() : left.back(); }

  /// One value per query: max() at first, then what the call before left. No pair twice, none of an
  /// object with itself, and none that is ignored.
  testing::AssertionResult keepsToTheRules() const {
    std::set<std::pair<const void*, const void*>> seen;
    for (std::size_t i = 0; i < calls.size(); ++i) {
      const S expected = i == 0 ? std::numeric_limits<S>::max() : left[i - 1];
      if (received[i] != expected) {
        return testing::AssertionFailure() << "call " << i << " was given " << received[i]
                                           << ", the call before had left " << expected;
      }
      const auto [a, b] = calls[i];
      if (a == b) return testing::AssertionFailure() << "call " << i << ": one object twice";
      if (!seen.insert(std::minmax<const void*>(a, b)).second) {
        return testing::AssertionFailure() << "call " << i << " repeats a pair";
      }
      if (oracle->ignored(a, b)) {
        return testing::AssertionFailure() << "call " << i << ": the pair is to be ignored";
      }
    }
    return testing::AssertionSuccess();
  }
};

}  // namespace fcl_fibers::test
