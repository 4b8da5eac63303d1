// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/io/export_geometry.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/io/fiber_file.h>

#include "scenes/helix.h"
#include "scenes/random.h"

namespace fcl_fibers::io {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// What the files hold is read by tests/tools/program_test.py, which shares no code with the writer.

/// Fibers of one segment each, two of them to a case.
FiberPolylines segments(const std::vector<Point>& ends) {
  FiberPolylines scene;
  scene.points = ends;
  for (std::size_t i = 2; i <= ends.size(); i += 2) scene.point_begin.push_back(i);
  return scene;
}

class ExportTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::path(testing::TempDir()) /
        ("export_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  std::filesystem::path folder_;
};

// A scene would come back from its file as another one.
TEST_F(ExportTest, FibersAreReadBackBitByBit) {
  scenes::HelixParameters parameters;
  parameters.fibers = 20;
  parameters.segments = 7;
  const FiberPolylines scene = scenes::makeHelix(parameters);
  exportFibers(path("strand.vtp"), scene);
  const FiberPolylines read = readFibers(path("strand.vtp")).fibers;
  EXPECT_EQ(read.points, scene.points);
  EXPECT_EQ(read.point_begin, scene.point_begin);
  EXPECT_EQ(read.radius, scene.radius);
  EXPECT_TRUE(read.radii.empty());
}

// Contacts of segments that a program gave radii would be missed after they were written.
TEST_F(ExportTest, RadiiOfSegmentsBecomeThoseOfPointsAndNoneThinner) {
  scenes::Random random(2);
  for (int trial = 0; trial < 100; ++trial) {
    FiberPolylines scene;
    for (const std::size_t points : {1U, 2U, 6U}) {
      scene.points.resize(scene.points.size() + points);
      scene.point_begin.push_back(scene.points.size());
    }
    for (std::size_t i = 0; i < scene.points.size(); ++i) {
      scene.radii.push_back(std::floor(8 * random.uniform()) / 4);  // a float
    }
    scene.radii[0] = 3;  // not all equal
    exportFibers(path("a.vtp"), scene);
    writeHair(path("a.hair"), scene);
    for (const char* name : {"a.vtp", "a.hair"}) {
      const FiberPolylines read = readFibers(path(name)).fibers;
      ASSERT_TRUE(read.hasRadiiOfPoints());
      for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
        const std::size_t begin = scene.point_begin[f], end = scene.point_begin[f + 1];
        for (std::size_t i = begin; i < end; ++i) {
          // The larger one of the segments before and after it.
          std::vector<double> around;
          if (i > begin) around.push_back(scene.radii[i - 1]);
          if (i + 1 < end || end - begin == 1) around.push_back(scene.radii[i]);
          EXPECT_EQ(read.radii[i], *std::max_element(around.begin(), around.end())) << name << i;
        }
      }
    }
  }
}

// A fiber without points would be lost, so that those after it have other numbers.
TEST_F(ExportTest, FibersWithoutPointsAreReadBack) {
  FiberPolylines scene;
  scene.points = {{0, 0, 0}, {1, 0, 0}, {9, 9, 9}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}};
  scene.point_begin = {0, 0, 2, 2, 2, 3, 6, 6};
  scene.radii = {1, 1, 1, 2, 2, 2};
  EXPECT_EQ(scene.segmentCount(), 3u);
  exportFibers(path("a.vtp"), scene);
  const FiberPolylines read = readFibers(path("a.vtp")).fibers;
  EXPECT_EQ(read.points, scene.points);
  EXPECT_EQ(read.point_begin, scene.point_begin);
  EXPECT_EQ(read.radii, scene.radii);
  exportSegments(path("segments.vtp"), scene, {1, 0, 0, 0, 1, 0});
  EXPECT_EQ(readFibers(path("segments.vtp")).fibers.fiberCount(), 3u);
}

