// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/load_file.h"

#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenes/paper_scenes.h"
#include "support/temporary_file.h"

namespace fcl_fibers::scenes {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// A recording that a spreadsheet or another system has written would be refused, or read otherwise.
TEST(LoadFile, ReadsStatesBetweenCommentsHoweverTheyAreSeparated) {
  const test::TemporaryFile file(".txt",
                                 "# force and torque\r\n0 0 0 0 0 0\r\n\r\n"
                                 "  +1,-2.5e-1,3 , 4\t5,6# bent\n # the end\n0 0 0 0 0 7");
  const std::vector<RodLoad> loads = readLoads(file.path());
  ASSERT_EQ(loads.size(), 3u);
  EXPECT_EQ(loads[0].tip_force, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(loads[1].tip_force, Eigen::Vector3d(1, -0.25, 3));
  EXPECT_EQ(loads[1].tip_torque, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(loads[2].tip_torque, Eigen::Vector3d(0, 0, 7));
}

// A damaged recording would be replayed as another motion, or nobody would find the damage.
TEST(LoadFile, RefusesWhatIsNoRecordingAndTellsWhere) {
  const auto refuses = [](const std::string& text, const std::string& why) {
    const test::TemporaryFile file(".txt", text);
    EXPECT_THAT(
        [&] { readLoads(file.path()); },
        ThrowsMessage<std::runtime_error>(HasSubstr("loads '" + file.path() + "': " + why)));
  };
  refuses("", "there is no state; give a line of six numbers for each");
  refuses("# nothing\n", "there is no state");
  refuses("0 0 0 0 0 0\n1 2 3 4 5\n", "line 2: there are 5 numbers; give six");
  refuses("1 2 3 4 5 6 7\n", "line 1: there are 7 numbers; give six");
  refuses("1 2 3 4 5 six\n", "line 1: 'six' is not a finite number");
  refuses("1 2 3 4 5 nan\n", "line 1: 'nan' is not a finite number");
  refuses("1 2 3 4 5 1e999\n", "line 1: '1e999' is not a finite number");
  std::string many;
  for (int state = 0; state <= 10000; ++state) many += "0 0 0 0 0 0\n";
  refuses(many, "line 10001: there are more than 10,000 states");
  EXPECT_THAT([] { readLoads("no such file"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("the file cannot be opened")));
}

// The assembly would follow other loads than those that were recorded.
TEST(LoadFile, TheDynamicAssemblyFollowsRecordedLoads) {
  PaperDynamicParameters parameters;
  parameters.fibers = 3;
  parameters.segments = 20;
  const PaperDynamic loop(parameters);
  for (const std::size_t i : {0u, 40u, 100u}) parameters.loads.push_back(loopTrajectory()[i]);
  const PaperDynamic recorded(parameters);
  ASSERT_EQ(recorded.steps(), 3);
  const FiberPolylines expected = loop.scene(40), found = recorded.scene(1);
  for (std::size_t i = 0; i < expected.points.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(found.points[i][k], expected.points[i][k], 1e-8);
    }
  }
  parameters.loads[1].tip_force = {0, 0, -1e4};
  EXPECT_THAT([&] { PaperDynamic{parameters}; },
              ThrowsMessage<std::runtime_error>(HasSubstr("state 1 of the loads: solveRod")));
}

}  // namespace
}  // namespace fcl_fibers::scenes
