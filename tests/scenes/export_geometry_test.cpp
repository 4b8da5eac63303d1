// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/scenes/export_geometry.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/scenes/fiber_file.h>
#include <fcl_fibers/scenes/strand.h>

#include "scenes/random.h"

namespace fcl_fibers::scenes {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// What the files hold is read by tests/tools/program_test.py, which shares no code with the writer.

/// Fibers of one segment each, two of them to a case.
FiberScene segments(const std::vector<Point>& ends) {
  FiberScene scene;
  scene.points = ends;
  for (std::size_t i = 2; i <= ends.size(); i += 2) scene.point_begin.push_back(i);
  return scene;
}

double squaredDistance(const Point& p, const Point& q) {
  return std::pow(p[0] - q[0], 2) + std::pow(p[1] - q[1], 2) + std::pow(p[2] - q[2], 2);
}

/// The least distance of the points of a grid on both; above the true one by at most `step` of the
/// longer segment.
double gridDistance(const FiberScene& scene, int steps) {
  double least = std::numeric_limits<double>::infinity();
  const auto at = [&](std::size_t first, int i) {
    const Point &a = scene.points[first], &b = scene.points[first + 1];
    const double s = static_cast<double>(i) / steps;
    return Point{a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2])};
  };
  for (int i = 0; i <= steps; ++i) {
    const Point p = at(0, i);
    for (int j = 0; j <= steps; ++j) least = std::min(least, squaredDistance(p, at(2, j)));
  }
  return std::sqrt(least);
}

/// The same from a point, of 4000 steps.
double distanceToSegment(const Point& p, const Point& a, const Point& b) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= 4000; ++i) {
    const double s = i / 4000.0;
    const Point q = {a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2])};
    least = std::min(least, squaredDistance(p, q));
  }
  return std::sqrt(least);
}

// A contact would be drawn in the wrong place, or its distance told wrongly.
TEST(ContactTest, IsWhereTwoSegmentsAreNearest) {
  Random random(1);
  const auto coordinate = [&] { return 2 * random.uniform() - 1; };
  for (int trial = 0; trial < 60; ++trial) {
    std::vector<Point> ends(4);
    for (Point& end : ends) end = {coordinate(), coordinate(), coordinate()};
    if (trial % 4 == 1) {  // nearly parallel
      for (std::size_t k = 0; k < 3; ++k) {
        ends[3][k] = ends[2][k] + (ends[1][k] - ends[0][k]) * (1 + 1e-9 * coordinate());
      }
    }
    if (trial % 4 == 2) ends[3] = ends[2];  // of length zero
    const FiberScene scene = segments(ends);
    const Contact contact = makeContact(scene, {0, 0}, {1, 0});
    // The nearest points of a grid of 400 steps are off by half a step along each; lengths are
    // below 4.
    const double found = gridDistance(scene, 400);
    EXPECT_LE(contact.distance, found + 1e-12) << "trial " << trial;
    EXPECT_GE(contact.distance, found - 4.0 / 400) << "trial " << trial;
    EXPECT_NEAR(contact.distance * contact.distance, squaredDistance(contact.on_a, contact.on_b),
                1e-12);
    EXPECT_LT(distanceToSegment(contact.on_a, ends[0], ends[1]), 1e-3);
    EXPECT_LT(distanceToSegment(contact.on_b, ends[2], ends[3]), 1e-3);
  }
  const FiberScene crossing = segments({{-1, 0, 0}, {1, 0, 0}, {0, -1, 0.5}, {0, 1, 0.5}});
  const Contact contact = makeContact(crossing, {0, 0}, {1, 0});
  EXPECT_EQ(contact.on_a, (Point{0, 0, 0}));
  EXPECT_EQ(contact.on_b, (Point{0, 0, 0.5}));
  EXPECT_EQ(contact.distance, 0.5);
}

TEST(ContactTest, RefusesSegmentsThatAreNone) {
  const FiberScene scene = segments({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}});
  EXPECT_THAT(
      [&] {
        makeContact(scene, {0, 0}, {2, 0});
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("segment 0 of fiber 2")));
  EXPECT_THAT(
      [&] {
        makeContact(scene, {0, 1}, {1, 0});
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("segment 1 of fiber 0")));
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
  StrandParameters parameters;
  parameters.fibers = 20;
  parameters.segments = 7;
  const FiberScene scene = makeStrand(parameters);
  exportFibers(path("strand.vtp"), scene);
  const FiberScene read = readFibers(path("strand.vtp")).scene;
  EXPECT_EQ(read.points, scene.points);
  EXPECT_EQ(read.point_begin, scene.point_begin);
  EXPECT_EQ(read.radius, scene.radius);
  EXPECT_TRUE(read.radii.empty());
}

// Fibers would become thicker with each time that they are written and read, or thinner, so that
// contacts are missed.
TEST_F(ExportTest, RadiiAreReadBackOrBecomeLarger) {
  const auto readBack = [&](const FiberScene& scene, const char* name) {
    std::string(name) == "a.vtp" ? exportFibers(path(name), scene) : writeHair(path(name), scene);
    const FiberFile file = readFibers(path(name));
    EXPECT_TRUE(file.has_radius);
    EXPECT_EQ(file.scene.radii.size(), scene.radii.size());
    return file.scene.radii;
  };
  Random random(2);
  for (int trial = 0; trial < 100; ++trial) {
    FiberScene scene;
    for (const std::size_t points : {1U, 2U, 6U}) {
      scene.points.resize(scene.points.size() + points);
      scene.point_begin.push_back(scene.points.size());
    }
    // Of any file: the larger radius of a segment's ends.
    std::vector<double> by_point(scene.points.size());
    for (double& radius : by_point) radius = std::floor(8 * random.uniform()) / 4;  // a float
    by_point[0] = 3;                                                                // not all equal
    FiberScene of_points = scene, any = scene;
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

TEST_F(ExportTest, NothingIsAFileToo) {
  exportFibers(path("none.vtp"), {});
  exportSegments(path("none.ply"), {}, {});
  exportContacts(path("none_contacts.vtp"), {});
  exportVolumes(path("none_volumes.ply"), {});
  EXPECT_GT(std::filesystem::file_size(path("none_volumes.ply")), 0u);
}

TEST_F(ExportTest, RefusesWhatItCannotWrite) {
  const FiberScene scene = segments({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}});
  for (const char* name : {"a.obj", "vtp", "a.vtp.gz"}) {
    EXPECT_THAT([&] { exportFibers(path(name), scene); },
                ThrowsMessage<std::invalid_argument>(HasSubstr(".ply")));
    EXPECT_FALSE(std::filesystem::exists(path(name)));
  }
  EXPECT_THAT([&] { exportSegments(path("a.vtp"), scene, {1}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("1 numbers, the scene 2 segments")));
  EXPECT_THAT([&] { exportFibers(path("none/a.vtp"), scene); },
              ThrowsMessage<std::runtime_error>(HasSubstr("none/a.vtp")));
}

}  // namespace
}  // namespace fcl_fibers::scenes