/// A tree of fibers that taper, with loops, samples and types, of floats.
FiberPolylines randomTree(scenes::Random& random) {
  FiberPolylines scene;
  scene.radii_are = FiberArrays<double>::Radii::kPerPoint;
  const auto number = [&] { return std::floor(64 * random.uniform()) / 8; };
  const auto anyPoint = [&](std::size_t count) {
    return static_cast<std::int32_t>(random.uniform() * static_cast<double>(count));
  };
  const auto fibers = static_cast<std::size_t>(2 + 10 * random.uniform());
  for (std::size_t f = 0; f < fibers; ++f) {
    const std::size_t begin = scene.points.size();
    const auto count = static_cast<std::size_t>(2 + 6 * random.uniform());
    scene.starts_at.push_back(f == 0 || random.uniform() < 0.3 ? -1 : anyPoint(begin));
    scene.ends_at.push_back(f == 0 || random.uniform() < 0.7 ? -1 : anyPoint(begin));
    for (std::size_t i = 0; i < count; ++i) {
      scene.points.push_back({number(), number(), number()});
      scene.radii.push_back(number());
      scene.samples.push_back((std::int64_t{1} << 60) + static_cast<std::int64_t>(1e6 * number()));
      scene.types.push_back(static_cast<std::int64_t>(number()) - 4);
    }
    const auto repeat = [&](std::int32_t from, std::size_t to) {
      if (from >= 0) scene.points[to] = scene.points[static_cast<std::size_t>(from)];
    };
    repeat(scene.starts_at.back(), begin);
    repeat(scene.ends_at.back(), scene.points.size() - 1);
    scene.point_begin.push_back(scene.points.size());
  }
  if (*std::max_element(scene.starts_at.begin(), scene.starts_at.end()) < 0) {
    scene.starts_at = {};
  }
  if (*std::max_element(scene.ends_at.begin(), scene.ends_at.end()) < 0) scene.ends_at = {};
  return scene;
}

// A narrow place, a branch or the number of a sample would be gone after it was written.
TEST_F(ExportTest, TreesThatTaperAreReadBackBitByBit) {
  scenes::Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    SCOPED_TRACE(trial);
    const FiberPolylines scene = randomTree(random);
    exportFibers(path("a.vtp"), scene);
    writeHair(path("a.hair"), scene);
    for (const char* name : {"a.vtp", "a.hair"}) {
      const FiberFile file = readFibers(path(name));
      EXPECT_EQ(file.fibers.points, scene.points) << name;
      EXPECT_EQ(file.fibers.point_begin, scene.point_begin) << name;
      EXPECT_EQ(file.fibers.radii, scene.radii) << name;
      EXPECT_TRUE(file.fibers.hasRadiiOfPoints()) << name;
      EXPECT_TRUE(file.passed_over.empty()) << name;
    }
    const FiberPolylines read = readFibers(path("a.vtp")).fibers;
    EXPECT_EQ(read.starts_at, scene.starts_at);
    EXPECT_EQ(read.ends_at, scene.ends_at);
    EXPECT_EQ(read.samples, scene.samples);
    EXPECT_EQ(read.types, scene.types);
    // Lines that are segments have the radii of both ends.
    exportSegments(path("segments.vtp"), scene, std::vector<unsigned char>(scene.points.size(), 0));
    const FiberPolylines lines = readFibers(path("segments.vtp")).fibers;
    std::size_t line = 0;
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      for (std::size_t i = scene.point_begin[f]; i + 1 < scene.point_begin[f + 1]; ++i, ++line) {
        EXPECT_EQ(lines.radii.at(2 * line), scene.radii[i]);
        EXPECT_EQ(lines.radii.at(2 * line + 1), scene.radii[i + 1]);
      }
    }
  }
}

TEST_F(ExportTest, NothingIsAFileToo) {
  exportFibers(path("none.vtp"), {});
  exportSegments(path("none_segments.vtp"), {}, {});
  exportContacts(path("none_contacts.vtp"), {});
  exportVolumes(path("none_volumes.vtp"), {});
  EXPECT_GT(std::filesystem::file_size(path("none_volumes.vtp")), 0u);
}

