// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
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

constexpr FiberFormat kSwc = FiberFormat::kSwc;

FiberFile parse(const std::string& text) { return parseFibers(text, "a file", kSwc); }

const std::vector<std::string> kNeuron = {
    "1 1 0 0 0 4 -1\n",                                // a soma with two stems
    "2 3 1 0 0 2 1\n",     "3 3 2 0 0 1 2\n",          // the first stem, which forks
    "4 3 3 1 0 0.5 3\n",   "5 3 4 2 0 0.25 4\n",       // one twig
    "6 3 3 -1 0 0.75 3\n",                             // and the other
    "9 2 -1 0.5 0 1 1\n",  "12 2 -2 -1e-3 .5 0.5 9\n"  // the second stem, after a gap
};

std::string text(const std::vector<std::string>& lines) {
  std::string all = "# a neuron\n";
  for (const std::string& line : lines) all += line;
  return all;
}

TEST(SwcTest, SplitsAtBranchingPoints) {
  // If this fails, segments are lost, doubled or joined across a fork, or thinner than the neuron.
  EXPECT_EQ(recognizeFormat(text(kNeuron), "a.SWC"), kSwc);
  const FiberFile file = parse(text(kNeuron));
  expectWellFormed(file.fibers);
  EXPECT_THAT(file.fibers.point_begin, ElementsAre(0, 3, 6, 8, 11));
  const Point soma = {0, 0, 0}, fork = {2, 0, 0};
  EXPECT_THAT(file.fibers.points,
              ElementsAre(soma, Point{1, 0, 0}, fork, fork, Point{3, 1, 0}, Point{4, 2, 0}, fork,
                          Point{3, -1, 0}, soma, Point{-1, 0.5, 0}, Point{-2, -1e-3, 0.5}));
  EXPECT_THAT(file.fibers.radii, ElementsAre(4, 2, 1, 1, 0.5, 0.25, 1, 0.75, 4, 1, 0.5));
  EXPECT_THAT(file.fibers.starts_at, ElementsAre(-1, 2, 2, 0));
  EXPECT_THAT(file.fibers.ends_at, IsEmpty());
  EXPECT_THAT(file.fibers.samples, ElementsAre(1, 2, 3, 3, 4, 5, 3, 6, 1, 9, 12));
  EXPECT_THAT(file.fibers.types, ElementsAre(1, 3, 3, 3, 3, 3, 3, 3, 1, 2, 2));
  EXPECT_TRUE(file.has_radius);
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST(SwcTest, TypesMayBeGroups) {
  // If this fails, fibers are in the group of the soma where they start, or of another fiber.
  FiberFileOptions options;
  options.groups_from = "type";
  const FiberFile file = parseFibers(text(kNeuron), "a file", kSwc, options);
  EXPECT_THAT(file.fibers.groups, ElementsAre(2, 2, 2, 1));
  EXPECT_THAT(file.group_values, ElementsAre(2, 3));
  EXPECT_THAT(file.warnings, IsEmpty());
  options.groups_from = "4";
  EXPECT_THAT([&] { parseFibers(text(kNeuron), "a file", kSwc, options); },
              testing::ThrowsMessage<std::invalid_argument>(HasSubstr("groups_from is '4'")));
}

TEST(SwcTest, LinesMayBeInAnyOrder) {
  // If this fails, a neuron whose children precede their parents has other segments.
  const auto segments = [](const FiberPolylines& scene) {
    std::vector<std::vector<double>> all;
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      for (std::size_t i = scene.point_begin[f]; i + 1 < scene.point_begin[f + 1]; ++i) {
        const Point &p = scene.points[i], &q = scene.points[i + 1];
        all.push_back({p[0], p[1], p[2], q[0], q[1], q[2], scene.radiusAt(i)});
      }
    }
    std::sort(all.begin(), all.end());
    return all;
  };
  const std::vector<std::vector<double>> expected = segments(parse(text(kNeuron)).fibers);
  EXPECT_EQ(expected.size(), kNeuron.size() - 1);
  std::mt19937 random(1);
  for (int i = 0; i < 100; ++i) {
    std::vector<std::string> lines = kNeuron;
    std::shuffle(lines.begin(), lines.end(), random);
    const FiberFile file = parse(text(lines));
    expectWellFormed(file.fibers);
    EXPECT_EQ(file.fibers.fiberCount(), 4U);
    EXPECT_EQ(segments(file.fibers), expected) << text(lines);
    // Whatever comes first, each branching point is one sample, and has one fiber that starts at
    // no other: the one that ends there, or of the root the first.
    const FiberPolylines& scene = file.fibers;
    EXPECT_EQ(std::count(scene.starts_at.begin(), scene.starts_at.end(), -1), 1);
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      if (scene.starts_at[f] < 0) continue;
      const auto place = static_cast<std::size_t>(scene.starts_at[f]);
      EXPECT_EQ(scene.samples[place], scene.samples[scene.point_begin[f]]);
    }
  }
}

