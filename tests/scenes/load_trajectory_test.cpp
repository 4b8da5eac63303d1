// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/load_trajectory.h"

#include <cmath>
#include <cstddef>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/temporary_file.h"

namespace fcl_fibers::scenes {
namespace {

using test::TemporaryFile;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

const char kHeader[] = "step,fx,fy,fz,tx,ty,tz\n";

LoadTrajectory read(const std::string& content) {
  const TemporaryFile file(".csv", content);
  return readLoadTrajectory(file.path());
}

void expectSame(const LoadTrajectory& a, const LoadTrajectory& b) {
  ASSERT_EQ(a.states.size(), b.states.size());
  for (std::size_t i = 0; i < a.states.size(); ++i) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      EXPECT_EQ(a.states[i].force[k], b.states[i].force[k]) << i;
      EXPECT_EQ(a.states[i].torque[k], b.states[i].torque[k]) << i;
      EXPECT_EQ(std::signbit(a.states[i].force[k]), std::signbit(b.states[i].force[k])) << i;
    }
  }
}

TEST(LoadTrajectory, TheFileHoldsTheFunction) {
  // If this fails, who reads the file replays another scene.
  expectSame(readLoadTrajectory(FCL_FIBERS_SOURCE_DIR "/scenes/loop.csv"), loopTrajectory());
}

TEST(LoadTrajectory, LeadsFromNothingToAFullCircle) {
  // If this fails, the guide filament does not start straight, or does not end in a loop.
  const LoadTrajectory loop = loopTrajectory();
  ASSERT_EQ(loop.states.size(), 101U);
  EXPECT_EQ(loop.states[0].force.norm(), 0);
  EXPECT_EQ(loop.states[0].torque.norm(), 0);
  EXPECT_NEAR(loop.states[100].torque.x(), 4.7 * 2 * 3.141592653589793 / 15, 1e-6);
  for (std::size_t i = 1; i < loop.states.size(); ++i) {
    EXPECT_LE((loop.states[i].force - loop.states[i - 1].force).norm(), 0.005) << i;
    EXPECT_LE((loop.states[i].torque - loop.states[i - 1].torque).norm(), 0.05) << i;
  }
}

TEST(LoadTrajectory, ReadsBackWhatWasWritten) {
  // If this fails, digits are lost on the way.
  LoadTrajectory trajectory;
  trajectory.states.push_back({{0.1, -0.0, 1.0 / 3}, {1e300, 5e-324, -1e-17}});
  trajectory.states.push_back(
      {{std::nextafter(1.0, 2.0), std::numeric_limits<double>::max(), 3}, {1, 2, 123456789.125}});
  const TemporaryFile file(".csv");
  writeLoadTrajectory(file.path(), trajectory);
  expectSame(readLoadTrajectory(file.path()), trajectory);
}

TEST(LoadTrajectory, SkipsCommentsAndEmptyLines) {
  // If this fails, files that people touched are refused.
  const LoadTrajectory trajectory =
      read("# by hand\r\n\r\n" + std::string("step,fx,fy,fz,tx,ty,tz\r\n") +
           "0,0,0,0,0,0,0\r\n# then\n\n1,1,2,3,4e0,5.5,-6");
  ASSERT_EQ(trajectory.states.size(), 2U);
  EXPECT_EQ(trajectory.states[1].force, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(trajectory.states[1].torque, Eigen::Vector3d(4, 5.5, -6));
}

TEST(LoadTrajectory, SaysWhereAFileIsMalformed) {
  // If this fails, a broken file is read as something else, or its author has to guess.
  const auto refuses = [](const std::string& content, const std::string& where,
                          const std::string& reason) {
    EXPECT_THAT([&] { read(content); }, ThrowsMessage<std::runtime_error>(AllOf(
                                            HasSubstr("readLoadTrajectory: '"), HasSubstr(".csv'"),
                                            HasSubstr(where + ": "), HasSubstr(reason))))
        << content;
  };
  const std::string header = kHeader;
  refuses("", "line 0", "ends before the header");
  refuses("# only\n", "line 1", "ends before the header");
  refuses(header, "line 1", "ends before the first state");
  refuses("step,fx,fy,fz\n", "line 1",
          "the header is 'step,fx,fy,fz', expected is 'step,fx,fy,fz,");
  refuses("0,0,0,0,0,0,0\n", "line 1", "the header is '0,");
  refuses(header + "0,0,0,0,0,0\n", "line 2", "there are 6 fields, expected are 7");
  refuses(header + "0,0,0,0,0,0,0,0\n", "line 2", "there are 8 fields");
  refuses(header + "1,0,0,0,0,0,0\n", "line 2", "the step is '1', expected is 0");
  refuses(header + "0,0,0,0,0,0,0\n#\n0,0,0,0,0,0,0\n", "line 4", "the step is '0', expected is 1");
  refuses(header + "0,0,0,x,0,0,0\n", "line 2", "'x' is not a finite number");
  for (const char* bad : {"", " 1", "1 ", "1e999", "nan", "inf", "1.2.3", "0x1", "+1"}) {
    refuses(header + "0,0,0,0,0,0," + bad + "\n", "line 2",
            "'" + std::string(bad) + "' is not a finite number");
  }
}

TEST(LoadTrajectory, SaysWhereAFileCannotBeReadOrWritten) {
  // If this fails, a lost file passes for an empty or a saved one.
  EXPECT_THAT([] { readLoadTrajectory("/no/such/file.csv"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("'/no/such/file.csv' cannot be opened")));
  EXPECT_THAT([] { readLoadTrajectory(testing::TempDir()); },
              ThrowsMessage<std::runtime_error>(HasSubstr("reading failed")));
  EXPECT_THAT([] { writeLoadTrajectory("/no/such/file.csv", loopTrajectory()); },
              ThrowsMessage<std::runtime_error>(
                  HasSubstr("writeLoadTrajectory: '/no/such/file.csv' cannot be opened")));
  if (std::ofstream("/dev/full")) {
    EXPECT_THAT([] { writeLoadTrajectory("/dev/full", loopTrajectory()); },
                ThrowsMessage<std::runtime_error>(HasSubstr("'/dev/full': writing failed")));
  }
}

TEST(LoadTrajectory, RefusesToWriteWhatCannotBeRead) {
  // If this fails, a file is written that is refused later.
  const TemporaryFile file(".csv");
  EXPECT_THAT([&] { writeLoadTrajectory(file.path(), {}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("the number of states is 0")));
  LoadTrajectory trajectory = loopTrajectory();
  trajectory.states[7].torque.y() = std::nan("");
  EXPECT_THAT([&] { writeLoadTrajectory(file.path(), trajectory); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("a load of step 7 is nan")));
}

}  // namespace
}  // namespace fcl_fibers::scenes