TEST_F(ExportTest, RefusesWhatItCannotWrite) {
  const FiberPolylines scene = segments({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}});
  for (const char* name : {"a.ply", "vtp", "a.vtp.gz"}) {
    EXPECT_THAT([&] { exportFibers(path(name), scene); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("does not end in .vtp")));
    EXPECT_FALSE(std::filesystem::exists(path(name)));
  }
  EXPECT_THAT(
      [&] { exportSegments(path("a.vtp"), scene, {1}); },
      ThrowsMessage<std::invalid_argument>(HasSubstr("1 numbers, but the scene has 4 points")));
  EXPECT_THAT([&] { exportFibers(path("none/a.vtp"), scene); },
              ThrowsMessage<std::runtime_error>(HasSubstr("none/a.vtp")));
}

// The file would be refused when it is read, or hold other fibers, or the writer read beyond an
// array.
TEST_F(ExportTest, RefusesScenesThatAreNone) {
  FiberPolylines scene = segments({{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 1, 0}});
  scene.starts_at = {-1, 1};
  scene.ends_at = {2, -1};
  exportFibers(path("good.vtp"), scene);
  EXPECT_EQ(readFibers(path("good.vtp")).fibers.starts_at, scene.starts_at);
  EXPECT_EQ(readFibers(path("good.vtp")).fibers.ends_at, scene.ends_at);
  const auto refuses = [&](const std::string& reason, auto&& change) {
    FiberPolylines changed = scene;
    change(changed);
    const auto expect = [&](const std::string& call, auto&& write) {
      EXPECT_THAT(write,
                  ThrowsMessage<std::invalid_argument>(testing::StartsWith(call + ": " + reason)));
    };
    expect("exportFibers", [&] { exportFibers(path("a.vtp"), changed); });
    expect("exportSegments", [&] { exportSegments(path("a.vtp"), changed, {0, 0, 0, 0}); });
    expect("writeHair", [&] { writeHair(path("a.vtp"), changed); });
    EXPECT_FALSE(std::filesystem::exists(path("a.vtp")));
  };
  using Numbers = std::vector<std::int32_t>;
  for (const std::int32_t at : {-2, 4, 1 << 30, 0, 2}) {  // and of another place, and its own
    refuses("starts_at of fiber 1 is " + std::to_string(at) +
                "; give another point at the same place, or -1 for none",
            [&](FiberPolylines& changed) { changed.starts_at[1] = at; });
  }
  for (const std::int32_t at : {-2, 4, 1 << 30, 0, 1}) {
    refuses("ends_at of fiber 0 is " + std::to_string(at),
            [&](FiberPolylines& changed) { changed.ends_at[0] = at; });
  }
  refuses("starts_at of fiber 0 is 1", [](FiberPolylines& changed) {  // without a point
    changed.point_begin = {0, 0, 4};
    changed.starts_at = {1, -1};
  });
  refuses("the number of starts_at is 1; give one for each fiber, or none",
          [](FiberPolylines& changed) { changed.starts_at = Numbers{-1}; });
  refuses("the number of ends_at is 3", [](FiberPolylines& changed) {
    changed.ends_at = Numbers{-1, -1, -1};
  });
  refuses("the number of closed is 1", [](FiberPolylines& changed) { changed.closed = {0}; });
  refuses("the number of samples is 2", [](FiberPolylines& changed) { changed.samples = {1, 2}; });
  refuses("the number of types is 5", [](FiberPolylines& changed) {
    changed.types = {1, 2, 3, 4, 5};
  });
  refuses("the number of radii is 1", [](FiberPolylines& changed) { changed.radii = {1}; });
  refuses("radius is -1", [](FiberPolylines& changed) { changed.radii = {1, 1, 1, -1}; });
  refuses("point_begin ends at 3", [](FiberPolylines& changed) {
    changed.point_begin = {0, 2, 3};
  });
  refuses("a coordinate of point 3 is inf",
          [](FiberPolylines& changed) { changed.points[3][1] = HUGE_VAL; });
}

}  // namespace
}  // namespace fcl_fibers::io
