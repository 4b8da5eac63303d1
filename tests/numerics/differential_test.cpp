// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/differential.h"

#include <gtest/gtest.h>

namespace fcl_fibers::test {
namespace {

// A pair would be missed, come twice, or be reported though it is too far apart, in some scene that
// nobody thought of.
TEST(Differential, AgreesWithBruteForce) {
  const Tally tally = differWhile([](const Tally& so_far) { return so_far.decisions < 10'000'000; },
                                  600, 1, HairFiles::none());
  EXPECT_EQ(tally.wrong, 0u) << tally.first_wrong;
  EXPECT_GT(tally.touching, 10'000u);
  EXPECT_GT(tally.within_radius, 10'000u);
  EXPECT_GT(tally.at_contact, 1'000u);
}

}  // namespace
}  // namespace fcl_fibers::test
