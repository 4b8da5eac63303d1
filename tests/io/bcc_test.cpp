// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
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
using testing::ThrowsMessage;

constexpr FiberFormat kBcc = FiberFormat::kBcc;
constexpr std::size_t kHeaderSize = 64;

using Controls = std::vector<std::array<float, 3>>;

struct ControlCurve {
  Controls points;
  bool closed = false;
};

FileBytes bccFile(const std::string& type, const std::vector<ControlCurve>& curves) {
  std::uint64_t points = 0;
  for (const ControlCurve& curve : curves) points += curve.points.size();
  FileBytes file;
  file.text("BCC").text("\x44").text(type).text("\x03").text("\x02");
  file.little(std::uint64_t{curves.size()}).little(points);
  file.text("yarn by hand").zeros(kHeaderSize - file.size());
  for (const ControlCurve& curve : curves) {
    const auto count = static_cast<std::int32_t>(curve.points.size());
    file.little(curve.closed ? -count : count);
    for (const auto& point : curve.points) {
      for (const float c : point) file.little(c);
    }
  }
  return file;
}

FiberFile parse(const FileBytes& file, int segments_per_span) {
  FiberFileOptions options;
  options.segments_per_span = segments_per_span;
  return parseFibers(file.bytes(), "a file", kBcc, options);
}

const Controls kSquare = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0.5F}, {0, -1, 0}};

FileBytes sampleFile() { return bccFile("C0", {{kSquare, false}, {kSquare, true}, {{{3, 4, 5}}}}); }

TEST(BccTest, CatmullRomPassesThroughItsControlPoints) {
  // If this fails, the yarn is somewhere else.
  const FiberFile file = parse(sampleFile(), 4);
  const FiberPolylines& scene = file.fibers;
  expectWellFormed(scene);
  EXPECT_THAT(scene.point_begin, ElementsAre(0, 13, 30, 31));
  EXPECT_THAT(scene.closed, ElementsAre(0, 1, 0));
  for (std::size_t i = 0; i < 4; ++i) {
    const Point control = {kSquare[i][0], kSquare[i][1], kSquare[i][2]};
    EXPECT_EQ(scene.points[4 * i], control);
    EXPECT_EQ(scene.points[13 + 4 * i], control);
  }
  EXPECT_EQ(scene.points[29], scene.points[13]);
  EXPECT_EQ(scene.points[30], (Point{3, 4, 5}));
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST(BccTest, CatmullRomHasTheTangentsOfItsNeighbours) {
  // If this fails, spans have another shape between the control points. The span as Hermite's cubic
  // with tangents (next - previous) / 2: at its middle (p + q) / 2 + (tangent p - tangent q) / 8.
  const FiberPolylines scene = parse(bccFile("C0", {{kSquare, true}}), 2).fibers;
  ASSERT_EQ(scene.points.size(), 9U);
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto control = [&](std::size_t j) { return double{kSquare[(i + j) % 4][k]}; };
      const double tangent_p = (control(1) - control(3)) / 2;
      const double tangent_q = (control(2) - control(0)) / 2;
      const double middle = (control(0) + control(1)) / 2 + (tangent_p - tangent_q) / 8;
      EXPECT_NEAR(scene.points[2 * i + 1][k], middle, 1e-15);
    }
  }
}

TEST(BccTest, BSplineIsThatOfDeBoor) {
  // If this fails, B-splines have another shape. De Boor's recurrence over uniform knots instead of
  // the cubic's weights.
  constexpr int kSteps = 5;
  const Controls controls = {{1, 0, 2}, {0, 1, 3}, {-1, 0, 0.5F}, {0, -1, 0}, {5, -2, 1}};
  const FiberPolylines scene = parse(bccFile("BS", {{controls, true}}), kSteps).fibers;
  ASSERT_EQ(scene.points.size(), 5U * kSteps + 1);
  for (std::size_t span = 0; span < 5; ++span) {
    for (int step = 0; step < kSteps; ++step) {
      const double t = static_cast<double>(step) / kSteps;
      for (std::size_t k = 0; k < 3; ++k) {
        std::array<double, 4> d;
        for (std::size_t j = 0; j < 4; ++j) d[j] = double{controls[(span + j + 4) % 5][k]};
        for (std::size_t r = 1; r <= 3; ++r) {
          for (std::size_t j = 3; j >= r; --j) {
            const double a = (t + 3 - static_cast<double>(j)) / static_cast<double>(4 - r);
            d[j] = (1 - a) * d[j - 1] + a * d[j];
          }
        }
        const std::size_t i = span * kSteps + static_cast<std::size_t>(step);
        EXPECT_NEAR(scene.points[i][k], d[3], 1e-14) << i;
      }
    }
  }
}

