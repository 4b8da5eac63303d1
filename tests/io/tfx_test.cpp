// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/file_support.h"

namespace fcl_fibers::io {
namespace {

constexpr FiberFormat kTfx = FiberFormat::kTfx;
constexpr std::uint32_t kStrands = 2;
constexpr std::uint32_t kPointsPerStrand = 3;
constexpr std::size_t kTrailingBytes = 8;

// A small valid file and where its parts are.
struct SampleFile {
  FileBytes file;
  std::size_t offset_field;
  std::size_t header_size;
  std::size_t points_begin;
  std::size_t points_end;
  std::size_t point_size;

  const std::string& bytes() const { return file.bytes(); }
};

float sampleCoordinate(std::size_t point, std::size_t k) {
  return static_cast<float>(point) + 0.25F * static_cast<float>(k + 1);
}

SampleFile sampleFile(int version) {
  SampleFile sample;
  sample.offset_field = version == 3 ? 144 : 12;
  sample.header_size = version == 3 ? 148 : 160;
  sample.point_size = version == 3 ? 12 : 16;
  sample.points_begin = sample.header_size + 4;
  sample.points_end = sample.points_begin + kStrands * kPointsPerStrand * sample.point_size;
  FileBytes& file = sample.file;
  file.zeros(sample.header_size).little(0xFFFFFFFFU);
  file.setLittle(0, static_cast<float>(version));
  file.setLittle(4, kStrands).setLittle(8, kPointsPerStrand);
  file.setLittle(sample.offset_field, static_cast<std::uint32_t>(sample.points_begin));
  for (std::size_t i = 0; i < kStrands * kPointsPerStrand; ++i) {
    for (std::size_t k = 0; k < 3; ++k) file.little(sampleCoordinate(i, k));
    if (version == 4) file.little(std::nanf(""));  // is not read
  }
  file.text(std::string(kTrailingBytes, '\xFF'));
  return sample;
}

FiberFile parse(const std::string& bytes) { return parseFibers(bytes, "a file", kTfx); }

void expectSampleScene(const FiberPolylines& scene) {
  expectWellFormed(scene);
  EXPECT_THAT(scene.point_begin, testing::ElementsAre(0, 3, 6));
  ASSERT_EQ(scene.points.size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(scene.points[i][k], sampleCoordinate(i, k));
  }
}

class TfxTest : public testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Version, TfxTest, testing::Values(3, 4),
                         testing::PrintToStringParamName());

TEST_P(TfxTest, ReadsWhatWasWrittenInMinorVersionsToo) {
  // If this fails, points are read from the wrong place or in the wrong order, or files of version
  // 3.1 or 4.1 are refused though their layout is known.
  SampleFile sample = sampleFile(GetParam());
  for (const float minor : {0.0F, 0.1F}) {
    sample.file.setLittle(0, static_cast<float>(GetParam()) + minor);
    const FiberFile file = parse(sample.bytes());
    expectSampleScene(file.fibers);
    EXPECT_EQ(file.fibers.radius, 0);
    EXPECT_THAT(file.warnings, testing::IsEmpty());
  }
}

TEST_P(TfxTest, RefusesOtherVersions) {
  // If this fails, a file of unknown layout is read as if it were known.
  SampleFile sample = sampleFile(GetParam());
  for (const float version : {0.0F, 1.0F, 2.0F, 2.99F, 5.0F, -3.0F, 1e30F,
                              std::numeric_limits<float>::infinity(), std::nanf("")}) {
    sample.file.setLittle(0, version);
    expectRefusal(sample.bytes(), kTfx, "byte 0", "version is ");
  }
}

TEST_P(TfxTest, RefusesCountsThatTheFileCannotHold) {
  // If this fails, an empty scene hides that a file is broken, fibers without a segment enter a
  // scene, or a count asks for memory that the machine does not have, or wraps around.
  const auto refuses = [](std::uint32_t strands, std::uint32_t points_per_strand,
                          const std::string& place, const std::string& reason) {
    SampleFile sample = sampleFile(GetParam());
    sample.file.setLittle(4, strands).setLittle(8, points_per_strand);
    expectRefusal(sample.bytes(), kTfx, place, reason);
  };
  refuses(0, 3, "byte 4", "there are no strands");
  refuses(2, 0, "byte 8", "points per strand are 0");
  refuses(2, 1, "byte 8", "points per strand are 1");
  refuses(3, 3, "byte 4", "3 strands of ");
  refuses(0xFFFFFFFF, 0xFFFFFFFF, "byte 4", "4294967295 strands of ");  // bytes beyond 64 bits
  // 2^62 points: times 12 or 16 wraps around to 0.
  refuses(0x80000000, 0x80000000, "byte 4", "2147483648 strands of ");
  refuses(0x10000, 0x10000, "byte 4", "65536 strands of ");  // 2^32 points: 0 in 32 bits
  refuses(1, 0xFFFFFFFF, "byte 4", "1 strands of ");         // a single strand of 48 GiB or more
  refuses(0xFFFFFFFF, 2, "byte 4", "4294967295 strands of ");
}

TEST_P(TfxTest, RefusesPointsInsideTheHeaderOrBeyondTheFile) {
  // If this fails, counts and offsets are read as coordinates, or memory is filled with what the
  // file does not contain.
  SampleFile sample = sampleFile(GetParam());
  const auto refuses = [&](std::size_t points_begin, std::size_t place, const std::string& reason) {
    sample.file.setLittle(sample.offset_field, static_cast<std::uint32_t>(points_begin));
    expectRefusal(sample.bytes(), kTfx, "byte " + std::to_string(place), reason);
  };
  for (const std::size_t offset : {std::size_t{0}, std::size_t{12}, sample.header_size - 1}) {
    refuses(offset, sample.offset_field, "inside the header");
  }
  for (const std::size_t offset : {sample.bytes().size() + 1, std::size_t{0xFFFFFFFF}}) {
    refuses(offset, sample.offset_field, "points start at byte " + std::to_string(offset));
  }
  for (const std::size_t offset :
       {sample.points_begin + kTrailingBytes + 1, sample.bytes().size()}) {
    refuses(offset, 4, "end beyond the file");
  }
}

TEST_P(TfxTest, RefusesCoordinatesThatAreNoNumbers) {
  // If this fails, a NaN enters a scene and is noticed far from its cause.
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {infinity, -infinity, std::nanf("")}) {
    for (std::size_t k = 0; k < 3; ++k) {
      SampleFile sample = sampleFile(GetParam());
      const std::size_t offset = sample.points_begin + 5 * sample.point_size + 4 * k;
      sample.file.setLittle(offset, bad);
      expectRefusal(sample.bytes(), kTfx, "byte " + std::to_string(offset), "a coordinate is ");
    }
  }
}

