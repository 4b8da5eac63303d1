// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/impact_decisions.h"

#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/impact_oracle.h"

namespace fcl_fibers::test {
namespace {

class ImpactDecisions : public testing::TestWithParam<std::size_t> {};

// An impact would be missed or found too late, or be reported of what does not touch.
TEST_P(ImpactDecisions, AreThoseOfTheOracle) {
  for (const ImpactShape shape : {ImpactShape::kCapsules, ImpactShape::kTriangle}) {
    const auto kind = static_cast<int>(GetParam());
    const ImpactTally tally = decideImpacts(shape, kind, 1000, 1);
    EXPECT_EQ(tally.late, 0u) << tally.first_wrong;
    EXPECT_EQ(tally.early, 0u) << tally.first_wrong;
    EXPECT_EQ(tally.misplaced, 0u) << tally.first_wrong;
    EXPECT_GT(tally.impacts, 300u);
    EXPECT_LT(tally.impacts, 1000u);
    // What double leaves open is decided as well.
    EXPECT_EQ(decideImpacts(shape, kind, 10, 2, /*exact=*/true).wrong(), 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, ImpactDecisions,
                         testing::Range(std::size_t{0}, impactKinds().size()),
                         [](const testing::TestParamInfo<std::size_t>& info) {
                           return impactKinds()[info.param];
                         });

// The table that users read would be of another commit.
TEST(ImpactDecisions, TableIsThatOfTheDocument) {
  std::ifstream file(FCL_FIBERS_SOURCE_DIR "/docs/numerics/impacts.csv");
  std::ostringstream document;
  document << file.rdbuf();
  EXPECT_EQ(document.str(), impactsTable());
}

/// Two segments that cross each other at 1 apart and come together with speed 2.
GivenMotion crossing() {
  GivenMotion motion;
  motion.start = {{{{-1, 0, 1}, {1, 0, 1}}}, {{{0, -1, 0}, {0, 1, 0}, {}}}};
  motion.end = {{{{-1, 0, -1}, {1, 0, -1}}}, {{{0, -1, 0}, {0, 1, 0}, {}}}};
  return motion;
}

// The judge of all this would take a near miss for contact.
TEST(ImpactOracleTest, KnowsContactToTheLastBit) {
  GivenMotion motion = crossing();
  for (const bool exact : {false, true}) {
    // At z = 1 - 2 t.
    EXPECT_TRUE(ImpactOracle::withinAt(motion, 0.5, exact).certain);
    EXPECT_FALSE(ImpactOracle::withinAt(motion, 0.5 - 0x1p-54, exact).certain);
    EXPECT_TRUE(ImpactOracle::apartDuring(motion, 0, 0.5 - 0x1p-54, exact).certain);
    EXPECT_FALSE(ImpactOracle::apartDuring(motion, 0, 0.5, exact).certain);
    EXPECT_FALSE(ImpactOracle::apartDuring(motion, 0, 1, exact).certain);
    EXPECT_TRUE(ImpactOracle::apartDuring(motion, 0.5 + 0x1p-53, 1, exact).certain);
  }
  motion.margin = 0.5;
  EXPECT_TRUE(ImpactOracle::withinAt(motion, 0.25).certain);
  EXPECT_FALSE(ImpactOracle::withinAt(motion, 0.25 - 0x1p-54).certain);
  motion.margin = 0;
  motion.start.radii = {0.25, 0.25};
  EXPECT_FALSE(ImpactOracle::withinAt(motion, 1.0 / 3).certain) << "1/3 is rounded down";
  EXPECT_TRUE(ImpactOracle::withinAt(motion, 1.0 / 3 + 0x1p-53).certain);
  EXPECT_TRUE(ImpactOracle::apartDuring(motion, 0, 1.0 / 3 - 0x1p-48).certain);
}

// A triangle would be judged by its first edge.
TEST(ImpactOracleTest, KnowsTheInsideAndAllEdgesOfATriangle) {
  GivenMotion motion;
  motion.corners = 3;
  const std::array<std::array<double, 3>, 3> triangle = {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}};
  for (const double x : {-1, 0, 1, 2, 3}) {
    for (const double y : {-1, 0, 1, 2, 3}) {
      motion.start = {{{{x, y, 3}, {x, y, 2}}}, triangle};
      motion.end = {{{{x, y, 1}, {x, y, 0}}}, triangle};
      const bool meets = x >= 0 && y >= 0 && x + y <= 4;
      EXPECT_EQ(ImpactOracle::apartDuring(motion, 0, 1).certain, !meets) << x << ' ' << y;
      EXPECT_EQ(ImpactOracle::withinAt(motion, 1).certain, meets);
      EXPECT_FALSE(ImpactOracle::withinAt(motion, 1 - 0x1p-53).certain);
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::test
