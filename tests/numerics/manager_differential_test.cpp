// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/manager_differential.h"

#include <gtest/gtest.h>

namespace fcl_fibers::test {
namespace {

// Two features that are right by themselves would not be so together.
TEST(ManagerDifferential, AgreesWithBruteForce) {
  constexpr std::uint64_t kScenes = 1000, kSeed = 2;
  ManagerTally tally;
  for (std::uint64_t number = 0; number < kScenes; ++number) {
    EXPECT_EQ(differManagers(kSeed, number, tally), "") << "scene " << number;
  }
  EXPECT_GT(tally.touching, 30'000u);
  EXPECT_GT(tally.apart, 100'000u);
  EXPECT_GT(tally.impacts, 10'000u);
  // Whatever goes together is somewhere together.
  const std::size_t least = tally.leastCovered();
  EXPECT_GT(tally.covered[least], 0u) << nameOf(allTriples()[least]);
}

}  // namespace
}  // namespace fcl_fibers::test
