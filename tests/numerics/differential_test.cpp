// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/differential.h"

#include <gtest/gtest.h>

namespace fcl_fibers::test {
namespace {

// A pair would be missed, come twice, or be reported though it is too far apart, in some scene that
// nobody thought of.
TEST(Differential, AgreesWithBruteForce) {
  const HairFiles hair = HairFiles::find();
  const Tally tally =
      differWhile([](const Tally& so_far) { return so_far.decisions < 10'000'000; }, 600, 1, hair);
  EXPECT_EQ(tally.wrong, 0u) << tally.first_wrong;
  EXPECT_GT(tally.touching, 10'000u);
  EXPECT_GT(tally.within_radius, 10'000u);
  EXPECT_GT(tally.at_contact, 1'000u);
}

// As above, in real hair.
TEST(Differential, AgreesWithBruteForceInHair) {
  const HairFiles hair = HairFiles::find();
  if (hair.empty()) {
    GTEST_SKIP() << "no .tfx file is there; FCL_FIBERS_DATA names the directory to look in";
  }
  Tally tally;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    differ<float>(RandomKind::kHair, 600, seed, Form::kObjects, hair, tally);
    differ<double>(RandomKind::kHair, 600, seed, Form::kArrays, hair, tally);
  }
  EXPECT_EQ(tally.wrong, 0u) << tally.first_wrong;
  EXPECT_GT(tally.touching, 1'000u);
}

}  // namespace
}  // namespace fcl_fibers::test
