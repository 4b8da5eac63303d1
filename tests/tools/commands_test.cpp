// SPDX-License-Identifier: BSD-3-Clause
//
// The commands as a library, in a process that goes on: a program that has no part of its own. It
// is linked without FCL, so that a command that needs it does not get here.
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/program.h"
#include "tools/step_impacts.h"

namespace fcl_fibers::tools {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

/// Fiber 1 crosses fiber 0, 0.01 above.
FiberPolylines crossing() {
  FiberPolylines fibers;
  fibers.points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1.5, -1, 0.01}, {1.5, 1, 0.01}};
  fibers.point_begin = {0, 3, 5};
  fibers.radius = 0.02;
  return fibers;
}

struct Answer {
  int code;
  std::string out, err;
};

class CommandsTest : public testing::Test {
 protected:
  void SetUp() override {
    const std::string test = testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = std::filesystem::path(testing::TempDir()) / ("commands_test_" + test);
    std::filesystem::create_directories(folder_);
    std::ofstream(path("fibers.txt")) << "0 0 0\n1 0 0\n2 0 0\n\n1.5 -1 0.01\n1.5 1 0.01\n";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string path(const char* name) const { return (folder_ / name).string(); }

  static Answer run(const std::vector<std::string>& arguments) {
    ProgramParts parts;
    parts.name = "python -m fcl_fibers";
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const int code = runProgram(arguments, parts);
    return {code, testing::internal::GetCapturedStdout(), testing::internal::GetCapturedStderr()};
  }

 private:
  std::filesystem::path folder_;
};

TEST_F(CommandsTest, RunAfterAnotherAnswersTheSame) {
  const std::vector<std::string> check = {"check", path("fibers.txt"), "--radius", "0.02", "--csv"};
  const Answer first = run(check);
  EXPECT_EQ(first.code, 1);
  EXPECT_THAT(first.out, StartsWith("fiber_a,"));
  EXPECT_EQ(first.err, "");
  EXPECT_EQ(run({"check", path("fibers.txt")}).code, 2);
  const Answer second = run(check);
  EXPECT_EQ(second.code, 1);
  EXPECT_EQ(second.out, first.out);
}

TEST_F(CommandsTest, HasNoSceneButFiles) {
  const Answer answer = run({"info", "helix"});
  EXPECT_EQ(answer.code, 2);
  EXPECT_EQ(answer.err,
            "python -m fcl_fibers: 'helix': there is no file of that name; give the path of a file "
            "of fibers\n");
}

TEST_F(CommandsTest, WarnsByItsName) {
  const Answer answer = run({"check", path("fibers.txt"), "--radius", "1", "--limit", "1"});
  EXPECT_THAT(answer.err, AllOf(StartsWith("python -m fcl_fibers: warning: fibers.txt: "),
                                HasSubstr("`python -m fcl_fibers info` tells")));
}

TEST_F(CommandsTest, TellsNothingOfPartsThatAreMissing) {
  for (const char* const command : {"generate", "replay"}) {
    EXPECT_EQ(run({command, path("fibers.txt")}).code, 2) << command;
  }
  const Answer help = run({"--help-all"});
  EXPECT_EQ(help.code, 0);
  EXPECT_THAT(help.out, HasSubstr("Usage: python -m fcl_fibers "));
  for (const char* const word : {"generate", "replay", "helix", "paper-"}) {
    EXPECT_THAT(help.out, Not(HasSubstr(word)));
  }
  const Answer info = run({"info", path("fibers.txt")});
  EXPECT_EQ(info.code, 0);
  EXPECT_THAT(info.out, AllOf(HasSubstr("begins at radius 0.005"),
                              HasSubstr("; check, distance, trade and view need ")));
}

TEST_F(CommandsTest, HandsTheSignalsBack) {
  const auto handler = [](int) {};
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, handler);
  for (const char* const out : {"out.hair", "no/such/folder.hair"}) {
    run({"convert", path("fibers.txt"), path(out)});
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
      EXPECT_EQ(std::signal(signal, handler), static_cast<void (*)(int)>(handler));
    }
  }
}

