// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/file_support.h"

namespace fcl_fibers::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr FiberFormat kTrk = FiberFormat::kTrk;
constexpr std::size_t kHeaderSize = 1000;

struct TrackFile {
  bool is_big = false;
  std::array<std::int16_t, 3> dimensions = {10, 20, 30};
  std::array<float, 3> voxel_size = {2, 0.5F, 1};
  std::int16_t scalars = 0, properties = 0;
  std::array<float, 16> vox_to_ras = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  std::string voxel_order = "RAS";
  std::int32_t streamlines = 2, version = 2, size = 1000;
  /// Points of each streamline, which are (i, 2 i, 4 i) by their number i in the file.
  std::vector<int> points = {3, 2};

  std::string bytes() const {
    FileBytes file;
    const auto add = [&](auto number) { is_big ? file.big(number) : file.little(number); };
    const auto fill = [&](std::size_t offset) { file.zeros(offset - file.size()); };
    file.text("TRACK").zeros(1);
    for (const std::int16_t dimension : dimensions) add(dimension);
    for (const float edge : voxel_size) add(edge);
    fill(36);
    add(scalars);
    fill(238);
    add(properties);
    fill(440);
    for (const float entry : vox_to_ras) add(entry);
    fill(948);
    file.text(voxel_order);
    fill(988);
    for (const std::int32_t number : {streamlines, version, size}) add(number);
    float i = 0;
    for (const int count : points) {
      add(std::int32_t{count});
      for (int point = 0; point < count; ++point, ++i) {
        for (const float c : {i, 2 * i, 4 * i}) add(c);
        for (int s = 0; s < scalars; ++s) add(std::nanf(""));
      }
      for (int p = 0; p < properties; ++p) add(-1.0F);
    }
    return file.bytes();
  }
};

FiberFile parse(const TrackFile& file) { return parseFibers(file.bytes(), "a file", kTrk); }

/// Of the identity: voxels of 2 x 0.5 x 1, of which the first has its centre at 0.
Point samplePoint(std::size_t i) {
  const auto x = static_cast<double>(i);
  return {x / 2 - 0.5, 4 * x - 0.5, 4 * x - 0.5};
}

void expectSample(const FiberFile& file, const std::vector<std::size_t>& begin = {0, 3, 5}) {
  expectWellFormed(file.fibers);
  EXPECT_EQ(file.fibers.point_begin, begin);
  EXPECT_THAT(file.fibers.points, ElementsAre(samplePoint(0), samplePoint(1), samplePoint(2),
                                              samplePoint(3), samplePoint(4)));
  EXPECT_FALSE(file.has_radius);
}

class TrkTest : public testing::TestWithParam<bool> {};

INSTANTIATE_TEST_SUITE_P(ByteOrder, TrkTest, testing::Values(false, true),
                         [](const auto& order) { return order.param ? "Big" : "Little"; });

TEST_P(TrkTest, ReadsWhatWasWrittenBesideScalarsAndProperties) {
  // If this fails, points are read from the wrong place, or scalars as points.
  for (const std::int16_t scalars : {std::int16_t{0}, std::int16_t{1}, std::int16_t{5}}) {
    for (const std::int16_t properties : {std::int16_t{0}, std::int16_t{2}}) {
      TrackFile file;
      file.is_big = GetParam();
      file.scalars = scalars;
      file.properties = properties;
      EXPECT_EQ(recognizeFormat(file.bytes(), "a file"), kTrk);
      const FiberFile read = parse(file);
      expectSample(read);
      EXPECT_THAT(read.warnings, IsEmpty());
    }
  }
}

TEST_P(TrkTest, DamageIsRefusedOrHarmless) {
  // If this fails, a file that was not copied to its end passes for whole, or a damaged one crashes
  // the reader or yields a scene that is not one.
  TrackFile file;
  file.is_big = GetParam();
  file.scalars = 1;
  file.properties = 1;
  file.points = {2, 1};
  expectToldTruncations(file.bytes(), kTrk);
  expectSafeBitFlips(file.bytes(), kTrk);
  file.streamlines = 0;
  expectToldTruncations(file.bytes(), kTrk);
}

