// SPDX-License-Identifier: BSD-3-Clause
//
// tests/data/make_tractography_files.py says what the files are.
#include <cstddef>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/file_support.h"

namespace fcl_fibers::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const std::string kFolder = FCL_FIBERS_SOURCE_DIR "/tests/data/";

/// nibabel rounds its matrix, its points and what it adds up to floats, which is some eight
/// roundings by 2^-24 of up to 200 mm. We round only doubles.
constexpr double kFloatRoundings = 8 * 200 * 0x1p-24;

class NibabelFileTest : public testing::TestWithParam<const char*> {};

TEST_P(NibabelFileTest, IsReadAsByNibabel) {
  // If this fails, fibers lie beside the brain of their image, mirrored, or half a voxel off.
  const std::string name = GetParam();
  const FiberFile file = readFibers(kFolder + name);
  EXPECT_EQ(file.format,
            name.substr(name.size() - 3) == "tck" ? FiberFormat::kTck : FiberFormat::kTrk);
  EXPECT_FALSE(file.has_radius);
  expectWellFormed(file.fibers);
  const FiberPolylines expected =
      readFibers(kFolder + name.substr(0, name.find('.')) + ".txt").fibers;
  EXPECT_THAT(expected.point_begin, ElementsAre(0, 5, 6, 9, 11));
  EXPECT_EQ(file.fibers.point_begin, expected.point_begin);
  ASSERT_EQ(file.fibers.points.size(), expected.points.size());
  for (std::size_t i = 0; i < expected.points.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(file.fibers.points[i][k], expected.points[i][k], kFloatRoundings) << i;
    }
  }
  if (name == "without_count.trk") {
    EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("does not tell the number")));
  } else if (name == "version_1.trk") {
    EXPECT_THAT(file.warnings,
                ElementsAre(HasSubstr("no vox_to_ras"), HasSubstr("no voxel order")));
  } else {
    EXPECT_THAT(file.warnings, IsEmpty());
  }
}

INSTANTIATE_TEST_SUITE_P(File, NibabelFileTest,
                         testing::Values("turned_ras.trk", "turned_lps.trk", "turned_lps_big.trk",
                                         "without_count.trk", "version_1.trk", "exchanged_axes.trk",
                                         "mirrored.trk", "sheared.trk", "tracks.tck"),
                         [](const auto& file) {
                           const std::string name = file.param;
                           return name.substr(0, name.find('.'));
                         });

TEST(NibabelTckTest, PointsAreThoseOfTheFile) {
  // If this fails, points of .tck files are rounded or moved, though they need neither.
  EXPECT_EQ(readFibers(kFolder + "tracks.tck").fibers.points,
            readFibers(kFolder + "tracks.txt").fibers.points);
}

}  // namespace
}  // namespace fcl_fibers::io
