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

// Fibers would become thicker with each time that they are written and read, or thinner, so that
// contacts are missed.
TEST_F(ExportTest, RadiiAreReadBackOrBecomeLarger) {
  const auto readBack = [&](const FiberPolylines& scene, const char* name) {
    std::string(name) == "a.vtp" ? exportFibers(path(name), scene) : writeHair(path(name), scene);
    const FiberFile file = readFibers(path(name));
    EXPECT_TRUE(file.has_radius);
    EXPECT_EQ(file.fibers.radii.size(), scene.radii.size());
    return file.fibers.radii;
  };
  scenes::Random random(2);
  for (int trial = 0; trial < 100; ++trial) {
    FiberPolylines scene;
    for (const std::size_t points : {1U, 2U, 6U}) {
      scene.points.resize(scene.points.size() + points);
      scene.point_begin.push_back(scene.points.size());
    }
    // Of any file: the larger radius of a segment's ends.
    std::vector<double> by_point(scene.points.size());
    for (double& radius : by_point) radius = std::floor(8 * random.uniform()) / 4;  // a float
    by_point[0] = 3;                                                                // not all equal
    FiberPolylines of_points = scene, any = scene;
    of_points.radii = by_point;
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      for (std::size_t i = scene.point_begin[f]; i + 1 < scene.point_begin[f + 1]; ++i) {
        of_points.radii[i] = std::max(by_point[i], by_point[i + 1]);
      }
    }
    any.radii = by_point;
    for (const char* name : {"a.vtp", "a.hair"}) {
      const std::vector<double> same = readBack(of_points, name), larger = readBack(any, name);
      for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
        for (std::size_t i = scene.point_begin[f]; i + 1 < scene.point_begin[f + 1]; ++i) {
          EXPECT_EQ(same[i], of_points.radii[i]) << name << ", trial " << trial << ", point " << i;
          EXPECT_GE(larger[i], any.radii[i]) << name << ", trial " << trial << ", point " << i;
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
  scene.radii = scene.point_radii = {1, 1, 1, 2, 2, 2};
  EXPECT_EQ(scene.segmentCount(), 3u);
  exportFibers(path("a.vtp"), scene);
  const FiberPolylines read = readFibers(path("a.vtp")).fibers;
  EXPECT_EQ(read.points, scene.points);
  EXPECT_EQ(read.point_begin, scene.point_begin);
  EXPECT_EQ(read.radii, scene.radii);
  exportSegments(path("segments.vtp"), scene, {1, 0, 0, 0, 1, 0});
  EXPECT_EQ(readFibers(path("segments.vtp")).fibers.fiberCount(), 3u);
}

// A stenosis, the narrow place of one point, would be gone after it was written.
TEST_F(ExportTest, RadiiOfPointsAreReadBackBitByBit) {
  scenes::Random random(3);
  for (int trial = 0; trial < 100; ++trial) {
    FiberPolylines scene;
    for (const std::size_t points : {1U, 2U, 7U, 1U}) {
      scene.points.resize(scene.points.size() + points);
      scene.point_begin.push_back(scene.points.size());
    }
    std::string text;
    for (std::size_t i = 0; i < scene.points.size(); ++i) {
      scene.point_radii.push_back(std::floor(8 * random.uniform()) / 4);  // a float
    }
    scene.point_radii[2] = scene.point_radii[1] + 1;  // They differ along a fiber.
    scene.radii = scene.point_radii;
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      for (std::size_t i = scene.point_begin[f]; i + 1 < scene.point_begin[f + 1]; ++i) {
        scene.radii[i] = std::max(scene.point_radii[i], scene.point_radii[i + 1]);
      }
    }
    exportFibers(path("a.vtp"), scene);
    writeHair(path("a.hair"), scene);
    exportSegments(path("segments.vtp"), scene, std::vector<unsigned char>(scene.points.size(), 0));
    for (const char* name : {"a.vtp", "a.hair"}) {
      const FiberPolylines read = readFibers(path(name)).fibers;
      EXPECT_EQ(read.point_radii, scene.point_radii) << name;
      EXPECT_EQ(read.radii, scene.radii) << name;
    }
    // Its lines are the segments.
    const FiberPolylines segments = readFibers(path("segments.vtp")).fibers;
    std::size_t line = 0;
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      for (std::size_t i = scene.point_begin[f]; i + 1 < scene.point_begin[f + 1]; ++i, ++line) {
        EXPECT_EQ(segments.point_radii.at(2 * line), scene.point_radii[i]);
        EXPECT_EQ(segments.point_radii.at(2 * line + 1), scene.point_radii[i + 1]);
      }
    }
  }
}

// A program that made its fibers thicker would find the old radii in the file.
TEST_F(ExportTest, RadiiThatWereChangedSinceCount) {
  FiberPolylines scene = segments({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}});
  scene.radii = {2, 2, 3, 3};
  scene.point_radii = {1, 2, 3, 3};
  const auto written = [&] {
    exportFibers(path("a.vtp"), scene);
    writeHair(path("a.hair"), scene);
    const FiberPolylines read = readFibers(path("a.vtp")).fibers,
                         hair = readFibers(path("a.hair")).fibers;
    EXPECT_EQ(read.radiusAt(0), hair.radiusAt(0));
    EXPECT_EQ(read.point_radii, hair.point_radii);
    return read;
  };
  EXPECT_EQ(written().point_radii, scene.point_radii);
  FiberPolylines before = scene;
  scene.radii[2] = 4;
  EXPECT_EQ(written().radiusAt(2), 4);
  EXPECT_EQ(written().point_radii, (std::vector<double>{2, 2, 4, 3}));
  scene = before;
  scene.radii.clear();
  scene.radius = 5;
  EXPECT_EQ(written().radius, 5);
  for (const double bad : {-1.0, std::nan(""), 9.0}) {
    scene = before;
    scene.point_radii[0] = bad;
    EXPECT_TRUE(written().point_radii.empty()) << bad;
  }
  scene = before;
  scene.point_radii.pop_back();
  EXPECT_TRUE(written().point_radii.empty());
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

}  // namespace
}  // namespace fcl_fibers::io
