// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/meshes.h"
#include "arrays/motion.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

template <typename S>
class SafeStepOf : public testing::Test {};
TYPED_TEST_SUITE(SafeStepOf, Scalars, ScalarName);

/// If nothing touches at the start, the safe step ends at the first impact.
TYPED_TEST(SafeStepOf, TheSafeStepEndsAtTheFirstImpact) {
  using S = TypeParam;
  int with_impacts = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    auto motion = Motion<S>::random(seed, 12, 0.05);
    for (auto* fibers : {&motion.start, &motion.end}) {
      for (S& radius : fibers->radii) radius *= S(0.02);
    }
    const FiberTree tree = treeOf(motion, capsules());
    double first = 1;
    bool touches_at_start = false;
    for (const auto& [pair, impact] : impactsOf(tree)) {
      touches_at_start |= impact.time == 0;
      first = std::min(first, impact.time);
    }
    if (touches_at_start) continue;
    with_impacts += first < 1;
    // Both may be early by 2^-36 of a pair's size, however slowly the pair closes.
    EXPECT_NEAR(tree.safeStep(), first, 1e-8);
  }
  EXPECT_GT(with_impacts, 5);
}

/// What touches at the start counts once it is nearer than there.
TEST(SafeStep, WhatSeparatesDoesNotShortenTheSafeStep) {
  const auto pairOf = [](double start, double end) {
    Motion<double> motion;
    motion.start.addFiber({{0, 0, 0}, {1, 0, 0}}, 0.1);
    motion.start.addFiber({{0, start, 0}, {1, start, 0}}, 0.1);
    motion.end = motion.start;
    motion.end.points[7] = motion.end.points[10] = end;
    return treeOf(motion, capsules());
  };
  EXPECT_EQ(pairOf(0.15, 0.3).safeStep(), 1);
  EXPECT_EQ(pairOf(0.15, 0.15).safeStep(), 1);
  EXPECT_LT(pairOf(0.15, 0.1).safeStep(), 1e-6);
  EXPECT_NEAR(pairOf(0.3, 0.1).safeStep(), 0.5, 1e-8);
  // It passes through the other one and is as near as before on the other side.
  EXPECT_LT(pairOf(0.15, -0.15).safeStep(), 1e-6);
}

}  // namespace
}  // namespace fcl_fibers::test
