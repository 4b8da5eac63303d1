// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/file_support.h"

namespace fcl_fibers::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr FiberFormat kTck = FiberFormat::kTck;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Lines of a header after the first, with the place of the points.
std::string header(const std::string& lines) {
  const std::string start = "mrtrix tracks\n" + lines + "file: . ";
  constexpr std::size_t kRest = 9;  // four digits and "\nEND\n"
  const std::string offset = std::to_string(start.size() + kRest);
  return start + std::string(4 - offset.size(), '0') + offset + "\nEND\n";
}

class Tracks {
 public:
  explicit Tracks(std::string datatype = "Float32LE", const std::string& lines = "count: 2\n")
      : datatype_(std::move(datatype)) {
    file_.text(header("datatype: " + datatype_ + "\n" + lines));
  }

  Tracks& point(double x, double y, double z) {
    for (const double c : {x, y, z}) add(c);
    return *this;
  }
  Tracks& all(double c) { return point(c, c, c); }
  Tracks& text(const std::string& text) {
    file_.text(text);
    return *this;
  }
  /// Two streamlines without their end marks.
  Tracks& first() { return point(1, 2, 3).point(-4, 0.5, 6).point(7, 8, -9.25); }
  Tracks& second() { return point(10, 20, 30).point(40, 50, 60); }

  const std::string& bytes() const { return file_.bytes(); }

 private:
  void add(double c) {
    const auto number = static_cast<float>(c);
    const bool is_big = datatype_.substr(7) == "BE";
    if (datatype_.substr(5, 2) == "64") {
      is_big ? file_.big(c) : file_.little(c);
    } else {
      is_big ? file_.big(number) : file_.little(number);
    }
  }

  std::string datatype_;
  FileBytes file_;
};

std::string sample(const std::string& datatype = "Float32LE",
                   const std::string& lines = "count: 2\n") {
  return Tracks(datatype, lines).first().all(kNan).second().all(kNan).all(kInfinity).bytes();
}

FiberFile parse(const std::string& bytes) { return parseFibers(bytes, "a file", kTck); }

void expectSample(const FiberFile& file, const std::vector<std::size_t>& begin = {0, 3, 5}) {
  expectWellFormed(file.fibers);
  EXPECT_EQ(file.fibers.point_begin, begin);
  EXPECT_THAT(file.fibers.points, ElementsAre(Point{1, 2, 3}, Point{-4, 0.5, 6}, Point{7, 8, -9.25},
                                              Point{10, 20, 30}, Point{40, 50, 60}));
  EXPECT_FALSE(file.has_radius);
}

class TckTest : public testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(Datatype, TckTest,
                         testing::Values("Float32LE", "Float32BE", "Float64LE", "Float64BE"),
                         [](const auto& datatype) { return std::string(datatype.param); });

