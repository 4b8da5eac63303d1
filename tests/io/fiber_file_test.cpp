// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/io/fiber_file.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/file_support.h"
#include "support/other_locale.h"
#include "support/temporary_file.h"

namespace fcl_fibers::io {
namespace {

using test::TemporaryFile;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

constexpr FiberFormat kPolylines = FiberFormat::kPolylines;

// One strand of two points, of a thickness.
std::string hairBytes(float x, float thickness) {
  FileBytes file;
  file.text("HAIR").little(1U).little(2U).little(2U).little(1U).little(thickness).zeros(104);
  for (const float c : {x, 0.0F, 0.0F, x, 1.0F, 0.0F}) file.little(c);
  return file.bytes();
}

TEST(FiberFileTest, KnowsFormatsByTheirFirstBytes) {
  // If this fails, a file is read as one of another format, or refused for its name.
  const auto expect = [](const std::string& bytes, FiberFormat format) {
    EXPECT_EQ(recognizeFormat(bytes, "file.of.any_name"), format) << bytes;
    EXPECT_EQ(recognizeFormat(bytes, "misnamed.hair"), format) << bytes;
  };
  expect("HAIR", FiberFormat::kHair);
  expect("BCC\x44", FiberFormat::kBcc);
  expect("mrtrix tracks\n", FiberFormat::kTck);
  expect("TRACK", FiberFormat::kTrk);
  expect("<?xml version=\"1.0\"?>", FiberFormat::kVtp);
  expect("<VTKFile", FiberFormat::kVtp);
  expect(FileBytes().little(3.0F).bytes(), FiberFormat::kTfx);
  expect(FileBytes().little(4.1F).bytes(), FiberFormat::kTfx);
}

TEST(FiberFileTest, KnowsFormatsByNameAndPolylinesByNumbers) {
  // If this fails, a broken file is said to be of no format instead of what is wrong with it.
  EXPECT_EQ(recognizeFormat("", "a.hair"), FiberFormat::kHair);
  EXPECT_EQ(recognizeFormat("?", "A.BCC"), FiberFormat::kBcc);
  EXPECT_EQ(recognizeFormat("?", "a.vtp"), FiberFormat::kVtp);
  EXPECT_EQ(recognizeFormat(FileBytes().little(5.0F).bytes(), "a.tfx"), FiberFormat::kTfx);
  EXPECT_EQ(recognizeFormat("mrtrix track scalars", "a.tck"), FiberFormat::kTck);
  EXPECT_EQ(recognizeFormat("", "a.Trk"), FiberFormat::kTrk);
  // Text of a neuron could be that of points.
  EXPECT_EQ(recognizeFormat("# a neuron\n1 1 0 0 0 1 -1\n", "a.swc"), FiberFormat::kSwc);
  EXPECT_EQ(recognizeFormat("1 1 0 0 0 1 -1\n", "a.swc.txt"), kPolylines);
  EXPECT_EQ(recognizeFormat("?", "a.txt"), kPolylines);
  for (const char* text : {"0 1 2", " \n-1 2 3", "\t.5 0 0", "# x y z\n1 2 3"}) {
    EXPECT_EQ(recognizeFormat(text, "knot"), kPolylines) << text;
  }
  for (const char* text : {"", "PNG", "@@@", "knot"}) {
    EXPECT_EQ(recognizeFormat(text, "knot"), std::nullopt) << text;
  }
}

TEST(FiberFileTest, ReadsAFileOfAKnownFormatAndOfOneThatIsSaid) {
  // If this fails, what is in the file is not what comes out.
  const TemporaryFile file(".any", "1 2 3\n4 5 6\n");
  for (const FiberFile& read : {readFibers(file.path()), readFibers(file.path(), kPolylines)}) {
    EXPECT_EQ(read.format, kPolylines);
    EXPECT_THAT(read.fibers.points, ElementsAre(Point{1, 2, 3}, Point{4, 5, 6}));
    EXPECT_EQ(read.fibers.radius, 0);
  }
  EXPECT_THAT(
      [&] { readFibers(file.path(), FiberFormat::kHair); },
      ThrowsMessage<std::runtime_error>(HasSubstr("readFibers: '" + file.path() + "', byte 0: ")));
}

TEST(FiberFileTest, NamesAFileThatCannotBeRead) {
  // If this fails, a mistyped path is reported as a broken file, or not at all, or asks for memory
  // without end.
  const auto refuses = [](const std::string& path, const std::string& reason) {
    EXPECT_THAT([&] { readFibers(path); },
                ThrowsMessage<std::runtime_error>(HasSubstr("'" + path + "' " + reason)));
  };
  refuses(testing::TempDir() + "no_such_folder/no_such_file.hair", "does not exist");
  refuses(testing::TempDir(), "is a directory");
  if (std::filesystem::exists("/dev/zero")) refuses("/dev/zero", "is not a regular file");
  const TemporaryFile file(".png", "PNG");
  refuses(file.path(), "has no known format; pass a .hair, .tfx, .bcc, .vtp, .tck, .trk or .swc");
}

TEST(FiberFileTest, TextsAreTheSameInAnyLocale) {
  // If this fails, line 2001 of a file is line 2.001 where the program that reads it says so.
  const test::OtherLocale locale;
  std::string lines;
  for (int i = 0; i < 2000; ++i) lines += "0.5 0 0\n";
  expectRefusal(lines + "x 0 0\n", kPolylines, "line 2001", "'x' is no");
  FileBytes many;
  many.text(hairBytes(0, 1)).setLittle(4, 1234567U);
  expectRefusal(many.bytes(), FiberFormat::kHair, "byte 4", "1234567 strands");
  expectRefusal(hairBytes(0, -1.5F), FiberFormat::kHair, "byte 20", "thickness is -1.5");
  EXPECT_THAT([&] { parseFibers(lines, "", kPolylines, {-1.5}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("radius is -1.5;")));
  EXPECT_THAT(parseFibers(hairBytes(0x1p20F, 0), "", FiberFormat::kHair, {2.4}).warnings,
              ElementsAre(AllOf(HasSubstr("0.125 apart"), HasSubstr("a radius of 2.4"))));
  EXPECT_EQ(parseFibers(lines, "", kPolylines).fibers.points[0], (Point{0.5, 0, 0}));
}

TEST(FiberFileTest, NamesFormatsThatAreNotRead) {
  // If this fails, a user of such a file sees that a word in it is no number, and not what to do.
  const auto refuses = [](const std::string& bytes, const std::string& name,
                          const std::string& reason) {
    EXPECT_EQ(recognizeFormat(bytes, name), std::nullopt) << name;
    EXPECT_THAT([&] { parseFibers(bytes, name); },
                ThrowsMessage<std::runtime_error>(
                    AllOf(HasSubstr("readFibers: '" + name + "' is "), HasSubstr(reason))));
  };
  const std::string vtk = "# vtk DataFile Version 3.0\nlines\nASCII\nDATASET POLYDATA\n";
  for (const char* name : {"a.vtk", "a.txt", "standard input", "a.swc"}) {
    refuses(vtk, name, "a legacy VTK file; save it as XML (.vtp)");
  }
  refuses("# made by hand\nv 0 0 0\n", "a.OBJ", "a mesh of triangles");
  refuses("v 0 0 0\n", "standard input", "by --mesh");
  refuses("ply\nformat ascii 1.0\n", "a", "a mesh");
  refuses("0 0 0\n", "a.stl", "a mesh");
  refuses("PK\x03\x04", "a.trx", "convert it to .tck or .trk");
  refuses("", "a.nii", "an image of voxels");
  refuses("Ogawa", "a.abc", "export the curves");
  refuses("\x93NUMPY", "a.npy", "NumPy");
  refuses("BZh91AY", "a.swc.bz2", "unpack it");
  refuses("PK\x03\x04", "a.txt", "unpack it");
  refuses("\x1F\x9D\x90", "a.swc.Z", "unpack it");
  refuses("", "a.tgz", "unpack it");
  refuses("\x1F\x8B\x07", "a.txt.gz", "packed twice by gzip, or by a method other than deflate");
  const TemporaryFile file(".vtk", vtk);
  EXPECT_THAT([&] { readFibers(file.path()); },
              ThrowsMessage<std::runtime_error>(HasSubstr("save it as XML (.vtp)")));
}

TEST(FiberFileTest, TheRadiusOfTheOptionsWins) {
  // If this fails, --radius has no effect, or a file's own radius is lost.
  const std::string hair = hairBytes(0, 0.5F);
  EXPECT_EQ(parseFibers(hair, "", FiberFormat::kHair).fibers.radius, 0.25);
  EXPECT_EQ(parseFibers(hair, "", FiberFormat::kHair, {3.0}).fibers.radius, 3);
  EXPECT_EQ(parseFibers(hair, "", FiberFormat::kHair, {0.0}).fibers.radius, 0);
  for (const double bad : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT([&] { parseFibers(hair, "", FiberFormat::kHair, {bad}); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("readFibers: radius is ")));
  }
}

TEST(FiberFileTest, TellsWhetherThereIsARadius) {
  // If this fails, fibers without thickness pass for fibers that touch nothing, or a radius of 0
  // that is meant is refused.
  const auto has = [](const std::string& bytes, FiberFormat format,
                      const FiberFileOptions& options = {}) {
    return parseFibers(bytes, "", format, options).has_radius;
  };
  const std::string text = "0 0 0\n1 0 0\n";
  EXPECT_FALSE(has(text, kPolylines));
  EXPECT_TRUE(has(text, kPolylines, {0.5}));
  EXPECT_TRUE(has(text, kPolylines, {0.0}));
  EXPECT_TRUE(has(hairBytes(0, 0.5F), FiberFormat::kHair));
  EXPECT_FALSE(has(hairBytes(0, 0), FiberFormat::kHair));
  EXPECT_TRUE(has(hairBytes(0, 0), FiberFormat::kHair, {0.0}));
  FileBytes by_point;
  by_point.text(hairBytes(0, 0)).setLittle(12, 6U).little(0.0F).little(0.0F);
  // As a default of 0, a thickness of 0 at all points stands for none; fibers would touch nothing.
  EXPECT_FALSE(has(by_point.bytes(), FiberFormat::kHair));
  EXPECT_THAT(parseFibers(by_point.bytes(), "", FiberFormat::kHair).warnings,
              ElementsAre("All radii are 0, which stands for none."));
  EXPECT_TRUE(has(by_point.setLittle(by_point.size() - 4, 1.0F).bytes(), FiberFormat::kHair));
}

TEST(FiberFileTest, TheRadiusOfTheOptionsReplacesRadiiByPoint) {
  // If this fails, some segments keep the file's thickness.
  FileBytes file;
  file.text(hairBytes(0, 0)).setLittle(12, 6U).little(1.0F).little(2.0F);
  EXPECT_THAT(parseFibers(file.bytes(), "", FiberFormat::kHair).fibers.radii, ElementsAre(0.5, 1));
  const FiberPolylines scene = parseFibers(file.bytes(), "", FiberFormat::kHair, {3.0}).fibers;
  EXPECT_THAT(scene.radii, IsEmpty());
  EXPECT_EQ(scene.radiusAt(0), 3);
}

TEST(FiberFileTest, AFiberIsClosedWhereItEndsAtItsStart) {
  // If this fails, loops of VTK and text files have ends, or hairs become loops.
  const auto closed = [](const std::string& text) {
    return parseFibers(text, "", kPolylines).fibers.closed;
  };
  EXPECT_THAT(closed("0 0 0\n1 0 0\n0 1 0\n0 0 0\n"), ElementsAre(1));
  EXPECT_THAT(closed("0 0 0\n1 0 0\n0 1 0\n0 0 1e-9\n"), IsEmpty());
  EXPECT_THAT(closed("0 0 0\n1 0 0\n0 0 0\n"), IsEmpty());  // there and back
  EXPECT_THAT(closed("0 0 0\n0 0 0\n\n0 0 0\n1 0 0\n0 1 0\n0 0 0\n\n5 5 5\n"),
              ElementsAre(0, 1, 0));
}

/// A ring of three segments, and a fiber that begins at its second point, in formats of points
/// alone.
std::map<FiberFormat, std::string> ringAndTwig() {
  using Points = std::vector<std::array<float, 3>>;
  const Points ring = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}};
  const Points twig = {{1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}};
  const auto add = [](FileBytes& file, const Points& points, std::size_t count = 4) {
    for (std::size_t i = 0; i < count; ++i) {
      for (const float c : points[i]) file.little(c);
    }
  };
  FileBytes bcc, tfx, tck, trk;
  // A closed curve does not repeat its first point.
  bcc.text("BCCDC0\3\2").little(std::uint64_t{2}).little(std::uint64_t{7}).zeros(40);
  add(bcc.little(-3), ring, 3);
  add(bcc.little(4), twig);
  // Version 3: strands and points of each, and where these are.
  tfx.little(3.0F).little(2U).little(4U).zeros(132).little(148U);
  add(tfx, ring);
  add(tfx, twig);
  const float end = std::nanf(""), last = std::numeric_limits<float>::infinity();
  tck.text("mrtrix tracks\ndatatype: Float32LE\ncount: 2\nfile: . 064\nEND\n").zeros(5);
  add(tck, ring);
  add(tck, {{end, end, end}}, 1);
  add(tck, twig);
  add(tck, {{end, end, end}, {last, last, last}}, 2);
  trk.text("TRACK").zeros(995);
  for (const std::size_t at : {12U, 16U, 20U, 440U, 460U, 480U, 500U}) trk.setLittle(at, 1.0F);
  for (std::size_t k = 0; k < 3; ++k) trk.setLittle(948 + k, "RAS"[k]);
  trk.setLittle(988, 2).setLittle(992, 2).setLittle(996, 1000);
  add(trk.little(4), ring);
  add(trk.little(4), twig);
  return {{FiberFormat::kBcc, bcc.bytes()},
          {FiberFormat::kTfx, tfx.bytes()},
          {FiberFormat::kTck, tck.bytes()},
          {FiberFormat::kTrk, trk.bytes()}};
}

TEST(FiberFileTest, SomeFormatsHoldPointsAlone) {
  // If this fails, a loop has ends, or fibers of these formats taper or branch, which they cannot.
  FiberFileOptions options;
  options.segments_per_span = 1;
  for (const auto& [format, bytes] : ringAndTwig()) {
    SCOPED_TRACE(static_cast<int>(format));
    options.radius.reset();
    options.radius_from.clear();
    const FiberFile file = parseFibers(bytes, "", format, options);
    EXPECT_THAT(file.warnings, IsEmpty());
    EXPECT_THAT(file.fibers.point_begin, ElementsAre(0, 4, 8));
    EXPECT_EQ(file.fibers.points[4], file.fibers.points[1]);
    EXPECT_THAT(file.fibers.closed, ElementsAre(1, 0));
    EXPECT_THAT(file.fibers.starts_at, IsEmpty());
    EXPECT_THAT(file.fibers.ends_at, IsEmpty());
    EXPECT_FALSE(file.has_radius);
    options.radius_from = "4";
    const std::string& text = bytes;
    const auto parse = [&, kind = format] { parseFibers(text, "", kind, options); };
    EXPECT_THAT(parse, ThrowsMessage<std::invalid_argument>(
                           HasSubstr("only .vtp files and text have several numbers")));
    options.radius_from.clear();
    options.radius = 0.1;
    const FiberPolylines fibers = parseFibers(bytes, "", format, options).fibers;
    EXPECT_EQ(fibers.radius, 0.1);
    EXPECT_THAT(fibers.radii, IsEmpty());
  }
}

TEST(FiberFileTest, KeepsSegmentsOfLengthZero) {
  // If this fails, segments are numbered otherwise than in the file.
  const FiberPolylines scene = parseFibers("1 2 3\n1 2 3\n1 2 3\n", "", kPolylines).fibers;
  EXPECT_EQ(scene.segmentCount(), 2U);
}

TEST(FiberFileTest, WarnsOfFloatsTooCoarseForTheRadius) {
  // If this fails, fibers far from the origin touch, or not, by rounding, and nobody is told; or
  // everybody is. Floats beside 2^20 are 2^-3 apart.
  const auto warnings = [](float x, double radius) {
    return parseFibers(hairBytes(x, 0), "", FiberFormat::kHair, {radius}).warnings;
  };
  EXPECT_THAT(warnings(0x1p20F, 2.4),
              ElementsAre(AllOf(HasSubstr("0.125 apart"), HasSubstr("a radius of 2.4"))));
  EXPECT_THAT(warnings(0x1p20F, 2.6), IsEmpty());
  EXPECT_THAT(warnings(-0x1p20F, 2.4), testing::SizeIs(1));
  EXPECT_THAT(warnings(0x1p20F, 0), IsEmpty());
  EXPECT_THAT(warnings(1, 1e-5), IsEmpty());
  // Thin at its root, and without thickness at its tip.
  FileBytes tapered;
  tapered.text(hairBytes(0x1p20F, 0)).setLittle(12, 6U).little(2.0F).little(0.0F);
  EXPECT_THAT(parseFibers(tapered.bytes(), "", FiberFormat::kHair).warnings,
              testing::Contains(HasSubstr("a radius of 1")));
  // The same coordinates as text, or as doubles, are what they are.
  EXPECT_THAT(parseFibers("1048576 0 0\n1048576 1 0\n", "", kPolylines, {1e-9}).warnings,
              IsEmpty());
}

TEST(FiberFileTest, GivesFiberTreeItsArrays) {
  // If this fails, a tree is built of other fibers than the file has.
  FiberPolylines scene = parseFibers("1 2 3\n4 5 6\n\n7 8 9\n", "", kPolylines, {0.5}).fibers;
  FiberArrays<double> arrays = fiberArrays(scene);
  EXPECT_EQ(arrays.point_count, 3U);
  EXPECT_EQ(arrays.points[8], 9);
  EXPECT_EQ(arrays.fiber_count, 2U);
  EXPECT_EQ(arrays.point_begin[1], 2U);
  EXPECT_EQ(arrays.radii_are, FiberArrays<double>::Radii::kOne);
  EXPECT_EQ(arrays.radii[0], 0.5);
  scene.radii = {1, 2, 3};
  arrays = fiberArrays(scene);
  EXPECT_EQ(arrays.radii_are, FiberArrays<double>::Radii::kPerFirstPoint);
  EXPECT_EQ(arrays.radii[2], 3);
  const FiberPolylines none;
  EXPECT_EQ(fiberArrays(none).point_count, 0U);
  EXPECT_EQ(fiberArrays(none).fiber_count, 0U);
}

}  // namespace
}  // namespace fcl_fibers::io
