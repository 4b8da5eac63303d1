// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/specimen.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace fcl_fibers::test {
namespace {

// A tree that answers wrongly would pass every test of numbers.
TEST(Examine, NamesEachWrongPair) {
  // Five balls in a row, each touching the next.
  std::vector<GivenCapsule> balls;
  for (const double x : {0.0, 1.0, 2.0, 3.0, 4.0}) balls.push_back({{x, 0, 0}, {x, 0, 0}, 0.6});
  const TouchOracle truth(balls);
  const std::vector<NumberPair> touching = touchingPairs(truth);
  EXPECT_EQ(touching, (std::vector<NumberPair>{{0, 1}, {1, 2}, {2, 3}, {3, 4}}));
  for (const FiberTreeOptions& options : allKinds()) {
    const auto wrong = [&](std::vector<NumberPair> reported) {
      const Findings findings = examine(truth, touching, options, std::move(reported));
      EXPECT_EQ(findings.isRight(), findings.first_wrong.empty());
      return findings.first_wrong;
    };
    EXPECT_EQ(wrong({{0, 1}, {1, 2}, {2, 3}, {3, 4}}), "");
    EXPECT_EQ(wrong({{4, 3}, {2, 3}, {1, 0}, {1, 2}}), "") << "neither order nor sense matters";
    EXPECT_EQ(wrong({}), "missed (0, 1)");
    EXPECT_EQ(wrong({{0, 1}, {1, 2}, {3, 4}}), "missed (2, 3)");
    EXPECT_EQ(wrong({{0, 1}, {1, 2}, {2, 3}, {3, 4}, {0, 2}}), "unpromised (0, 2)");
    EXPECT_EQ(wrong({{0, 1}, {1, 2}, {2, 3}, {3, 4}, {1, 2}}), "repeated (1, 2)");
    EXPECT_EQ(wrong({{0, 1}, {1, 2}, {2, 3}, {3, 4}, {2, 1}}), "repeated (1, 2)");
    EXPECT_EQ(wrong({{0, 1}, {1, 2}, {2, 3}, {3, 4}, {2, 2}}), "self (2, 2)");
    EXPECT_EQ(wrong({{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 5}}), "unknown (4, 5)");
    EXPECT_EQ(wrong({{0, 1}, {1, 2}, {2, 3}, {3, 4}, {-1, 2}}), "unknown (-1, 2)");
  }
}

}  // namespace
}  // namespace fcl_fibers::test