TEST_P(TckTest, ReadsWhatWasWritten) {
  // If this fails, points are read from the wrong place, in the wrong order or of the wrong size.
  const std::string bytes = sample(GetParam());
  EXPECT_EQ(recognizeFormat(bytes, "a file"), kTck);
  const FiberFile file = parse(bytes);
  expectSample(file);
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST_P(TckTest, DamageIsRefusedOrHarmless) {
  // If this fails, a file that was not copied to its end passes for whole, or a damaged one crashes
  // the reader or yields a scene that is not one.
  expectToldTruncations(sample(GetParam()), kTck);
  expectSafeBitFlips(sample(GetParam()), kTck);
}

TEST(TckHeaderTest, ToleratesWhatProgramsWrite) {
  // If this fails, files of other programs are refused, or read from a wrong place.
  for (const char* lines :
       {"", "count: 0\n", "count: 0000000002\ntimestamp: 12:30\n", "\nroi: seed file.mif\n  more\n",
        "command_history: tckgen a: b c\nEND of the world\nmax_dist: 250\ntotal_count: 7\n"}) {
    SCOPED_TRACE(lines);
    const FiberFile file = parse(sample("Float32LE", lines));
    expectSample(file);
    EXPECT_THAT(file.warnings, IsEmpty());
  }
  expectSample(
      parse(FileBytes()
                .text("mrtrix tracks  \r\n datatype :  float32le \r\nfile:. 0080\r\nEND\r\n")
                .zeros(20)
                .text(sample().substr(sample().find("END\n") + 4))
                .bytes()));
}

TEST(TckHeaderTest, BlanksMayStandForTheLastLineFeed) {
  // If this fails, a header that ends where it says is taken for one without an end.
  std::string bytes = sample();
  const std::size_t end = bytes.find("END\n") + 3;
  for (const char blank : {' ', '\t'}) {
    bytes[end] = blank;
    expectSample(parse(bytes));
  }
  bytes[end] = 'x';
  expectRefusal(bytes, kTck, "line 5", "no line END");
}

TEST(TckHeaderTest, WarnsOfAnotherCount) {
  // If this fails, streamlines are missing and nobody is told.
  const auto warnings = [](const std::string& count) {
    return parse(sample("Float32LE", "count: " + count + "\n")).warnings;
  };
  EXPECT_THAT(warnings("3"), ElementsAre("The header's count is '3', but the file has 2 "
                                         "streamlines; it may be truncated."));
  for (const char* bad : {"1", "-2", "2.0", "many", "99999999999999999999"}) {
    EXPECT_THAT(warnings(bad), ElementsAre(HasSubstr(bad))) << bad;
  }
}

TEST(TckHeaderTest, SaysWhereItIsMalformed) {
  // If this fails, a broken file is read as something else, or its author has to guess.
  const auto refuses = [](const std::string& text, const std::string& line,
                          const std::string& reason) {
    expectRefusal("mrtrix tracks" + text + std::string(240, '\0'), kTck, line, reason);
  };
  const std::string type = "\ndatatype: Float32LE";
  expectRefusal("", kTck, "line 1", "does not start with 'mrtrix tracks'");
  refuses("s\n", "line 1", "does not start with 'mrtrix tracks'");
  refuses(type + "\nfile: . 60\n", "line 4", "no line END");
  refuses("\nfile: . 60\nEND\n", "line 4", "no 'datatype:'");
  refuses(type + "\nEND\n", "line 4", "no 'file:'");
  refuses(type + type + "\nfile: . 80\nEND\n", "line 3", "a second 'datatype:'");
  refuses(type + "\nfile: . 90\nfile: . 90\nEND\n", "line 4", "a second 'file:'");
  for (const char* bad : {"", "Float32", "Float16LE", "Int32LE", "Float32LEx", "Float64 LE"}) {
    refuses("\ndatatype: " + std::string(bad) + "\nfile: . 90\nEND\n", "line 2", "datatype is '");
  }
  refuses(type + "\nfile: tracks.dat 0\nEND\n", "line 3", "in another file");
  refuses(type + "\nfile: 90\nEND\n", "line 3", "in another file");
  for (const char* bad : {"", "-1", "9x", "1e2", "99999999999999999999", "90 91"}) {
    refuses(type + "\nfile: . " + std::string(bad) + "\nEND\n", "line 3", "is no whole number");
  }
  refuses(type + "\nfile: . 48\nEND\n", "line 3", "points start at byte 48, inside the header");
  refuses(type + "\nfile: . 999\nEND\n", "line 3", "points start at byte 999 of a file of");
  refuses(type + "\nfile: . 18446744073709551615\nEND\n", "line 3", "points start at byte 1844");
}

TEST(TckStreamlineTest, ThoseWithoutPointsAreKept) {
  // If this fails, all streamlines after one without points have the number of another.
  Tracks tracks("Float32LE", "count: 5\n");
  tracks.all(kNan).first().all(kNan).all(kNan).second().all(kNan).all(kNan).all(kInfinity);
  const FiberFile file = parse(tracks.bytes());
  expectSample(file, {0, 0, 3, 3, 5, 5});
  EXPECT_THAT(file.warnings, IsEmpty());
  Tracks one("Float32LE", "");
  one.all(kNan).first().all(kNan).second().all(kNan).all(-kInfinity);
  expectSample(parse(one.bytes()), {0, 0, 3, 5});
}

TEST(TckStreamlineTest, AFileWithoutAnyIsRefused) {
  // If this fails, an empty scene hides that a file is broken.
  const auto refuses = [](const Tracks& tracks) {
    const std::size_t begin = tracks.bytes().find("END\n") + 4;
    expectRefusal(tracks.bytes(), kTck, "byte " + std::to_string(begin),
                  "there are no streamlines");
  };
  refuses(Tracks());
  refuses(Tracks().all(kInfinity));
  refuses(Tracks().all(kNan).all(kNan).all(kInfinity));
  refuses(Tracks().all(kInfinity).first().all(kNan));
  refuses(Tracks().text("short"));
}

TEST(TckStreamlineTest, MissingMarksAreWarnedOf) {
  // If this fails, an unfinished streamline is lost or passes for a whole one.
  const auto warnings = [](const Tracks& tracks) {
    const FiberFile file = parse(tracks.bytes());
    expectSample(file);
    return file.warnings;
  };
  const auto no_end = HasSubstr("The file has no end mark");
  EXPECT_THAT(warnings(Tracks().first().all(kNan).second().all(kNan)), ElementsAre(no_end));
  EXPECT_THAT(warnings(Tracks().first().all(kNan).second()), ElementsAre(no_end));
  EXPECT_THAT(warnings(Tracks().first().all(kNan).second().text("0123456789")),
              ElementsAre(no_end));
  EXPECT_THAT(warnings(Tracks().first().all(kNan).second().all(kInfinity)),
              ElementsAre(HasSubstr("The last streamline has no end")));
  EXPECT_THAT(warnings(Tracks().first().all(kNan).second().all(kNan).all(kInfinity).text("abc")),
              ElementsAre(HasSubstr("3 bytes follow")));
}

TEST(TckStreamlineTest, RefusesPointsThatAreNoNumbersInPart) {
  // If this fails, a NaN enters a scene, or damage ends a streamline.
  const auto refuses = [](double x, double y, double z, const std::string& point) {
    Tracks tracks;
    tracks.point(1, 2, 3);
    const std::string place = "byte " + std::to_string(tracks.bytes().size());
    expectRefusal(tracks.point(x, y, z).all(kNan).all(kInfinity).bytes(), kTck, place,
                  "a point is " + point);
  };
  refuses(kInfinity, 2, 3, "inf 2 3");
  refuses(1, -kInfinity, 3, "1 -inf 3");
  refuses(1, 2, kNan, "1 2 nan");
  refuses(kNan, kNan, 3, "nan nan 3");
  refuses(kInfinity, kNan, kInfinity, "inf nan inf");
}

TEST(TckStreamlineTest, DoublesAreNotCoarse) {
  // If this fails, doubles are rounded to floats, or warned of as if they had been.
  Tracks tracks("Float64LE");
  tracks.point(1e9 + 0.001, 0, 0).point(1e9, 1, 0).all(kNan).second().all(kNan).all(kInfinity);
  const FiberFile file = parseFibers(tracks.bytes(), "", kTck, {0.01});
  EXPECT_EQ(file.fibers.points[0][0], 1e9 + 0.001);
  EXPECT_THAT(file.warnings, IsEmpty());
  Tracks floats;
  floats.point(1e9, 0, 0).point(1e9, 1, 0).all(kNan).second().all(kNan).all(kInfinity);
  EXPECT_THAT(parseFibers(floats.bytes(), "", kTck, {0.01}).warnings,
              ElementsAre(HasSubstr("coarse")));
}

TEST(TckMemoryTest, MemoryIsBoundedWhereStreamlinesAreShortest) {
  // If this fails, a large file takes more memory than the reader promises.
  Tracks points, fibers, empty, unended("Float32LE", "count: 99999999999\n");
  for (int i = 0; i < 20000; ++i) {
    points.all(1);
    fibers.all(1).all(kNan);
    empty.all(kNan);
    unended.all(i);
  }
  EXPECT_TRUE(parsesSafely(points.all(kNan).all(kInfinity).bytes(), kTck));
  EXPECT_TRUE(parsesSafely(fibers.all(kInfinity).bytes(), kTck));
  EXPECT_FALSE(parsesSafely(empty.all(kInfinity).bytes(), kTck));
  EXPECT_TRUE(parsesSafely(unended.bytes(), kTck));
}

}  // namespace
}  // namespace fcl_fibers::io
