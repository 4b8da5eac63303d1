// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/file_support.h"

namespace fcl_fibers::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr FiberFormat kPolylines = FiberFormat::kPolylines;

FiberFile parse(const std::string& text) { return parseFibers(text, "a file", kPolylines); }

const char kSample[] =
    "# x y z theta\n"
    "0 0.5 -1e-3 0.25\n"
    "\t1 2  3\r\n"
    "  \t\n"
    "\n"
    "7 8 9 not a number\n"
    "# then\n"
    "-7 .5 5e300\n";

TEST(PolylinesTest, BlankLinesSeparateFibers) {
  // If this fails, fibers are joined, or cut where people wrote comments or more columns.
  const FiberFile file = parse(kSample);
  expectWellFormed(file.fibers);
  EXPECT_THAT(file.fibers.point_begin, ElementsAre(0, 2, 4));
  EXPECT_THAT(file.fibers.points, ElementsAre(Point{0, 0.5, -1e-3}, Point{1, 2, 3}, Point{7, 8, 9},
                                              Point{-7, 0.5, 5e300}));
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("Columns after the third")));
}

TEST(PolylinesTest, CommasSemicolonsAndTabsSeparateColumns) {
  // If this fails, what a spreadsheet writes is refused, or its points are mixed up.
  for (const char* text :
       {"1,2,3\n4,5,6\n\n7,8,9\n", "1;2;3\n4;5;6\n;;\n7;8;9\n", "1\t2\t3\n4\t5\t6\n\t\t\n7\t8\t9\n",
        "1, 2 ,3, a b\r\n4 ,5,6,\r\n,,,\r\n7,8,9\r\n",
        "\xEF\xBB\xBF"
        "1 2 3 a, b\n4 5 6\n\n7;8;9;a,b\n"}) {
    SCOPED_TRACE(text);
    EXPECT_EQ(recognizeFormat(text, "a file"), kPolylines);
    const FiberFile file = parse(text);
    EXPECT_THAT(file.fibers.point_begin, ElementsAre(0, 2, 3));
    EXPECT_THAT(file.fibers.points, ElementsAre(Point{1, 2, 3}, Point{4, 5, 6}, Point{7, 8, 9}));
  }
}

FiberFile parseRadii(const std::string& text, const std::string& column) {
  FiberFileOptions options;
  options.radius_from = column;
  return parseFibers(text, "a file", kPolylines, options);
}

TEST(PolylinesTest, WarnsOfFurtherColumns) {
  // If this fails, radii in the file are lost without a word, or the number of a point that stands
  // before x is taken for x.
  EXPECT_THAT(
      parse("0 0 0 .1\n1 0 0 .2\n").warnings,
      ElementsAre("Columns after the third are passed over, in 2 lines from line 1 on; x, y "
                  "and z are the first three, and radius_from 4 takes the radius from the "
                  "fourth."));
  EXPECT_THAT(parse("# x\n0 0 0\n1,0,0,a\n").warnings,
              ElementsAre(HasSubstr("1 line from line 3 ")));
  EXPECT_THAT(parse("1 1 0 0 0 1 -1\n2 1 1 0 0 1 1\n").warnings, testing::SizeIs(1));
  for (const char* text :
       {"1 2 3\n", "1,2,3,\n", "1 2 3 \t\n", "1 2 3 # a comment\n", "1,2,3,#\n"}) {
    EXPECT_THAT(parse(text).warnings, IsEmpty()) << text;
  }
  // A radius for all does not tell what the columns are.
  EXPECT_THAT(parseFibers("0 0 0 .1\n1 0 0 .2\n", "", kPolylines, {0.5}).warnings,
              ElementsAre(HasSubstr("Columns after the third")));
}

TEST(PolylinesTest, TakesRadiiFromAColumn) {
  // If this fails, the radii of a file cannot be read, or are those of other points.
  const FiberFile file = parseRadii("0 0 0 3\n1 0 0 .5\n2 0 0 2\n\n5 5 5 1\n", "4");
  expectWellFormed(file.fibers);
  EXPECT_TRUE(file.has_radius);
  EXPECT_THAT(file.fibers.radii, ElementsAre(3, 0.5, 2, 1));
  EXPECT_THAT(file.warnings, IsEmpty());
  const FiberFile sixth = parseRadii("0;0;0;a b;;.25;c\n1;0;0;a;b;.25\n", "6");
  EXPECT_EQ(sixth.fibers.radius, 0.25);
  EXPECT_THAT(sixth.fibers.radii, IsEmpty());
  EXPECT_THAT(sixth.warnings, ElementsAre(HasSubstr("Columns after the radius are passed over")));
  EXPECT_FALSE(parseRadii("0 0 0 0\n1 0 0 0\n", "4").has_radius);
}

