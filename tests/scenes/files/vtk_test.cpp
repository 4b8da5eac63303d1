// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "file_support.h"

namespace fcl_fibers::scenes {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr FiberFormat kVtk = FiberFormat::kVtk;

FiberFile parse(const std::string& bytes) { return parseFibers(bytes, "a file", kVtk); }

std::string head(const std::string& version, const std::string& kind) {
  return "# vtk DataFile Version " + version + "\nby hand\n" + kind + "\nDATASET POLYDATA\n";
}

const char kPoints[] = "POINTS 5 float\n0 0 0 1 0 0\n1 1 0 0 1 0.5\n7 8 9\n";

// A closed line, and one of two points.
const char kLines[] = "LINES 2 8\n4 0 1 2 0\n2 3 4\n";

std::string asciiFile() { return head("3.0", "ASCII") + kPoints + kLines; }

std::string binaryFile() {
  FileBytes file;
  file.text(head("2.0", "BINARY")).text("POINTS 5 double\n");
  for (const double c : kTwoLinesPoints) file.big(c);
  file.text("\nVERTICES 1 2\n").big(1).big(2);
  file.text("\nLINES 2 8\n");
  for (const int i : {4, 0, 1, 2, 0, 2, 3, 4}) file.big(i);
  return file.text("\n").bytes();
}

// Of version 5: offsets and connectivity, the first binary and of mixed widths.
std::string binaryFileOfVersion5() {
  FileBytes file;
  file.text(head("5.1", "BINARY")).text("POINTS 5 float\n");
  for (const float c : kTwoLinesPoints) file.big(c);
  file.text("\nMETADATA\nINFORMATION 0\n\nLINES 3 6\nOFFSETS vtktypeint64\n");
  for (const std::int64_t i : {0, 4, 6}) file.big(i);
  file.text("\nCONNECTIVITY vtktypeint32\n");
  for (const int i : kTwoLinesIndices) file.big(i);
  return file.text("\n").bytes();
}

std::string asciiFileOfVersion5() {
  return head("5.1", "ASCII") + kPoints +
         "LINES 3 6\nOFFSETS vtktypeint64\n0 4 6\nCONNECTIVITY vtktypeint64\n0 1 2 0 3 4\n";
}

std::vector<std::string> sampleFiles() {
  return {asciiFile(), binaryFile(), asciiFileOfVersion5(), binaryFileOfVersion5()};
}

TEST(VtkTest, ReadsAllFourLayouts) {
  // If this fails, points or lines are read from the wrong place, order or byte order.
  for (const std::string& bytes : sampleFiles()) expectTwoLines(parse(bytes));
}

TEST(VtkTest, SkipsWhatIsNoLine) {
  // If this fails, files with other cells, fields or data are refused or misread.
  expectTwoLines(parse(
      head("4.2", "ascii") +
      "FIELD FieldData 2\ntime 1 1 double\n0.5\nMETADATA\nINFORMATION 1\nNAME x LOCATION y\n\n"
      "name%20 2 2 int\n1 2\n3 4\n" +
      kPoints + "METADATA\nINFORMATION 0\n\nVERTICES 1 2\n1 0\npolygons 1 4\n3 0 1 2\n" + kLines +
      "TRIANGLE_STRIPS 1 4\n3 0 1 2\nCELL_DATA 4\nwhatever follows"
      "\n"));
}

TEST(VtkTest, SaysWhereTextIsMalformed) {
  // If this fails, a broken file is read as something else, or its author has to guess.
  const auto refuses = [](const std::string& bytes, const std::string& place,
                          const std::string& reason) { expectRefusal(bytes, kVtk, place, reason); };
  const std::string start = head("3.0", "ASCII");
  const std::string points = start + kPoints;
  refuses("", "line 1", "does not start with '# vtk DataFile Version '");
  refuses(head("6.0", "ASCII"), "line 1", "version is '6.0', known are 1 to 5");
  refuses(head("3.0", "ascii2"), "line 3", "'ascii2' is neither ASCII nor BINARY");
  refuses("# vtk DataFile Version 3.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\n", "line 3",
          "'dataset unstructured_grid' is not DATASET POLYDATA");
  refuses(start, "line 5", "there are no lines");
  refuses(points, "line 9", "there are no lines");
  refuses(points + "LINES 0 0\n", "line 10", "there are no lines");
  refuses(start + "POINTS 1 int\n0 0 0\n", "line 5", "points are of type int");
  refuses(start + "POINTS 1 float128\n0 0 0\n", "line 5", "'float128' are not read");
  refuses(start + "POINTS 2 float\n0 0 0\n", "line 5", "have 6 numbers, the file has room for 4");
  refuses(start + "POINTS 6148914691236517206 float\n0 0 0\n", "line 7", "inside the points");
  refuses(start + "POINTS -1 float\n", "line 5", "'-1' is no whole number that fits");
  refuses(start + "POINTS 1 float\n0 nan 0\n", "line 6", "'nan' is no finite number");
  refuses(start + kLines + kPoints, "line 6", "a line has point 0, there are 0 before the lines");
  refuses(points + kPoints, "line 9", "there are two sets of points");
  refuses(points + kLines + kLines, "line 12", "there are two sets of lines");
  refuses(points + "LINES 1 3\n2 0 5\n", "line 10", "a line has point 5, there are 5");
  refuses(points + "LINES 1 3\n2 0 -1\n", "line 10", "the lines have a number of -1");
  refuses(points + "LINES 1 3\n0 0 1\n", "line 10", "line 0 has no points");
  refuses(points + "LINES 1 3\n3 0 1\n", "line 10", "there are 2 numbers left of 3");
  refuses(points + "LINES 1 4\n2 0 1 2\n", "line 9", "1 lines have 3 numbers, not 4");
  refuses(points + "LINES 3 4\n1 0 1 1\n", "line 9", "3 lines have more than 4 numbers");
  refuses(points + "LINES 1 99999999999\n2 0 1\n", "line 9", "have 99999999999 numbers");
  refuses(points + "LINES 1 3\n2 0 1.5\n", "line 10", "'1.5' is no whole number");
  refuses(points + "NORMALS\n", "line 9", "'normals' is no keyword of polygonal data");
  refuses(points + "FIELD f 1\na 4294967296 4294967296 int\n", "line 10",
          "an array has 4294967296");
  refuses(points + "FIELD f 1\na 1 1 string\nhello\n", "line 10", "'string' are not read");

  const std::string points5 = head("5.1", "ASCII") + kPoints + "LINES 3 6\n";
  const std::string indices = "CONNECTIVITY vtktypeint64\n0 1 2 0 3 4\n";
  refuses(points5 + "4 0 1 2 0\n", "line 10", "'4' is not OFFSETS");
  refuses(points5 + "OFFSETS float\n0 4 6\n" + indices, "line 10", "indices are of type float");
  for (const char* bad : {"1 4 6", "0 0 6", "0 5 4", "0 4 7"}) {
    refuses(points5 + "OFFSETS vtktypeint64\n" + bad + "\n" + indices, "line 11",
            "the offsets do not ascend strictly from 0 to 6");
  }
  refuses(points5 + "OFFSETS vtktypeint64\n0 4 5\n" + indices, "line 9",
          "the offsets end at 5 of 6 points");
}

TEST(VtkTest, SaysWhichByteIsMalformed) {
  // If this fails, a broken file is read as something else, or its author has to guess.
  FileBytes file;
  file.text(head("3.0", "BINARY")).text("POINTS 2 float\n");
  const std::string at = std::to_string(file.size());
  for (const float c : {0.F, 1.F, 2.F, 3.F, 4.F}) file.big(c);
  FileBytes infinite = file;
  expectRefusal(infinite.big(HUGE_VALF).bytes(), kVtk, "byte " + std::to_string(file.size()),
                "a coordinate is inf");
  expectRefusal(file.bytes(), kVtk, "byte " + std::to_string(std::stoul(at) - 1),
                "the points have 6 numbers, the file has room for 5");
  file.big(5.F).text("\nLINES 1 3\n").big(2).big(0);
  const std::string index_at = std::to_string(file.size());
  expectRefusal(file.big(-2).bytes(), kVtk, "byte " + index_at, "the lines have a number of -2");
}

TEST(VtkTest, WarnsOfALastLineWithoutEnd) {
  // If this fails, a point 12 that was cut to 1 is read without a word.
  const std::string text = asciiFile();
  EXPECT_THAT(parse(text.substr(0, text.size() - 1)).warnings,
              ElementsAre(HasSubstr("may have been cut off")));
}

TEST(VtkTest, DamageIsRefusedOrHarmless) {
  // If this fails, a file that was not copied to its end is read as if it were whole, or a damaged
  // one crashes the reader or yields a scene that is not one.
  for (const std::string& bytes : sampleFiles()) {
    expectSafeTruncations(bytes, kVtk, bytes.size() - 1);
    expectSafeBitFlips(bytes, kVtk);
  }
}

TEST(VtkTest, MemoryIsBoundedWhereNumbersAreShortest) {
  // If this fails, a large file takes more memory than the reader promises.
  std::string points = head("3.0", "ASCII") + "POINTS 50000 float\n";
  std::string lines = "LINES 50000 100000\n";
  std::string one_line = "LINES 1 50001\n50000 ";
  for (int i = 0; i < 50000; ++i) {
    points += "0 0 0 ";
    lines += "1 0 ";
    one_line += "0 ";
  }
  EXPECT_TRUE(parsesSafely(points + "\n" + lines, kVtk));
  FileBytes binary;
  binary.text(head("3.0", "BINARY") + "POINTS 1 float\n").zeros(12);
  binary.text("\nLINES 1 50001\n").big(50000).zeros(4 * 50000);
  EXPECT_TRUE(parsesSafely(binary.bytes(), kVtk));
  EXPECT_TRUE(parsesSafely(head("3.0", "ASCII") + "POINTS 1 float\n0 0 0\n" + one_line, kVtk));
}

// The points of the lines of the files that VTK wrote.
const std::vector<int> kWrittenPoints = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 6, 3, 10, 11};