TEST(SwcTest, AnUnbranchedNeuronIsOneFiber) {
  // If this fails, a fiber is cut where nothing branches, or warned of.
  const FiberFile file = parse("0 0 1 2 3 2 -1\n7 0 4 5 6 2 0\n3 0 7 8 9 2 7\n");
  EXPECT_THAT(file.fibers.point_begin, ElementsAre(0, 3));
  EXPECT_THAT(file.fibers.points, ElementsAre(Point{1, 2, 3}, Point{4, 5, 6}, Point{7, 8, 9}));
  EXPECT_EQ(file.fibers.radius, 2);
  EXPECT_THAT(file.fibers.radii, IsEmpty());
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST(SwcTest, WholeNumbersMayHaveDecimals) {
  // If this fails, files are refused of programs that write all numbers with decimals.
  const FiberFile file =
      parse("1.000000 1.0 1 2 3 2 -1.000000\n2.000000 3. 4 5 6 2 1.000000\n3 3e0 7 8 9 2 2\n");
  EXPECT_THAT(file.fibers.points, ElementsAre(Point{1, 2, 3}, Point{4, 5, 6}, Point{7, 8, 9}));
}

TEST(SwcTest, SampleNumbersAreKeptWhole) {
  // If this fails, contacts name other samples than the file.
  const FiberPolylines fibers =
      parse("9007199254740993 -9007199254740993 0 0 0 3 -1\n2 3 1 0 0 .5 9007199254740993\n")
          .fibers;
  EXPECT_THAT(fibers.samples, ElementsAre(9007199254740993, 2));
  EXPECT_THAT(fibers.types, ElementsAre(-9007199254740993, 3));
}

TEST(SwcTest, NumbersMayHaveASign) {
  // If this fails, real files are refused whose author marked a number by its sign.
  const FiberFile file = parse("+1 +1 +0.5 -1 +2e+0 +3 -1\n+5 3 1 1 1 3 +1\n");
  EXPECT_THAT(file.fibers.points, ElementsAre(Point{0.5, -1, 2}, Point{1, 1, 1}));
  EXPECT_EQ(file.fibers.radius, 3);
}

TEST(SwcTest, ThereMayBeSeveralRoots) {
  // If this fails, only one of several neurons is read.
  const FiberFile file = parse("1 1 0 0 0 1 -1\n2 3 1 0 0 1 1\n10 1 5 0 0 2 -1\n11 3 6 0 0 1 10\n");
  EXPECT_THAT(file.fibers.point_begin, ElementsAre(0, 2, 4));
  EXPECT_THAT(file.fibers.radii, ElementsAre(1, 1, 2, 1));
  EXPECT_THAT(file.fibers.starts_at, IsEmpty());
}

TEST(SwcTest, ASomaWithoutChildrenIsASphere) {
  // If this fails, a soma that is drawn apart from its dendrites is missing, or touches nothing.
  const FiberFile file = parse("1 1 0 0 0 5 -1\n2 3 6 0 0 1 -1\n3 3 7 0 0 1 2\n");
  expectWellFormed(file.fibers);
  EXPECT_THAT(file.fibers.point_begin, ElementsAre(0, 2, 4));
  EXPECT_THAT(file.fibers.points,
              ElementsAre(Point{0, 0, 0}, Point{0, 0, 0}, Point{6, 0, 0}, Point{7, 0, 0}));
  EXPECT_EQ(file.fibers.radiusAt(0), 5);
  EXPECT_EQ(parse("1 1 0 0 0 5 -1\n").fibers.segmentCount(), 1U);
}

TEST(SwcTest, ASomaOfThreePointsIsACylinder) {
  // If this fails, the usual soma of three points with its stem is not what it stands for.
  const FiberFile file =
      parse("1 1 0 0 0 5 -1\n2 1 0 -5 0 5 1\n3 1 0 5 0 5 1\n4 3 9 0 0 1 1\n5 3 12 0 0 1 4\n");
  EXPECT_THAT(file.fibers.point_begin, ElementsAre(0, 2, 4, 7));
  EXPECT_THAT(file.fibers.points,
              ElementsAre(Point{0, 0, 0}, Point{0, -5, 0}, Point{0, 0, 0}, Point{0, 5, 0},
                          Point{0, 0, 0}, Point{9, 0, 0}, Point{12, 0, 0}));
  EXPECT_EQ(file.fibers.radiusAt(5), 1);
  EXPECT_THAT(file.fibers.starts_at, ElementsAre(-1, 0, 0));
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST(SwcTest, WithoutAnyRadiusThereIsNone) {
  // If this fails, a tracing without radii passes for fibers that touch nothing.
  EXPECT_FALSE(parse("1 1 0 0 0 0 -1\n2 3 1 0 0 0 1\n").has_radius);
  EXPECT_TRUE(parse("1 1 0 0 0 0 -1\n2 3 1 0 0 1 1\n").has_radius);
  EXPECT_TRUE(parseFibers("1 1 0 0 0 0 -1\n2 3 1 0 0 0 1\n", "", kSwc, {0.5}).has_radius);
}

TEST(SwcTest, ToleratesWhatProgramsWrite) {
  // If this fails, files of other programs are refused.
  const FiberFile file = parse(
      "\xEF\xBB\xBF# id type x y z\r\n\r\n  # indented\n \t1   1\t0 0 0 1 -1 \r\n"
      "2 -7 1.5e0 0 0 1 1 0.25 further # columns\n\n");
  EXPECT_THAT(file.fibers.points, ElementsAre(Point{0, 0, 0}, Point{1.5, 0, 0}));
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST(SwcTest, SaysWhereAFileIsMalformed) {
  // If this fails, a broken file is read as something else, or its author has to guess.
  const auto refuses = [](const std::string& lines, const std::string& place,
                          const std::string& reason) {
    expectRefusal("# a comment\n\n1 1 0 0 0 1 -1\n" + lines, kSwc, place, reason);
  };
  expectRefusal("", kSwc, "line 1", "there are no points");
  expectRefusal("# only\n\n", kSwc, "line 3", "there are no points");
  refuses("2 3 1 0 0 1\n", "line 4", "there are 6 columns; 7 are needed");
  refuses("2\n", "line 4", "there are 1 columns");
  refuses("2.5 3 1 0 0 1 1\n", "line 4", "'2.5' is no whole number");
  refuses("1e16 3 1 0 0 1 1\n", "line 4", "'1e16' is no whole number");
  refuses("nan 3 1 0 0 1 1\n", "line 4", "'nan' is no whole number");
  refuses("2 axon 1 0 0 1 1\n", "line 4", "'axon' is no whole number");
  refuses("2 3 1 0 0 1 1.5\n", "line 4", "'1.5' is no whole number");
  refuses("99999999999999999999 3 1 0 0 1 1\n", "line 4", "is no whole number that fits");
  refuses("-2 3 1 0 0 1 1\n", "line 4", "the id is -2");
  for (const char* bad : {"x", "nan", "inf", "1e999", "1,5", "0x1"}) {
    const std::string word = bad;
    refuses("2 3 1 0 " + word + " 1 1\n", "line 4", "'" + word + "' is no finite number");
    refuses("2 3 1 0 0 " + word + " 1\n", "line 4", "'" + word + "' is no finite number");
  }
  refuses("2 3 1 0 0 -1 1\n", "line 4", "the radius is -1");
}

TEST(SwcTest, SaysWhichPointBelongsToNoTree) {
  // If this fails, points are lost, or the reader does not come to an end.
  const auto refuses = [](const std::string& lines, const std::string& place,
                          const std::string& reason) {
    expectRefusal("\xEF\xBB\xBF# a comment\n\n1 1 0 0 0 1 -1\n" + lines, kSwc, place, reason);
  };
  refuses("2 3 1 0 0 1 1\n# 2\n2 3 2 0 0 1 1\n", "line 6", "the id 2 was there before");
  refuses("2 3 1 0 0 1 1\n1 3 2 0 0 1 -1\n", "line 5", "the id 1 was there before");
  refuses("2 3 1 0 0 1 7\n", "line 4", "the parent 7 is not in the file");
  refuses("2 3 1 0 0 1 0\n", "line 4", "the parent 0 is not in the file");
  refuses("2 3 1 0 0 1 -2\n", "line 4", "the parent -2 is not in the file");
  const std::string back = "the parents of this point lead back to it";
  refuses("2 3 1 0 0 1 2\n", "line 4", back);
  refuses("2 3 1 0 0 1 1\n3 3 1 0 0 1 4\n4 3 1 0 0 1 3\n", "line 5", back);
  // A twig that grows from a cycle is not on it.
  refuses("5 3 1 0 0 1 2\n2 3 1 0 0 1 3\n3 3 1 0 0 1 4\n4 3 1 0 0 1 2\n6 3 1 0 0 1 5\n", "line 5",
          back);
  expectRefusal("1 1 0 0 0 1 2\n2 1 0 0 0 1 1\n", kSwc, "line 1", back);
}

TEST(SwcTest, DamageIsRefusedOrWarnedOf) {
  // If this fails, a damaged file crashes the reader, or one without its last bytes passes for
  // whole though its last line is not.
  const std::string whole = text(kNeuron);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    SCOPED_TRACE("the first " + std::to_string(size) + " bytes");
    const std::string start = whole.substr(0, size);
    if (!parsesSafely(start, kSwc) || start.back() == '\n') continue;
    EXPECT_THAT(parse(start).warnings, testing::Contains(HasSubstr("may be truncated")));
  }
  expectSafeBitFlips(whole, kSwc);
}

TEST(SwcTest, ManyPointsTakeLittleTimeAndMemory) {
  // If this fails, a long or bushy neuron overflows the stack, takes hours, or takes more memory
  // than the reader promises.
  constexpr int kMany = 70000;
  std::string chain, star, comb, lone, cycle, short_lines, comments;
  for (int i = 0; i < kMany; ++i) {
    const std::string id = std::to_string(i), parent = std::to_string(i - 1);
    const std::string place = " 0 0 0 0 0 ";
    chain += id + place + parent + "\n";
    star += id + place + (i == 0 ? "-1" : "0") + "\n";
    comb += id + " 0 0 0 0 " + std::to_string(i % 3) + ' ' +
            (i == 0 ? "-1" : std::to_string(i - 1 - (i - 1) % 2)) + "\n";
    lone += id + place + "-1\n";
    cycle += id + place + std::to_string((i + 1) % kMany) + "\n";
    short_lines += "0\n";
    comments += "#\n";
  }
  EXPECT_TRUE(parsesSafely(chain, kSwc));
  EXPECT_EQ(parse(chain).fibers.fiberCount(), 1U);
  EXPECT_TRUE(parsesSafely(star, kSwc));
  EXPECT_TRUE(parsesSafely(star.substr(0, star.find("\n1000 ") + 1), kSwc));
  EXPECT_EQ(parse(star).fibers.fiberCount(), kMany - 1U);
  EXPECT_TRUE(parsesSafely(comb, kSwc));
  EXPECT_EQ(parse(comb).fibers.segmentCount(), kMany - 1U);
  EXPECT_TRUE(parsesSafely(lone, kSwc));
  EXPECT_FALSE(parsesSafely(cycle, kSwc));
  EXPECT_FALSE(parsesSafely(short_lines, kSwc));
  EXPECT_TRUE(parsesSafely(comments + "1 1 0 0 0 1 -1\n", kSwc));
}

}  // namespace
}  // namespace fcl_fibers::io
