// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/file_support.h"
#include "support/temporary_file.h"

namespace fcl_fibers::io {
namespace {

using test::TemporaryFile;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

constexpr FiberFormat kHair = FiberFormat::kHair;
constexpr std::uint32_t kSegments = 1, kPoints = 2, kThickness = 4, kTransparency = 8, kColor = 16;
constexpr std::size_t kHeaderSize = 128;

FileBytes header(std::uint32_t strands, std::uint32_t points, std::uint32_t flags,
                 std::uint32_t default_segments, float default_thickness) {
  FileBytes file;
  file.text("HAIR").little(strands).little(points).little(flags);
  file.little(default_segments).little(default_thickness);
  file.little(0.5F).little(1.0F).little(2.0F).little(3.0F);  // transparency, colour
  file.text("by hand").zeros(kHeaderSize - file.size());
  return file;
}

float coordinate(std::size_t point, std::size_t k) {
  return static_cast<float>(3 * point + k) - 4.5F;
}

void addPoints(FileBytes& file, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < 3; ++k) file.little(coordinate(i, k));
  }
}

// Three strands of two points, one and four; all arrays.
FileBytes sampleFile() {
  FileBytes file =
      header(3, 7, kSegments | kPoints | kThickness | kTransparency | kColor, 99, -1.0F);
  file.little(std::uint16_t{1}).little(std::uint16_t{0}).little(std::uint16_t{3});
  addPoints(file, 7);
  for (const float thickness : {0.5F, 0.25F, 4.0F, 1.0F, 2.0F, 1.5F, 0.0F}) file.little(thickness);
  for (int i = 0; i < 7; ++i) file.little(0.125F);
  for (int i = 0; i < 21; ++i) file.little(std::nanf(""));  // colours are not read
  return file;
}
constexpr std::size_t kSegmentsAt = kHeaderSize;
constexpr std::size_t kPointsAt = kSegmentsAt + 3 * 2;
constexpr std::size_t kThicknessAt = kPointsAt + 7 * 12;

FiberFile parse(const FileBytes& file) { return parseFibers(file.bytes(), "a file", kHair); }

TEST(HairTest, ReadsStrandsOfUnequalLength) {
  // If this fails, points are read from the wrong place, or go to the wrong strand.
  const FiberFile file = parse(sampleFile());
  expectWellFormed(file.fibers);
  EXPECT_THAT(file.fibers.point_begin, ElementsAre(0, 2, 3, 7));
  ASSERT_EQ(file.fibers.points.size(), 7U);
  for (std::size_t i = 0; i < 7; ++i) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(file.fibers.points[i][k], coordinate(i, k));
  }
  EXPECT_THAT(file.fibers.closed, IsEmpty());
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST(HairTest, RadiiAreHalfTheThickness) {
  // If this fails, hair is twice as thick, or does not taper.
  EXPECT_THAT(parse(sampleFile()).fibers.radii, ElementsAre(0.25, 0.125, 2, 0.5, 1, 0.75, 0));
}

TEST(HairTest, UsesDefaultsWithoutArrays) {
  // If this fails, files without arrays of segments or thickness are refused or misread.
  FileBytes file = header(2, 6, kPoints, 2, 0.75F);
  addPoints(file, 6);
  const FiberPolylines scene = parse(file).fibers;
  EXPECT_THAT(scene.point_begin, ElementsAre(0, 3, 6));
  EXPECT_EQ(scene.radius, 0.375);
  EXPECT_THAT(scene.radii, IsEmpty());
}