TEST(TrkHeaderTest, TheMatrixTakesVoxelsToTheWorld) {
  // If this fails, fibers are turned or displaced.
  TrackFile file;
  file.vox_to_ras = {0, -3, 0, 100, 2, 0, 0, 10, 0, 0, 4, 1, 0, 0, 0, 1};
  file.voxel_order = "ALS";
  const FiberFile read = parse(file);
  const Point voxel = samplePoint(4);
  EXPECT_EQ(read.fibers.points[4],
            (Point{100 - 3 * voxel[1], 10 + 2 * voxel[0], 1 + 4 * voxel[2]}));
  EXPECT_THAT(read.warnings, IsEmpty());
}

TEST(TrkHeaderTest, TheVoxelOrderReversesAxes) {
  // If this fails, fibers are mirrored.
  TrackFile file;
  file.voxel_order = "lPs";
  const FiberFile read = parse(file);
  for (std::size_t i = 0; i < 5; ++i) {
    const Point point = samplePoint(i);
    EXPECT_EQ(read.fibers.points[i], (Point{9 - point[0], 19 - point[1], point[2]}));
  }
  EXPECT_THAT(read.warnings, IsEmpty());
  file.dimensions[1] = 0;
  EXPECT_THAT(parse(file).warnings, ElementsAre(HasSubstr("no dimensions")));
  file.voxel_order = "RAI";
  EXPECT_THAT(parse(file).warnings, IsEmpty());
}

TEST(TrkHeaderTest, WhatIsAbsentIsAssumedAndWarnedOf) {
  // If this fails, older files are refused, or read otherwise than by nibabel.
  const auto no_matrix = HasSubstr("has no vox_to_ras; the identity is assumed");
  TrackFile file;
  file.version = 1;
  file.vox_to_ras.fill(std::nanf(""));  // is not read
  expectSample(parse(file));
  EXPECT_THAT(parse(file).warnings, ElementsAre(no_matrix));
  file.version = 2;
  file.vox_to_ras.fill(0);
  expectSample(parse(file));
  EXPECT_THAT(parse(file).warnings, ElementsAre(no_matrix));
  file.vox_to_ras[3] = 7;
  expectSample(parse(file));
  file = TrackFile();
  file.voxel_order = "";
  EXPECT_THAT(parse(file).warnings, ElementsAre(HasSubstr("LPS is assumed")));
  EXPECT_EQ(parse(file).fibers.points[0], (Point{9.5, 19.5, -0.5}));
  file.voxel_order = "RAS ";
  file.version = 3;
  expectSample(parse(file));
  EXPECT_THAT(parse(file).warnings, ElementsAre(HasSubstr("Version is 3")));
}

TEST(TrkHeaderTest, TheNumberOfStreamlinesMayBeUnknownOrWrong) {
  // If this fails, streamlines are lost and nobody is told.
  TrackFile file;
  file.streamlines = 0;
  expectSample(parse(file));
  EXPECT_THAT(parse(file).warnings, ElementsAre(HasSubstr("does not tell the number")));
  file.streamlines = 3;
  expectSample(parse(file));
  EXPECT_THAT(parse(file).warnings, ElementsAre("The header has 3 streamlines, but the file has 2; "
                                                "it may be truncated."));
  file.streamlines = std::numeric_limits<std::int32_t>::max();
  EXPECT_THAT(parse(file).warnings, ElementsAre(HasSubstr("has 2147483647 streamlines")));
  file.streamlines = 1;
  EXPECT_EQ(parse(file).fibers.fiberCount(), 1U);
  EXPECT_THAT(parse(file).warnings, ElementsAre(HasSubstr("28 bytes follow")));
}

TEST(TrkHeaderTest, SaysWhereItIsMalformed) {
  // If this fails, a broken file is read as something else, or its author has to guess.
  const auto refuses = [](auto&& change, int place, const std::string& reason) {
    TrackFile file;
    change(file);
    expectRefusal(file.bytes(), kTrk, "byte " + std::to_string(place), reason);
  };
  expectRefusal("HAIR" + TrackFile().bytes(), kTrk, "byte 0", "does not start with TRACK");
  expectRefusal("TRACK", kTrk, "byte 5", "the file ends inside the header");
  refuses([](TrackFile& f) { f.size = 999; }, 996, "the header's size is not 1000");
  for (const std::int32_t version : {0, 4, -1}) {
    refuses([&](TrackFile& f) { f.version = version; }, 992, "version is ");
  }
  refuses([](TrackFile& f) { f.scalars = -1; }, 36, "the number of scalars is -1");
  refuses([](TrackFile& f) { f.properties = -1; }, 238, "the number of properties is -1");
  refuses([](TrackFile& f) { f.streamlines = -1; }, 988, "the number of streamlines is -1");
  for (const float bad : {0.0F, -1.0F, std::nanf(""), std::numeric_limits<float>::infinity()}) {
    refuses([&](TrackFile& f) { f.voxel_size[2] = bad; }, 20, "a voxel size is ");
  }
  for (const char* bad : {"LP", "RRS", "RLS", "XYZ", "LPSI", "\xFFPS"}) {
    refuses([&](TrackFile& f) { f.voxel_order = bad; }, 948, "the voxel order is '");
  }
}