FiberFile parseGroups(const std::string& text, const std::string& column) {
  FiberFileOptions options;
  options.groups_from = column;
  return parseFibers(text, "a file", kPolylines, options);
}

TEST(PolylinesTest, TakesGroupsFromAColumn) {
  // If this fails, fibers are in the group of another one, or nobody is told that a fiber has
  // several numbers.
  const FiberFile file =
      parseGroups("0 0 0 7\n1 0 0 7\n\n0 0 1 -2.5\n1 0 1 -2.5\n\n9 9 9 7\n\n5 5 5 0\n", "4");
  expectWellFormed(file.fibers);
  EXPECT_THAT(file.fibers.groups, ElementsAre(3, 1, 3, 2));
  EXPECT_THAT(file.group_values, ElementsAre(-2.5, 0, 7));
  EXPECT_EQ(fiberArrays(file.fibers).groups, file.fibers.groups.data());
  EXPECT_FALSE(file.has_radius);
  EXPECT_THAT(file.warnings, IsEmpty());
  // The first point may be that of the fiber where it branches.
  const FiberFile mixed =
      parseGroups("0 0 0 1\n1 0 0 2\n2 0 0 2\n\n0 0 1 3\n1 0 0 3\n2 0 0 1\n", "4");
  EXPECT_THAT(mixed.fibers.groups, ElementsAre(2, 1));
  EXPECT_THAT(mixed.warnings, ElementsAre("Points of 1 fiber have several numbers in '4'; the "
                                          "group of a fiber is that of its last point."));
  FiberFileOptions both;
  both.radius_from = "5";
  both.groups_from = "4";
  const FiberFile other = parseFibers("0 0 0 1 .5 x\n1 0 0 1 .25\n", "", kPolylines, both);
  EXPECT_THAT(other.fibers.radii, ElementsAre(0.5, 0.25));
  EXPECT_THAT(other.fibers.groups, ElementsAre(1));
  EXPECT_THAT(other.warnings, ElementsAre(HasSubstr("Columns after the radius are passed over")));
  EXPECT_THAT(parse("0 0 0\n").fibers.groups, IsEmpty());
}

TEST(PolylinesTest, SaysWhyAColumnHoldsNoGroups) {
  // If this fails, a text or a coordinate becomes a group, or nobody is told which line is wrong.
  const auto refuses = [](const std::string& text, const std::string& reason) {
    EXPECT_THAT([&] { parseGroups(text, "5"); },
                testing::ThrowsMessage<std::runtime_error>(HasSubstr(reason)));
  };
  refuses("0 0 0 1 2\n0 0 1 1\n", "line 2: there are 4 columns; groups_from is 5");
  refuses("0 0 0 1 left\n", "line 1: 'left' is no finite number");
  for (const char* bad : {"3", "r", "type"}) {
    EXPECT_THAT([&] { parseGroups("0 0 0 1\n", bad); },
                testing::ThrowsMessage<std::invalid_argument>(
                    HasSubstr("groups_from is '" + std::string(bad))));
  }
  FiberFileOptions options;
  options.groups_from = "group";
  EXPECT_THAT(
      [&] { parseFibers("", "", FiberFormat::kTck, options); },
      testing::ThrowsMessage<std::invalid_argument>(HasSubstr("other files tell no groups")));
}

TEST(PolylinesTest, SaysWhyAColumnHoldsNoRadii) {
  // If this fails, text or a coordinate becomes a radius, or nobody is told which line is wrong.
  const auto refuses = [](const std::string& text, const std::string& column,
                          const std::string& reason) {
    EXPECT_THAT([&] { parseRadii(text, column); },
                testing::ThrowsMessage<std::runtime_error>(HasSubstr(reason)));
  };
  refuses("0 0 0 1\n0 0 1\n", "4", "line 2: there are 3 columns; radius_from is 4");
  refuses("0 0 0 1\n0 0 1 x\n", "4", "line 2: 'x' is no finite number");
  refuses("0 0 0 1\n0 0 1 -1\n", "4", "line 2: the radius is -1");
  refuses("0 0 0 1\n0 0 1 nan\n", "4", "line 2: 'nan' is no finite number");
  for (const char* bad : {"3", "0", "-4", "r", "4.0", "99999999999999999999999"}) {
    EXPECT_THAT([&] { parseRadii("0 0 0 1\n", bad); },
                testing::ThrowsMessage<std::invalid_argument>(
                    HasSubstr("radius_from is '" + std::string(bad).substr(0, 20))));
  }
}

