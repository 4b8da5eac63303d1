// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <fcl_fibers/fiber_tree.h>

#include "support/assembly.h"
#include "support/random.h"
#include "support/touch_oracle.h"
#include "support/tree_kinds.h"

namespace fcl_fibers::test {

using PairList = std::vector<std::pair<std::int32_t, std::int32_t>>;  ///< ascending

/// Curled fibers of 1 to 40 points about one place, thick ones among them; some have no point.
template <typename S>
Assembly<S> curledFibers(std::uint64_t seed, int fibers = 30) {
  Random random(seed);
  Assembly<S> assembly;
  for (int f = 0; f < fibers; ++f) {
    Eigen::Vector3d p = random.inCube(0.4);
    for (std::size_t i = f % 7 == 3 ? 0 : 1 + random.below(40); i > 0; --i) {
      assembly.addPoint({p.x(), p.y(), p.z()}, f % 5 == 0 ? 0.05 : 0.005);
      p += random.inCube(0.1);
    }
    assembly.endFiber();
  }
  return assembly;
}

/// Touching pairs, those of neighbours up to `ignored` apart left out.
template <typename S>
PairList touchingPairs(const Assembly<S>& a, const Assembly<S>& b, int ignored, double margin) {
  const bool same = &a == &b;
  std::vector<GivenCapsule> capsules = a.capsules();
  const std::size_t first_of_b = same ? 0 : capsules.size();
  if (!same) {
    for (const GivenCapsule& capsule : b.capsules()) capsules.push_back(capsule);
  }
  const TouchOracle oracle(std::move(capsules));
  PairList pairs;
  std::size_t i = 0;
  a.visitCapsules([&](std::size_t p_fiber, std::size_t p) {
    std::size_t j = first_of_b;
    b.visitCapsules([&](std::size_t q_fiber, std::size_t q) {
      const std::size_t at = j++;
      if (same && q <= p) return;
      if (same && p_fiber == q_fiber && q - p <= static_cast<std::size_t>(ignored)) return;
      if (!oracle.touch(i, at, margin)) return;
      pairs.emplace_back(static_cast<std::int32_t>(p), static_cast<std::int32_t>(q));
    });
    ++i;
  });
  return pairs;
}

/// What `ask` hands to the visitor it is given, each once.
template <class Ask>
PairList pairsFrom(Ask&& ask) {
  PairList pairs;
  ask([&](SegmentPair pair) { pairs.emplace_back(pair.a, pair.b); });
  std::sort(pairs.begin(), pairs.end());
  EXPECT_EQ(std::adjacent_find(pairs.begin(), pairs.end()), pairs.end()) << "a pair came twice";
  return pairs;
}
inline PairList pairsOf(const FiberTree& tree) {
  return pairsFrom([&](auto&& visit) { tree.visit(Pairs{}, visit); });
}
inline PairList pairsOf(const FiberTree& tree, const FiberTree& other) {
  return pairsFrom([&](auto&& visit) { tree.visit(Pairs{}, other, visit); });
}

}  // namespace fcl_fibers::test