TEST(HairTest, RefusesHeadersThatContradictThemselves) {
  // If this fails, counts are believed that cannot be.
  const auto refuses = [](FileBytes file, const std::string& place, const std::string& reason) {
    expectRefusal(file.bytes(), kHair, place, reason);
  };
  refuses(sampleFile().setLittle(0, 'h'), "byte 0", "does not start with HAIR");
  refuses(sampleFile().setLittle(4, 0U), "byte 4", "there are no strands");
  refuses(sampleFile().setLittle(12, kSegments), "byte 12", "there is no array of points");
  refuses(sampleFile().setLittle(12, 64U | kPoints), "byte 12", "flags are 66");
  refuses(sampleFile().setLittle(8, 8U), "byte 8", "3 strands of 8 points take 390 bytes");
  refuses(sampleFile().setLittle(8, 6U), "byte 132", "strand 2 has 3 segments and ends at point 7");
  refuses(sampleFile().setLittle(8, 2U), "byte 4", "3 strands have only 2 points");
  refuses(sampleFile().setLittle(kSegmentsAt + 4, std::uint16_t{2}), "byte 8",
          "the header has 7 points, but the strands have 6");
  FileBytes equal = header(2, 6, kPoints, 3, 0);
  addPoints(equal, 6);
  refuses(equal, "byte 16", "strand 1 has 3 segments and ends at point 8 of 6");
  // 2^32 - 1 strands and points: the sizes need more than 32 bits.
  refuses(sampleFile().setLittle(4, ~0U).setLittle(8, ~0U), "byte 8", "take 146028888158 bytes");
}

TEST(HairTest, RefusesNumbersThatAreNone) {
  // If this fails, a NaN or a negative radius enters a scene.
  for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity()}) {
    expectRefusal(sampleFile().setLittle(kPointsAt + 40, bad).bytes(), kHair,
                  "byte " + std::to_string(kPointsAt + 40), "a coordinate is ");
    expectRefusal(sampleFile().setLittle(kThicknessAt + 8, bad).bytes(), kHair,
                  "byte " + std::to_string(kThicknessAt + 8), "a thickness is ");
  }
  expectRefusal(sampleFile().setLittle(kThicknessAt, -0.5F).bytes(), kHair,
                "byte " + std::to_string(kThicknessAt), "a thickness is -0.5");
  FileBytes file = header(1, 2, kPoints, 1, -2.0F);
  addPoints(file, 2);
  expectRefusal(file.bytes(), kHair, "byte 20", "the default thickness is -2");
}

TEST(HairTest, WarnsOfWhatFollows) {
  // If this fails, a count that is too small passes unnoticed.
  EXPECT_THAT(parse(sampleFile().zeros(5)).warnings,
              testing::Contains(HasSubstr("5 bytes follow the last array, at byte 358")));
}

TEST(HairTest, DamageIsRefusedOrHarmless) {
  // If this fails, a file that was not copied to its end is read as if it were whole, or a damaged
  // one crashes the reader or yields a scene that is not one.
  expectSafeTruncations(sampleFile().bytes(), kHair, sampleFile().size());
  expectSafeBitFlips(sampleFile().bytes(), kHair);
}

TEST(HairTest, MemoryIsBoundedWhereStrandsAreShortest) {
  // If this fails, a large file takes more memory than the reader promises.
  constexpr std::uint32_t kStrands = 20000;
  for (const std::uint32_t flags : {kPoints, kPoints | kThickness}) {
    FileBytes file = header(kStrands, kStrands, flags, 0, 1);
    for (std::uint32_t i = 0; i < kStrands; ++i) file.little(0.0F).little(0.0F).little(0.0F);
    if ((flags & kThickness) != 0) {
      for (std::uint32_t i = 0; i < kStrands; ++i) file.little(static_cast<float>(i));
    }
    EXPECT_TRUE(parsesSafely(file.bytes(), kHair));
  }
}

// Fibers of unequal length, one of them closed, coordinates that floats hold.
FiberPolylines sampleScene() {
  FiberPolylines scene;
  scene.points = {{1, 2, 3}, {4, 5, -6}, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {7, 8, 9.5}};
  scene.point_begin = {0, 2, 6, 7};
  scene.closed = {0, 1, 0};
  scene.radius = 0.25;
  return scene;
}

void expectSame(const FiberPolylines& a, const FiberPolylines& b) {
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.point_begin, b.point_begin);
  EXPECT_EQ(a.closed, b.closed);
}