TEST(PolylinesTest, LinesMayEndAtCarriageReturns) {
  // If this fails, text of old programs is refused, or a line that ends twice ends a fiber.
  const FiberFile file = parse("1 2 3\r4 5 6\r\r7 8 9\r");
  EXPECT_THAT(file.fibers.point_begin, ElementsAre(0, 2, 3));
  EXPECT_THAT(file.warnings, IsEmpty());
  expectRefusal("1 2 3\r4 5\r", kPolylines, "line 2", "there are 2 columns");
  expectRefusal("1 2 3\r\r\n4 5 6\r\r\n", kPolylines, "line 1", "is no finite number");
}

TEST(PolylinesTest, ErrorsTellTheRemedyOfCommonKinds) {
  // If this fails, a user sees which word is wrong, and not what to do.
  const char kHeading[] = "start headings and comments with #";
  for (const char* first :
       {"x,y,z", "x y z", "% x y z", "// x", "> 1", "\"x\",\"y\"", "id x y z"}) {
    expectRefusal(first + std::string("\n1 2 3\n"), kPolylines, "line 1", kHeading);
  }
  expectRefusal("1 2 3\nnan nan nan\n4 5 6\n", kPolylines, "line 2",
                "'nan' is no finite number; where a fiber ends, leave a line blank");
  for (const char* line : {"1,5 2,5 3,5", "1,5;2,5;3,5", "1,5\t2,5\t3,5"}) {
    expectRefusal(line + std::string("\n"), kPolylines, "line 1", "write decimals with a point");
  }
  for (const char* mark : {"\xFF\xFE", "\xFE\xFF"}) {
    const std::string text = std::string(mark) + std::string("1\0 \0 2\0", 7);
    EXPECT_EQ(recognizeFormat(text, "any name"), kPolylines);
    expectRefusal(text, kPolylines, "line 1", "the text is in UTF-16; save it in UTF-8");
    expectRefusal(text, FiberFormat::kSwc, "line 1", "the text is in UTF-16");
  }
}

TEST(PolylinesTest, NumbersMayHaveASign) {
  // If this fails, what programs write that show the sign of each number is refused.
  EXPECT_THAT(parse("+1 -2 +.5e+1\n").fibers.points, ElementsAre(Point{1, -2, 5}));
}

TEST(PolylinesTest, RefusesWhatSeparatorsMakeDoubtful) {
  // If this fails, decimal commas or empty cells give points that are not in the file.
  expectRefusal("1,5 2,5 3,5\n", kPolylines, "line 1", "'5 2' is no finite number");
  expectRefusal("1,5;2,5;3,5\n", kPolylines, "line 1", "'5;2' is no finite number");
  expectRefusal("1,5\t2,5\t3,5\n", kPolylines, "line 1", "is no finite number");
  expectRefusal("1,2,3\n1,,2,3\n", kPolylines, "line 2", "'' is no finite number");
  expectRefusal("1,2,3\n,1,2,3\n", kPolylines, "line 2", "'' is no finite number");
  expectRefusal("1,2,3\n1,2,\n", kPolylines, "line 2", "there are 2 columns");
  expectRefusal("x,y,z\n1,2,3\n", kPolylines, "line 1", "'x' is no finite number");
}

TEST(PolylinesTest, ARepeatedPointIsNoClosedFiber) {
  // If this fails, neighbours of a fiber without length are taken for those of a ring.
  EXPECT_THAT(parse("1 2 3\n1 2 3\n1 2 3\n1 2 3\n").fibers.closed, IsEmpty());
  EXPECT_THAT(parse("1 2 3\n1 2 3\n1 2 4\n1 2 3\n").fibers.closed, ElementsAre(1));
}