TEST(TrkHeaderTest, RefusesAMatrixThatIsNone) {
  // If this fails, fibers are flattened into a plane, or a NaN enters a scene.
  const auto refuses = [](std::size_t entry, float value, int place, const std::string& reason) {
    TrackFile file;
    file.vox_to_ras[entry] = value;
    expectRefusal(file.bytes(), kTrk, "byte " + std::to_string(place), reason);
  };
  const float infinity = std::numeric_limits<float>::infinity();
  refuses(5, 0, 440, "vox_to_ras is flat");
  refuses(3, std::nanf(""), 452, "an entry of vox_to_ras is nan");
  refuses(15, infinity, 500, "an entry of vox_to_ras is inf");
  TrackFile file;
  file.vox_to_ras = {1, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  expectRefusal(file.bytes(), kTrk, "byte 440", "vox_to_ras is flat");
}

TEST(TrkStreamlineTest, ThoseWithoutPointsAreKept) {
  // If this fails, all streamlines after one without points have the number of another.
  TrackFile file;
  file.properties = 1;
  file.points = {0, 3, 0, 2};
  file.streamlines = 4;
  expectSample(parse(file), {0, 0, 3, 3, 5});
  EXPECT_THAT(parse(file).warnings, IsEmpty());
  for (const std::vector<int>& none : {std::vector<int>{}, std::vector<int>{0, 0}}) {
    file.points = none;
    expectRefusal(file.bytes(), kTrk, "byte 988", "there are no streamlines");
  }
}

TEST(TrkStreamlineTest, RefusesCountsThatTheFileCannotHold) {
  // If this fails, a count asks for memory that the machine does not have, or wraps around.
  TrackFile file;
  for (const std::int32_t count : {3, 0x10000, std::numeric_limits<std::int32_t>::max()}) {
    for (const std::int16_t scalars : {std::int16_t{0}, std::int16_t{0x7FFF}}) {
      file.points = {};
      file.scalars = scalars;
      FileBytes bytes;
      bytes.text(file.bytes()).little(count).zeros(35);
      expectRefusal(bytes.bytes(), kTrk, "byte 1000",
                    "a streamline of " + std::to_string(count) + " points takes ");
    }
  }
  FileBytes negative;
  negative.text(file.bytes()).little(std::int32_t{-1});
  expectRefusal(negative.bytes(), kTrk, "byte 1000", "the number of points is -1");
  FileBytes cut;
  cut.text(file.bytes()).zeros(3);
  expectRefusal(cut.bytes(), kTrk, "byte 1003", "the file ends inside a streamline");
}

TEST(TrkStreamlineTest, RefusesCoordinatesThatAreNoNumbers) {
  // If this fails, a NaN enters a scene and is noticed far from its cause.
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {infinity, -infinity, std::nanf("")}) {
    FileBytes file;
    file.text(TrackFile().bytes()).setLittle(kHeaderSize + 4 + 12 + 8, bad);
    expectRefusal(file.bytes(), kTrk, "byte 1024", "a coordinate is ");
  }
  TrackFile far;
  far.vox_to_ras[0] = 1e38F;
  FileBytes file;
  file.text(far.bytes()).setLittle(kHeaderSize + 4 + 12, 1e3F);
  expectRefusal(file.bytes(), kTrk, "byte 1016", "by vox_to_ras");
}

TEST(TrkMemoryTest, MemoryIsBoundedWhereStreamlinesAreShortest) {
  // If this fails, a large file takes more memory than the reader promises.
  for (const int points : {0, 1, 2}) {
    TrackFile file;
    file.points.assign(20000, points);
    file.streamlines = 0;
    EXPECT_EQ(parsesSafely(file.bytes(), kTrk), points > 0);
  }
  TrackFile file;
  file.points = {40000};
  EXPECT_TRUE(parsesSafely(file.bytes(), kTrk));
}

}  // namespace
}  // namespace fcl_fibers::io
