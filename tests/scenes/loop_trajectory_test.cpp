// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/paper_scenes.h"

#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

namespace fcl_fibers::scenes {
namespace {

TEST(LoopTrajectory, IsTheSameOnEveryPlatform) {
  // If this fails, the dynamic assembly is another scene than the one that was measured.
  struct Row {
    std::size_t step;
    Eigen::Vector3d force, torque;
  };
  const Row rows[] = {{1, {1.5e-05, -0.001571, 0.00314}, {0.000587, 0.006184, 0.024724}},
                      {48, {0.023501, -0.049901, 0.006267}, {0.925335, 0.196485, 0.049349}},
                      {51, {0.02575, -0.049975, -0.00314}, {1.013893, 0.196776, -0.024724}},
                      {100, {0.05, 0, 0}, {1.968731, 0, 0}}};
  const std::vector<RodLoad> loop = loopTrajectory();
  for (const Row& row : rows) {
    EXPECT_EQ(loop.at(row.step).tip_force, row.force) << row.step;
    EXPECT_EQ(loop.at(row.step).tip_torque, row.torque) << row.step;
  }
  for (const RodLoad& state : loop) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      EXPECT_EQ(std::round(state.tip_force[k] * 1e6) / 1e6, state.tip_force[k]);
      EXPECT_FALSE(state.tip_force[k] == 0 && std::signbit(state.tip_force[k]));
    }
  }
}

TEST(LoopTrajectory, LeadsFromNothingToAFullCircle) {
  // If this fails, the guide filament does not start straight, or does not end in a loop.
  const std::vector<RodLoad> loop = loopTrajectory();
  ASSERT_EQ(loop.size(), 101U);
  EXPECT_EQ(loop[0].tip_force.norm(), 0);
  EXPECT_EQ(loop[0].tip_torque.norm(), 0);
  EXPECT_NEAR(loop[100].tip_torque.x(), 4.7 * 2 * 3.141592653589793 / 15, 1e-6);
  for (std::size_t i = 1; i < loop.size(); ++i) {
    EXPECT_LE((loop[i].tip_force - loop[i - 1].tip_force).norm(), 0.005) << i;
    EXPECT_LE((loop[i].tip_torque - loop[i - 1].tip_torque).norm(), 0.05) << i;
  }
}

}  // namespace
}  // namespace fcl_fibers::scenes