TEST(PolylinesTest, SaysWhereAFileIsMalformed) {
  // If this fails, a broken file is read as something else, or its author has to guess.
  expectRefusal("", kPolylines, "line 1", "there are no points");
  expectRefusal("\n# only\n\n", kPolylines, "line 4", "there are no points");
  expectRefusal("1 2 3\n4 5\n6 7 8\n", kPolylines, "line 2", "there are 2 columns; 3 are needed");
  expectRefusal("1 2 3\n\n4\n", kPolylines, "line 3", "there are 1 columns");
  for (const char* bad :
       {"x", "1e999", "nan", "inf", "1.2.3", "0x1", "+-1", "++1", "+", "1,2", "\x80\x01"}) {
    const std::string row = "1 2 " + std::string(bad) + "\n";
    expectRefusal("1 2 3\n" + row, kPolylines, "line 2", "' is no finite number");
  }
  expectRefusal("1 2 3" + std::string(99, '4') + "x\n", kPolylines, "line 1",
                "'3" + std::string(39, '4') + "...' is no finite number");
}

TEST(PolylinesTest, WarnsOfALastLineWithoutEnd) {
  // If this fails, 12.5 that was cut to 1 is read without a word.
  EXPECT_THAT(parse("1 2 3\n4 5 1").warnings, ElementsAre(HasSubstr("may be truncated")));
  EXPECT_THAT(parse("1 2 3\n4 5 1\n").warnings, IsEmpty());
}

TEST(PolylinesTest, TruncationsAreRefusedOrWarnedOf) {
  // If this fails, a file that was not copied to its end crashes the reader, or passes for whole
  // though its last line is not.
  const std::string text = kSample;
  for (std::size_t size = 0; size < text.size(); ++size) {
    SCOPED_TRACE("the first " + std::to_string(size) + " bytes");
    const std::string start = text.substr(0, size);
    if (!parsesSafely(start, kPolylines)) continue;
    const auto told = testing::Contains(HasSubstr("may be truncated"));
    if (start.back() == '\n' || start.back() == '\r') {
      EXPECT_THAT(parse(start).warnings, testing::Not(told));
    } else {
      EXPECT_THAT(parse(start).warnings, told);
    }
  }
}

TEST(PolylinesTest, AnySingleBitFlippedGivesAnErrorOrAScene) {
  // If this fails, a damaged file crashes the reader or yields a scene that is not one.
  expectSafeBitFlips(kSample, kPolylines);
}

TEST(PolylinesTest, MemoryIsBoundedWhereLinesAreShortest) {
  // If this fails, a large file takes more memory than the reader promises.
  std::string points, fibers, comments, numbers;
  for (int i = 0; i < 70000; ++i) {
    points += "0 0 0\n";
    fibers += "0 0 0\n\n";
    comments += "#\n";
    numbers += "0\n";
  }
  EXPECT_TRUE(parsesSafely(comments + "0 0 0\n", kPolylines));
  EXPECT_FALSE(parsesSafely(numbers, kPolylines));
  EXPECT_TRUE(parsesSafely(points, kPolylines));
  EXPECT_TRUE(parsesSafely(fibers, kPolylines));
  std::string radii = "0 0 0 1\n0 0 0 2\n";
  for (int i = 0; i < 70000; ++i) radii += "\n0 0 0 0\n";
  EXPECT_TRUE(parsesSafely(radii, kPolylines, "4"));
}

TEST(PolylinesTest, RealKnotIsReadAsItIs) {
  // If this fails, files of the real world are read wrongly though our own are read well.
  const std::string name = "imcder_overhand_n1.txt", path = realFile(name);
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << name << " is absent; FCL_FIBERS_DATA names the directory to look in";
  }
  const FiberFile file = readFibers(path, {0.0016});
  EXPECT_EQ(file.format, kPolylines);
  expectWellFormed(file.fibers);
  EXPECT_THAT(file.fibers.point_begin, ElementsAre(0, 301));
  EXPECT_EQ(file.fibers.points.front(),
            (Point{0, -1.449999999999999900e-01, -2.499999999999999445e-02}));
  EXPECT_EQ(file.fibers.points.back(),
            (Point{0, 1.349899999999999989e-01, -2.499999999999999445e-02}));
  EXPECT_THAT(file.fibers.closed, IsEmpty());
  EXPECT_THAT(file.warnings, IsEmpty());
}

}  // namespace
}  // namespace fcl_fibers::io
