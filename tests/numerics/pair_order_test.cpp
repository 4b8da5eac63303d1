// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/pair_order.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "support/random.h"

namespace fcl_fibers::test {
namespace {

// Programs that depend on the order of contacts, as most solvers do, could not be run twice. Other
// instruction sets, compilers and levels of optimization are compared by the scripts, which have
// fcl_fibers_numerics_run print these hashes.
TEST(PairOrder, IsTheSameFromRunToRunForAnyNumberOfThreadsAndAnyAddresses) {
  const std::vector<OrderHash> once = orderHashes(1);
  for (const int threads : {1, 2, 5}) {
    // What is allocated next is elsewhere and in another order.
    Random random(static_cast<std::uint64_t>(threads));
    std::vector<std::unique_ptr<char[]>> clutter(2000);
    for (auto& block : clutter) block = std::make_unique<char[]>(1 + random.below(2000));
    random.shuffle(clutter);
    clutter.resize(1000);

    const std::vector<OrderHash> again = orderHashes(threads);
    ASSERT_EQ(again.size(), once.size());
    for (std::size_t i = 0; i < once.size(); ++i) {
      ASSERT_EQ(again[i].capsules, once[i].capsules) << once[i].scene;
      EXPECT_EQ(again[i].pairs, once[i].pairs) << once[i].scene << ", " << threads << " threads";
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::test