TEST(BccTest, OpenCurvesReachTheirEnds) {
  // If this fails, the ends of a yarn are missing, and what touches there.
  for (const std::string type : {"C0", "BS"}) {
    for (const std::size_t count : {2U, 3U, 4U}) {
      const Controls controls(kSquare.begin(), kSquare.begin() + static_cast<int>(count));
      const FiberPolylines scene = parse(bccFile(type, {{controls, false}}), 3).fibers;
      ASSERT_EQ(scene.points.size(), 3 * (count - 1) + 1);
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(scene.points.front()[k], controls.front()[k], 1e-15) << type << count;
        EXPECT_NEAR(scene.points.back()[k], controls.back()[k], 1e-15) << type << count;
      }
    }
  }
}

TEST(BccTest, OneSegmentASpanJoinsControlPoints) {
  // If this fails, the option has no effect, or one beyond its name.
  EXPECT_EQ(parse(sampleFile(), 1).fibers.points.size(), 4U + 5U + 1U);
  EXPECT_EQ(parse(sampleFile(), 1000).fibers.points.size(), 3001U + 4001U + 1U);
  for (const int bad : {-1, 0, 1001}) {
    EXPECT_THAT([&] { parse(sampleFile(), bad); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("segments_per_span is ")));
  }
}

TEST(BccTest, RefusesOtherKindsOfFiles) {
  // If this fails, numbers of another size or curves of another kind are read as what they are not.
  expectRefusal(sampleFile().setLittle(0, 'b').bytes(), kBcc, "byte 0", "does not start with BCC");
  expectRefusal(sampleFile().setLittle(3, '\x88').bytes(), kBcc, "byte 3",
                "sizes of numbers are 136");
  expectRefusal(sampleFile().setLittle(5, '1').bytes(), kBcc, "byte 4", "the curve type is 'C1'");
  expectRefusal(sampleFile().setLittle(6, '\x02').bytes(), kBcc, "byte 6", "dimensions are 2");
}

TEST(BccTest, RefusesCountsThatContradictThemselves) {
  // If this fails, counts are believed that cannot be.
  const auto refuses = [](FileBytes file, const std::string& place, const std::string& reason) {
    expectRefusal(file.bytes(), kBcc, place, reason);
  };
  const std::uint64_t huge = std::uint64_t{1} << 61;  // times 12 wraps around to 2^62
  refuses(sampleFile().setLittle(8, std::uint64_t{0}), "byte 8", "there are no curves");
  refuses(sampleFile().setLittle(8, huge), "byte 8", "end beyond the file of 184 bytes");
  refuses(sampleFile().setLittle(16, huge), "byte 8", "end beyond the file of 184 bytes");
  refuses(sampleFile().setLittle(16, std::uint64_t{8}), "byte 168",
          "curve 2 has 1 control points, but only 0 of 8 are left");
  refuses(bccFile("C0", {{kSquare}}).zeros(12).setLittle(16, std::uint64_t{5}), "byte 16",
          "the header has 5 control points, but the curves have 4");
  refuses(sampleFile().setLittle(64, 0), "byte 64", "curve 0 has no control points");
  refuses(sampleFile().setLittle(64, -2), "byte 64", "the closed curve 0 has 2 control points");
  refuses(sampleFile().setLittle(64, std::numeric_limits<std::int32_t>::min()), "byte 64",
          "curve 0 has 2147483648 control points");
  refuses(sampleFile().setLittle(72, std::nanf("")), "byte 72", "a coordinate is nan");
}

TEST(BccTest, WarnsOfWhatFollows) {
  // If this fails, a count that is too small passes unnoticed.
  EXPECT_THAT(parse(sampleFile().zeros(3), 1).warnings,
              ElementsAre(HasSubstr("3 bytes follow the last array, at byte 184")));
}

TEST(BccTest, MemoryIsBoundedWhereCurvesAreShortestOrLongest) {
  // If this fails, a large file takes more memory than the reader promises.
  const ControlCurve point = {Controls(1), false}, curve = {Controls(20000), true};
  EXPECT_TRUE(parsesSafely(bccFile("C0", std::vector<ControlCurve>(20000, point)).bytes(), kBcc));
  EXPECT_TRUE(parsesSafely(bccFile("BS", {curve}).bytes(), kBcc));
}

TEST(BccTest, DamageIsRefusedOrHarmless) {
  // If this fails, a file that was not copied to its end is read as if it were whole, or a damaged
  // one crashes the reader or yields a scene that is not one.
  expectSafeTruncations(sampleFile().bytes(), kBcc, sampleFile().size());
  expectSafeBitFlips(sampleFile().bytes(), kBcc);
}

}  // namespace
}  // namespace fcl_fibers::io