/// A page is a megabyte long, too long to be printed where a test fails.
bool has(const std::string& page, const std::string& text) {
  return page.find(text) != std::string::npos;
}

TEST_F(CommandsTest, PageIsOfFibersInMemory) {
  Request request;
  request.tree.ignored_neighbors = 1;
  const std::string page = pageOf("knots & loops", crossing(), request);
  EXPECT_EQ(page.substr(0, 15), "<!doctype html>");
  for (const char* const text : {"<title>knots &amp; loops</title>", "\"title\":\"knots & loops\"",
                                 "\"contacts\":1,", "</html>"}) {
    EXPECT_TRUE(has(page, text)) << text;
  }

  request.fragment = true;
  request.tree.ignored_neighbors = 0;  // adjacent segments count
  const std::string fragment = pageOf("a", crossing(), request);
  EXPECT_EQ(fragment.substr(0, 7), "<style>");
  EXPECT_FALSE(has(fragment, "<html"));
  EXPECT_TRUE(has(fragment, "\"contacts\":2,"));
}

TEST_F(CommandsTest, PageIsTheSameAsOfAFile) {
  run({"view", path("fibers.txt"), "--radius", "0.02", "-o", path("page.html")});
  std::ostringstream written;
  written << std::ifstream(path("page.html")).rdbuf();
  Request request;
  request.tree.ignored_neighbors = 1;
  EXPECT_TRUE(pageOf("fibers.txt", crossing(), request) == written.str());
}

TEST_F(CommandsTest, PageHasMeshesInMemory) {
  const std::vector<Point> points = {{-1, -1, 0}, {3, -1, 0}, {0, 3, 0}};
  const std::vector<std::int32_t> triangles = {0, 1, 2};
  const MeshArrays<double> arrays = {points.front().data(), points.size(), triangles.data(), 1};
  const std::vector<MeshFile> meshes = {{"floor", points, triangles, TriangleMesh(arrays)}};
  Request request;
  const std::string page = pageOf("a", crossing(), request, meshes);
  EXPECT_TRUE(has(page, "\"name\":\"floor\""));
  EXPECT_TRUE(has(page, "\"meshContacts\":3,"));
  request.meshes.root_segments = 1;
  EXPECT_TRUE(has(pageOf("a", crossing(), request, meshes), "\"meshContacts\":1,"));
}

TEST_F(CommandsTest, PageNeedsASegment) {
  FiberPolylines point;
  point.points = {{0, 0, 0}};
  point.point_begin = {0, 1};
  EXPECT_THROW(pageOf("a", point, Request{}), std::runtime_error);
}

SceneSource sourceOf(const FiberPolylines& fibers) {
  SceneSource source;
  source.title = "a";
  source.make = [fibers](int) { return fibers; };
  return source;
}

TEST(StepScene, HasTheRadiiOfBothEnds) {
  using Radii = FiberArrays<double>::Radii;
  FiberPolylines of_segments = crossing(), at_points = crossing();
  of_segments.radii = {0.1, 0.2, 0, 0.3, 0};
  at_points.radii = {0, 0.01, 0.02, 0.03, 0.04};
  at_points.radii_are = Radii::kPerPoint;
  // Radii of segments do not tell which one a point has in between.
  EXPECT_THROW(readStep(sourceOf(of_segments), sourceOf(at_points)), std::invalid_argument);
  EXPECT_THROW(readStep(sourceOf(at_points), sourceOf(of_segments)), std::invalid_argument);

  const StepScene step = readStep(sourceOf(crossing()), sourceOf(at_points));
  const FiberPolylines half = step.at(0.5);
  EXPECT_EQ(half.radii_are, Radii::kPerPoint);
  EXPECT_THAT(half.radii,
              testing::Pointwise(testing::DoubleEq(), {0.01, 0.015, 0.02, 0.025, 0.03}));
  EXPECT_EQ(readStep(sourceOf(of_segments), sourceOf(crossing())).at(0.5).radii_are,
            Radii::kPerFirstPoint);
}

}  // namespace
}  // namespace fcl_fibers::tools