class VtkWrittenByVtkTest : public testing::TestWithParam<const char*> {};

TEST_P(VtkWrittenByVtkTest, IsReadAsItIs) {
  // If this fails, we read what we write, and not what VTK does.
  const FiberFile file =
      readFibers(FCL_FIBERS_SOURCE_DIR "/tests/data/" + std::string(GetParam()), {0.1});
  const bool is_xml = std::string(GetParam()).find(".vtp") != std::string::npos;
  EXPECT_EQ(file.format, is_xml ? FiberFormat::kVtp : kVtk);
  expectWellFormed(file.scene);
  EXPECT_THAT(file.scene.point_begin, ElementsAre(0, 4, 6, 11, 14));
  EXPECT_THAT(file.scene.closed, ElementsAre(0, 0, 1, 0));
  ASSERT_EQ(file.scene.points.size(), kWrittenPoints.size());
  for (std::size_t i = 0; i < kWrittenPoints.size(); ++i) {
    const double j = kWrittenPoints[i];
    EXPECT_EQ(file.scene.points[i], (Point{0.5 * j, 0.25 * j * j, -1.125 * j}));
  }
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST(VtkRadiiTest, OfAFileWrittenByVtkAreRead) {
  // If this fails, we read radii as we write them, and not as VTK does.
  const FiberFile file = readFibers(FCL_FIBERS_SOURCE_DIR "/tests/data/radii.vtp");
  EXPECT_TRUE(file.has_radius);
  expectWellFormed(file.scene);
  ASSERT_EQ(file.scene.radii.size(), kWrittenPoints.size());
  const auto radius = [](std::size_t i) { return 0.5 + 0.25 * (kWrittenPoints[i] % 5); };
  for (std::size_t f = 0; f < file.scene.fiberCount(); ++f) {
    for (std::size_t i = file.scene.point_begin[f]; i + 1 < file.scene.point_begin[f + 1]; ++i) {
      EXPECT_EQ(file.scene.radii[i], std::max(radius(i), radius(i + 1))) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    File, VtkWrittenByVtkTest,
    testing::Values("legacy_v42_ascii_float.vtk", "legacy_v42_binary_double.vtk",
                    "legacy_v51_ascii_double.vtk", "legacy_v51_binary_float.vtk",
                    "ascii_none_little_h32_float.vtp", "binary_none_big_h64_double.vtp",
                    "binary_zlib_little_h32_float.vtp", "appended_raw_none_little_h64_double.vtp",
                    "appended_raw_zlib_big_h32_float.vtp",
                    "appended_base64_zlib_little_h64_double.vtp"),
    [](const auto& file) {
      const std::string name = file.param;
      return name.substr(0, name.find('.'));
    });

}  // namespace
}  // namespace fcl_fibers::scenes