TEST_P(TfxTest, DamageIsRefusedOrHarmless) {
  // If this fails, a file that was not copied to its end is read as if it were whole, or a damaged
  // one crashes the reader or yields a scene that is not one.
  const SampleFile sample = sampleFile(GetParam());
  expectSafeTruncations(sample.bytes(), kTfx, sample.points_end);
  expectRefusal(sample.bytes().substr(0, 100), kTfx, "byte 100", "the file ends inside the header");
  expectSafeBitFlips(sample.bytes(), kTfx);
}

TEST(TfxMemoryTest, MemoryIsBoundedWhereStrandsAreShortest) {
  // If this fails, a large file takes more memory than the reader promises.
  constexpr std::uint32_t kMany = 20000;
  FileBytes file;
  file.zeros(148).setLittle(0, 3.0F).setLittle(4, kMany).setLittle(8, 2U).setLittle(144, 148U);
  file.zeros(2 * kMany * 12);
  EXPECT_TRUE(parsesSafely(file.bytes(), kTfx));
}

struct RealFile {
  const char* name;
  std::size_t strands;
  std::size_t points_per_strand;
  double shortest_segment, longest_segment;  // to 1 %
};

void PrintTo(const RealFile& file, std::ostream* stream) { *stream << file.name; }

class TfxRealFileTest : public testing::TestWithParam<RealFile> {};

TEST_P(TfxRealFileTest, IsReadAsItIs) {
  // If this fails, files of the real world are read wrongly though our own are read well.
  const RealFile& file = GetParam();
  const std::string path = realFile(file.name);
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << file.name << " is absent; FCL_FIBERS_DATA names the directory to look in";
  }
  const FiberFile read = readFibers(path, {0.05});
  EXPECT_EQ(read.format, kTfx);
  const FiberPolylines& scene = read.fibers;
  expectWellFormed(scene);
  EXPECT_EQ(scene.radius, 0.05);
  EXPECT_EQ(scene.fiberCount(), file.strands);
  ASSERT_EQ(scene.points.size(), file.strands * file.points_per_strand);
  double shortest = std::numeric_limits<double>::infinity();
  double longest = 0;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    ASSERT_EQ(scene.point_begin[f + 1] - scene.point_begin[f], file.points_per_strand);
    for (std::size_t i = scene.point_begin[f] + 1; i < scene.point_begin[f + 1]; ++i) {
      const Point& p = scene.points[i - 1];
      const Point& q = scene.points[i];
      const double length = std::hypot(q[0] - p[0], q[1] - p[1], q[2] - p[2]);
      shortest = std::min(shortest, length);
      longest = std::max(longest, length);
    }
  }
  EXPECT_NEAR(shortest, file.shortest_segment, 0.01 * file.shortest_segment);
  EXPECT_NEAR(longest, file.longest_segment, 0.01 * file.longest_segment);
}

INSTANTIATE_TEST_SUITE_P(
    TressFx, TfxRealFileTest,
    testing::Values(RealFile{"tressfx31_ponytail_back.tfx", 517, 16, 0.2236, 2.097},
                    RealFile{"tressfx31_ponytail_front_top.tfx", 876, 16, 0.2003, 2.654},
                    RealFile{"tressfx31_ponytail_side.tfx", 3066, 16, 0.3951, 3.986},
                    RealFile{"tressfx31_ponytail_tail.tfx", 474, 16, 1.825, 6.306},
                    RealFile{"tressfx41_ratboy_mohawk.tfx", 2228, 32, 1.295e-7, 1.171e-2}),
    [](const testing::TestParamInfo<RealFile>& file) {
      return std::filesystem::path(file.param.name).stem().string();
    });

}  // namespace
}  // namespace fcl_fibers::io