TEST(HairTest, WritesTheDocumentedBytes) {
  // If this fails, our files are read by nobody but us.
  FiberPolylines scene;
  scene.points = {{1, 2, 3}, {4, 5, 6}};
  scene.point_begin = {0, 2};
  scene.radius = 0.125;
  scene.radii = {0.5, 0.25};
  scene.radii_are = FiberArrays<double>::Radii::kPerPoint;
  FileBytes expected;
  expected.text("HAIR").little(1U).little(2U).little(7U).little(0U).little(0.25F);
  expected.little(0.0F).little(1.0F).little(1.0F).little(1.0F).zeros(88);
  expected.little(std::uint16_t{1});
  for (const float c : {1.0F, 2.0F, 3.0F, 4.0F, 5.0F, 6.0F, 1.0F, 0.5F}) expected.little(c);

  const TemporaryFile file(".hair");
  writeHair(file.path(), scene);
  std::ifstream stream(file.path(), std::ios::binary);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(stream), {}), expected.bytes());
}

TEST(HairTest, ReadsBackWhatWasWritten) {
  // If this fails, fibers change on the way.
  const TemporaryFile file(".hair");
  FiberPolylines scene = sampleScene();
  writeHair(file.path(), scene);
  const FiberPolylines one_radius = readFibers(file.path()).fibers;
  expectSame(one_radius, scene);
  EXPECT_EQ(one_radius.radius, 0.25);
  EXPECT_THAT(one_radius.radii, IsEmpty());

  scene.radii = {0.5, 0.5, 2, 1, 0.25, 0.25, 3};
  scene.radii_are = FiberArrays<double>::Radii::kPerPoint;
  writeHair(file.path(), scene);
  const FiberPolylines radii = readFibers(file.path()).fibers;
  expectSame(radii, scene);
  EXPECT_EQ(radii.radii, scene.radii);
}

TEST(HairTest, RefusesToWriteWhatTheFormatHasNoRoomFor) {
  // If this fails, a file is written that is refused later, or holds another scene.
  const TemporaryFile file(".hair", "as it was");
  const auto refuses = [&](const FiberPolylines& scene, const std::string& reason) {
    EXPECT_THAT([&] { writeHair(file.path(), scene); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("writeHair: " + reason)));
    std::ifstream stream(file.path());
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(stream), {}), "as it was");
  };
  refuses({}, "the number of fibers is 0");
  FiberPolylines scene = sampleScene();
  scene.point_begin = {0, 2, 6};
  refuses(scene, "point_begin ends at 6, but there are 7 points");
  scene.point_begin = {0, 2, 2, 7};
  refuses(scene, "the number of points of fiber 1 is 0; the format holds at least 1");
  scene = sampleScene();
  scene.points[3][1] = 1e39;
  refuses(scene, "a coordinate is 1e+39");
  scene.points[3][1] = std::nan("");
  refuses(scene, "a coordinate of point 3 is nan");
  scene = sampleScene();
  scene.radius = 1e39;
  refuses(scene, "thickness is 2e+39");
  scene.radius = -1;
  refuses(scene, "radius is -1");
  scene = sampleScene();
  scene.radii = {1, 2};
  refuses(scene, "the number of radii is 2");
  scene = FiberPolylines();
  scene.points.resize((std::size_t{1} << 16) + 1);
  scene.point_begin = {0, scene.points.size()};
  refuses(scene, "the number of points of fiber 0 is 65537");

  scene.points.pop_back();
  scene.point_begin = {0, scene.points.size()};
  writeHair(file.path(), scene);
  EXPECT_EQ(readFibers(file.path()).fibers.segmentCount(), 65535U);
}

TEST(HairTest, SaysWhereItCannotWrite) {
  // If this fails, a lost file passes for a saved one.
  EXPECT_THAT(
      [] { writeHair("/no/such/file.hair", sampleScene()); },
      ThrowsMessage<std::runtime_error>(HasSubstr("'/no/such/file.hair' cannot be opened")));
  if (std::ofstream("/dev/full")) {
    EXPECT_THAT([] { writeHair("/dev/full", sampleScene()); },
                ThrowsMessage<std::runtime_error>(HasSubstr("'/dev/full': writing failed")));
  }
}

}  // namespace
}  // namespace fcl_fibers::io
