// SPDX-License-Identifier: BSD-3-Clause
#include <zlib.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/file_support.h"
#include "scenes/random.h"

namespace fcl_fibers::io {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr FiberFormat kVtp = FiberFormat::kVtp;

FiberFile parse(const std::string& bytes) { return parseFibers(bytes, "a file", kVtp); }

// RFC 4648, section 4.
std::string base64(const std::string& bytes) {
  const char* const digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bits, text;
  for (const char c : bytes) {
    for (int i = 7; i >= 0; --i) bits += static_cast<unsigned char>(c) >> i & 1 ? '1' : '0';
  }
  while (bits.size() % 6 != 0) bits += '0';
  for (std::size_t i = 0; i < bits.size(); i += 6) {
    text += digits[std::stoul(bits.substr(i, 6), nullptr, 2)];
  }
  while (text.size() % 4 != 0) text += '=';
  return text;
}

std::string deflated(const std::string& bytes) {
  std::string result(compressBound(static_cast<uLong>(bytes.size())), '\0');
  uLongf size = static_cast<uLongf>(result.size());
  compress(reinterpret_cast<Bytef*>(result.data()), &size,
           reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uLong>(bytes.size()));
  result.resize(size);
  return result;
}

std::string sized(const std::string& bytes) {
  FileBytes array;
  return array.little(static_cast<std::uint32_t>(bytes.size())).text(bytes).bytes();
}

// In blocks of 16 bytes, the header and the blocks, each of them encoded by itself.
template <class Encode>
std::string inBlocks(const std::string& bytes, Encode&& encode) {
  constexpr std::size_t kBlock = 16;
  std::vector<std::string> blocks;
  for (std::size_t i = 0; i < bytes.size(); i += kBlock) {
    blocks.push_back(deflated(bytes.substr(i, kBlock)));
  }
  FileBytes header, data;
  header.little(static_cast<std::uint32_t>(blocks.size()));
  header.little(static_cast<std::uint32_t>(kBlock));
  header.little(static_cast<std::uint32_t>(bytes.size() % kBlock));
  for (const std::string& block : blocks) {
    header.little(static_cast<std::uint32_t>(block.size()));
    data.text(block);
  }
  return encode(header.bytes()) + encode(data.bytes());
}
std::string inRawBlocks(const std::string& bytes) {
  return inBlocks(bytes, [](const std::string& part) { return part; });
}

std::string pointBytes() {
  FileBytes points;
  for (const float c : kTwoLinesPoints) points.little(c);
  return points.bytes();
}
std::string indexBytes() {
  FileBytes indices;
  for (const int i : kTwoLinesIndices) indices.little(i);
  return indices.bytes();
}
std::string endBytes() {
  FileBytes ends;
  return ends.little(std::int64_t{4}).little(std::int64_t{6}).bytes();
}

// What stands in the three arrays, and the attribute that says how.
struct Arrays {
  std::string format;
  std::string points, indices, ends;
  std::string attributes = "", appended = "";
};

std::string vtpFile(const Arrays& arrays) {
  const auto array = [](const std::string& attributes, const std::string& format,
                        const std::string& content) {
    return "<DataArray " + attributes + " format=\"" + format + ">" + content + "</DataArray>";
  };
  // With "appended", what stands in an array is its offset.
  const auto split = [&](const std::string& attributes, const std::string& content) {
    if (arrays.format == "appended") {
      return array(attributes, "appended\" offset=\"" + content + "\"", "");
    }
    return array(attributes, arrays.format + "\"", content);
  };
  return "<VTKFile type=\"PolyData\"" + arrays.attributes +
         "><PolyData><Piece NumberOfPoints=\"5\" NumberOfLines=\"2\"><Points>" +
         split("type=\"Float32\" NumberOfComponents=\"3\"", arrays.points) + "</Points><Lines>" +
         split("type=\"Int32\" Name=\"connectivity\"", arrays.indices) +
         split("type=\"Int64\" Name=\"offsets\"", arrays.ends) + "</Lines></Piece></PolyData>" +
         arrays.appended + "</VTKFile>";
}

std::string textFile() {
  return vtpFile({"ascii", "0 0 0 1 0 0\n1 1 0 0 1 .5 7 8 9", "0 1 2 0 3 4", "\t4 6\n"});
}

std::string inlineFile() {
  return vtpFile({"binary", "\n" + base64(sized(pointBytes())) + "\n", base64(sized(indexBytes())),
                  base64(sized(endBytes()))});
}

constexpr char kCompressed[] = " compressor=\"vtkZLibDataCompressor\"";

std::string compressedInlineFile() {
  return vtpFile({"binary", inBlocks(pointBytes(), base64), inBlocks(indexBytes(), base64),
                  inBlocks(endBytes(), base64), kCompressed});
}

// `arrays` are as they are appended.
std::string appendedFile(const std::vector<std::string>& arrays, const std::string& encoding,
                         const std::string& attributes = "") {
  return vtpFile({"appended", "0", std::to_string(arrays[0].size()),
                  std::to_string(arrays[0].size() + arrays[1].size()), attributes,
                  "<AppendedData encoding=\"" + encoding + "\">\n _" + arrays[0] + arrays[1] +
                      arrays[2] + "</AppendedData>"});
}

std::string rawFileWith(const std::string& points) {
  return appendedFile({points, sized(indexBytes()), sized(endBytes())}, "raw");
}
std::string rawFile() { return rawFileWith(sized(pointBytes())); }

std::string compressedRawFileWith(const std::string& points) {
  return appendedFile({points, inRawBlocks(indexBytes()), inRawBlocks(endBytes())}, "raw",
                      kCompressed);
}

std::vector<std::string> sampleFiles() {
  return {textFile(), inlineFile(), compressedInlineFile(), rawFile(),
          compressedRawFileWith(inRawBlocks(pointBytes()))};
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string pieceOf(const std::string& file) {
  const std::size_t begin = file.find("<Piece"), end = file.find("</PolyData>");
  return file.substr(begin, end - begin);
}

// Where the arrays begin.
constexpr char kPointsElement[] = "<DataArray type=\"Float";
constexpr char kIndicesElement[] = "<DataArray type=\"Int32\" Name=\"conn";
constexpr char kEndsElement[] = "<DataArray type=\"Int64\" Name=\"off";

TEST(VtpTest, ReadsAllEncodings) {
  // If this fails, arrays are read from the wrong place, or decoded wrongly.
  for (const std::string& bytes : sampleFiles()) {
    SCOPED_TRACE(bytes);
    expectTwoLines(parse(bytes));
  }
  expectTwoLines(parse(appendedFile(
      {base64(sized(pointBytes())), base64(sized(indexBytes())), base64(sized(endBytes()))},
      "base64")));
}

TEST(VtpTest, NumbersMayHaveASign) {
  // If this fails, what programs write that show the sign of each number is refused.
  expectTwoLines(
      parse(vtpFile({"ascii", "0 0 0 +1 -0 0\n1 1 0 0 +1e+0 +.5 7 8 9", "+0 1 2 0 3 4", "+4 6"})));
}

TEST(VtpTest, JoinsPieces) {
  // If this fails, lines of a second piece are missing, or have points of the first.
  const std::string file = textFile(), piece = pieceOf(file);
  const std::string empty = "<Piece NumberOfPoints=\"0\" NumberOfLines=\"0\"/>";
  const FiberPolylines scene =
      parse(replaced(file, piece, piece + empty + replaced(piece, "7 8 9", "6 6 6"))).fibers;
  EXPECT_THAT(scene.point_begin, ElementsAre(0, 4, 6, 10, 12));
  EXPECT_EQ(scene.points[5], (Point{7, 8, 9}));
  EXPECT_EQ(scene.points[11], (Point{6, 6, 6}));
}

std::string withPointData(const std::string& file, const std::string& array) {
  return replaced(file, "<Lines>", "<PointData>" + array + "</PointData><Lines>");
}

std::string radiusArray(const std::string& numbers) {
  return "<DataArray type=\"Float32\" Name=\"radius\" format=\"ascii\">" + numbers + "</DataArray>";
}

TEST(VtpTest, ReadsRadiiOfPoints) {
  // If this fails, a radius that was written is lost, or goes to other segments.
  const std::string other =
      "<DataArray type=\"Int32\" Name=\"theta\" format=\"ascii\">1 2 3 4 5</DataArray>";
  const FiberFile file = parse(withPointData(textFile(), other + radiusArray("1 2 .5 .25 .125")));
  EXPECT_TRUE(file.has_radius);
  // The lines have the points 0 1 2 0 and 3 4.
  EXPECT_THAT(file.fibers.radii, ElementsAre(1, 2, 0.5, 1, 0.25, 0.125));
  const FiberFile one = parse(withPointData(textFile(), radiusArray("3 3 3 3 3")));
  EXPECT_EQ(one.fibers.radius, 3);
  EXPECT_THAT(one.fibers.radii, IsEmpty());
  // As in .hair and .swc, no radius above 0 stands for an unknown one: fibers would touch nothing.
  const FiberFile zeros = parse(withPointData(textFile(), radiusArray("0 0 0 0 0")));
  EXPECT_FALSE(zeros.has_radius);
  EXPECT_THAT(zeros.warnings, ElementsAre("All radii are 0, which stands for none."));
  EXPECT_FALSE(parse(withPointData(textFile(), other)).has_radius);
  EXPECT_FALSE(parse(textFile()).has_radius);
}

FiberFile parseFrom(const std::string& bytes, const std::string& name) {
  FiberFileOptions options;
  options.radius_from = name;
  return parseFibers(bytes, "a file", kVtp, options);
}

std::string withCellData(const std::string& file, const std::string& array) {
  return replaced(file, "<Lines>", "<CellData>" + array + "</CellData><Lines>");
}

std::string arrayOf(const std::string& type, const std::string& name, const std::string& numbers) {
  return "<DataArray type=\"" + type + "\" Name=\"" + name + "\" format=\"ascii\">" + numbers +
         "</DataArray>";
}

TEST(VtpTest, RadiiOfPointsAreKept) {
  // If this fails, a narrow place of one point is lost.
  const FiberFile file = parse(withPointData(textFile(), radiusArray("3 .5 3 2 2")));
  expectWellFormed(file.fibers);
  EXPECT_THAT(file.fibers.radii, ElementsAre(3, 0.5, 3, 3, 2, 2));
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST(VtpTest, LinesThatShareAPointBranch) {
  // If this fails, vessels that other programs wrote touch themselves wherever they meet.
  const auto linesOf = [](const std::string& indices, const std::string& ends, int lines) {
    return replaced(replaced(replaced(textFile(), "0 1 2 0 3 4", indices), "\t4 6\n", ends),
                    "NumberOfLines=\"2\"", "NumberOfLines=\"" + std::to_string(lines) + "\"");
  };
  const auto read = [](const std::string& file) {
    FiberPolylines fibers = parse(file).fibers;
    expectWellFormed(fibers);
    return fibers;
  };
  // Where one line ends, two begin, of which one comes first.
  const FiberPolylines fork = read(linesOf("1 2 0 1 1 3", "2 4 6", 3));
  EXPECT_THAT(fork.starts_at, ElementsAre(3, -1, 3));
  EXPECT_THAT(fork.ends_at, IsEmpty());
  // Three begin at one point, at which none ends.
  EXPECT_THAT(read(linesOf("0 1 0 2 0 3", "2 4 6", 3)).starts_at, ElementsAre(-1, 0, 0));
  // A twig begins inside of a line, and one ends there, and closes a loop of the line before it.
  const FiberPolylines inside = read(linesOf("0 1 2 1 3 3 1", "3 5 7", 3));
  EXPECT_THAT(inside.starts_at, ElementsAre(-1, 1, 4));
  EXPECT_THAT(inside.ends_at, ElementsAre(-1, -1, 1));
  // A closed curve meets itself without a branch, and a twig may begin at its seam.
  const FiberPolylines closed = read(linesOf("0 1 2 0 0 4", "4 6", 2));
  EXPECT_THAT(closed.closed, ElementsAre(1, 0));
  EXPECT_THAT(closed.starts_at, ElementsAre(-1, 0));
  EXPECT_THAT(closed.ends_at, IsEmpty());
  // A ring starts at what passes or ends at its seam, whichever comes first, and at no seam of its
  // own. What else is there starts or ends at the ring.
  const FiberPolylines trunk = read(linesOf("0 1 2 0 3 0 4", "4 7", 2));
  EXPECT_THAT(trunk.starts_at, ElementsAre(5, -1));
  EXPECT_THAT(trunk.ends_at, IsEmpty());
  const FiberPolylines eight = read(linesOf("0 1 2 0 0 3 4 0", "4 8", 2));
  EXPECT_THAT(eight.closed, ElementsAre(1, 1));
  EXPECT_THAT(eight.starts_at, ElementsAre(-1, 0));
  EXPECT_THAT(eight.ends_at, IsEmpty());
  EXPECT_THAT(read(linesOf("0 1 2 0 3 0", "4 6", 2)).ends_at, ElementsAre(-1, 0));
  const FiberPolylines after = read(linesOf("3 0 0 1 2 0", "2 6", 2));
  EXPECT_THAT(after.starts_at, ElementsAre(-1, 1));
  EXPECT_THAT(after.ends_at, IsEmpty());
  EXPECT_THAT(read(linesOf("0 1 2 0 1 3 4 1", "4 8", 2)).starts_at, ElementsAre(-1, 1));
  // Lines may start at each other in a circle.
  const FiberPolylines loop = read(linesOf("0 1 2 2 3 0 0 4", "3 6 8", 3));
  EXPECT_THAT(loop.starts_at, ElementsAre(5, 2, 5));
  EXPECT_THAT(loop.ends_at, IsEmpty());
  // A line may start and end inside of itself.
  const FiberPolylines lasso = read(linesOf("0 1 0 2 3 2", "6", 1));
  EXPECT_THAT(lasso.starts_at, ElementsAre(2));
  EXPECT_THAT(lasso.ends_at, ElementsAre(3));
  // Lines that cross share no end, and points of two pieces are never one.
  EXPECT_THAT(read(linesOf("0 1 2 3 1 4", "3 6", 2)).starts_at, IsEmpty());
  const std::string file = textFile();
  const std::size_t begin = file.find("<Piece"), end = file.find("</Piece>") + 8;
  const std::string piece = file.substr(begin, end - begin);
  EXPECT_THAT(read(replaced(file, piece, piece + piece)).starts_at, IsEmpty());
}

TEST(VtpTest, AllEndsAtAPointAreJoined) {
  // If this fails, rings, loops and twigs that share a point touch each other there.
  scenes::Random random(5);
  const auto below = [&](int count) { return static_cast<int>(random.uniform() * count); };
  int rings = 0;
  for (int trial = 0; trial < 300; ++trial) {
    std::string indices, ends;
    std::vector<int> ids;
    const int lines = 1 + below(5);
    for (int line = 0; line < lines; ++line) {
      const std::size_t first = ids.size();
      for (int i = 2 + below(4); i > 0; --i) ids.push_back(below(5));
      if (random.uniform() < 0.4) ids.back() = ids[first];
      rings += ids.size() - first > 3 && ids.back() == ids[first] ? 1 : 0;
      ends += std::to_string(ids.size()) + ' ';
    }
    for (const int id : ids) indices += std::to_string(id) + ' ';
    SCOPED_TRACE(testing::Message() << "lines of " << indices << "end at " << ends);
    const FiberPolylines fibers =
        parse(replaced(replaced(replaced(textFile(), "0 1 2 0 3 4", indices), "\t4 6\n", ends),
                       "NumberOfLines=\"2\"", "NumberOfLines=\"" + std::to_string(lines) + "\""))
            .fibers;
    expectWellFormed(fibers);
    // By point: one that joints make the same.
    std::vector<std::size_t> same(ids.size());
    std::iota(same.begin(), same.end(), std::size_t{0});
    const auto join = [&](std::size_t p, std::size_t q) {
      EXPECT_EQ(ids[p], ids[q]);
      const std::size_t from = same[p], to = same[q];
      std::replace(same.begin(), same.end(), from, to);
    };
    std::map<int, std::size_t> inside, end_of;
    for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
      const std::size_t begin = fibers.point_begin[f], last = fibers.point_begin[f + 1] - 1;
      for (std::size_t i = begin + 1; i < last; ++i) inside.try_emplace(ids[i], i);
      if (!fibers.starts_at.empty() && fibers.starts_at[f] >= 0) {
        join(begin, static_cast<std::size_t>(fibers.starts_at[f]));
      }
      if (!fibers.ends_at.empty() && fibers.ends_at[f] >= 0) {
        join(last, static_cast<std::size_t>(fibers.ends_at[f]));
      }
      if (fibers.isClosed(f) || (last - begin > 2 && ids[begin] == ids[last])) join(begin, last);
    }
    for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
      for (const std::size_t i : {fibers.point_begin[f], fibers.point_begin[f + 1] - 1}) {
        const auto found = inside.find(ids[i]);
        const std::size_t owner =
            found != inside.end() ? found->second : end_of.try_emplace(ids[i], i).first->second;
        EXPECT_EQ(same[i], same[owner]) << i << " and " << owner;
      }
    }
  }
  EXPECT_GT(rings, 100);
}

TEST(VtpTest, NamesThatDoNotFitThePointsAreNotRead) {
  // If this fails, what a filter of ParaView makes of an exported file is refused, or its branches
  // are lost without a word.
  const std::string shared =
      replaced(replaced(textFile(), "0 1 2 0 3 4", "0 1 2 1 3"), "\t4 6", "3 5");
  const auto with = [](const std::string& file, const std::string& name,
                       const std::string& numbers) {
    return withCellData(file, arrayOf("Int32", name, numbers));
  };
  const FiberFile fits = parse(with(shared, "ends_at", "-1 -1"));
  EXPECT_THAT(fits.warnings, IsEmpty());
  EXPECT_THAT(fits.fibers.starts_at, IsEmpty());
  // Beyond the points, no number of a point, of another place, of no line, and its own point.
  for (const char* name : {"starts_at", "ends_at"}) {
    for (const char* at : {"5", "9000000000", "-2", "-9000000000", "0", "4"}) {
      const std::string bytes = with(shared, name, std::string("-1 ") + at);
      EXPECT_TRUE(parsesSafely(bytes, kVtp));
      const FiberFile file = parse(replaced(bytes, "Int32\" Name=\"" + std::string(name),
                                            "Int64\" Name=\"" + std::string(name)));
      EXPECT_THAT(file.fibers.starts_at, ElementsAre(-1, 1)) << at;
      EXPECT_THAT(file.fibers.ends_at, IsEmpty());
      EXPECT_THAT(file.warnings,
                  ElementsAre(testing::AllOf(
                      testing::StartsWith("Cell data '" + std::string(name) + "' does not fit"),
                      testing::HasSubstr("merge points at the same place"))));
    }
  }
  const FiberFile own = parse(with(textFile(), "starts_at", "-1 3"));
  EXPECT_THAT(own.warnings, testing::SizeIs(1));
  EXPECT_THAT(own.fibers.starts_at, IsEmpty());
  // Nothing of an array that does not fit is taken, nor of the other one.
  for (const char* name : {"starts_at", "ends_at"}) {
    const std::string lines =
        "<VTKFile type='PolyData' byte_order='LittleEndian'><PolyData>"
        "<Piece NumberOfPoints='6' NumberOfLines='3'><CellData>"
        "<DataArray type='Int32' Name='starts_at' format='ascii'>-1 1 -1</DataArray>"
        "<DataArray type='Int32' Name='ends_at' format='ascii'>-1 -1 2</DataArray></CellData>"
        "<Points><DataArray type='Float64' NumberOfComponents='3' format='ascii'>"
        "0 0 0 1 0 0  1 0 0 2 2 0  3 0 0 1 0 0</DataArray></Points>"
        "<Lines><DataArray type='Int32' Name='connectivity' format='ascii'>0 1 2 3 4 5</DataArray>"
        "<DataArray type='Int32' Name='offsets' format='ascii'>2 4 6</DataArray></Lines>"
        "</Piece></PolyData></VTKFile>";
    EXPECT_THAT(parse(lines).fibers.starts_at, ElementsAre(-1, 1, -1));
    EXPECT_THAT(parse(lines).fibers.ends_at, ElementsAre(-1, -1, 2));
    const bool are_starts = name == std::string("starts_at");
    const FiberFile file = parse(
        replaced(lines, are_starts ? "-1 1 -1" : "-1 -1 2", are_starts ? "-1 1 0" : "0 -1 2"));
    EXPECT_THAT(file.warnings, testing::SizeIs(1));
    EXPECT_THAT(file.fibers.starts_at, IsEmpty());
    EXPECT_THAT(file.fibers.ends_at, IsEmpty());
  }
  // Points of no line may be where a fiber starts, and those of another piece are others.
  EXPECT_THAT(parse(with(replaced(shared, "7 8 9", "1 0 0"), "starts_at", "-1 4")).warnings,
              testing::SizeIs(1));
  const std::string piece = pieceOf(with(shared, "starts_at", "-1 5"));
  EXPECT_THAT(parse(replaced(shared, pieceOf(shared), piece + piece)).warnings, testing::SizeIs(1));
  expectRefusal(with(textFile(), "starts_at", "-1"), kVtp, "byte 212",
                "there are 1 numbers, but 2 cells");
}

TEST(VtpTest, WarnsOfArraysThatMayBeRadii) {
  // If this fails, radii under another name are passed over without a word.
  const std::string file =
      withCellData(withPointData(textFile(), arrayOf("Float64", "Tube&amp;Radius", "1 2 3 4 5") +
                                                 arrayOf("Int32", "diameter", "1 2 3 4 5")),
                   arrayOf("Float32", "radius", "1 2") + arrayOf("Int32", "fiber", "0 1"));
  const std::string vectors =
      replaced(arrayOf("Float32", "tangent", ""), "Name", "NumberOfComponents=\"3\" Name");
  const FiberFile read = parse(replaced(file, "<PointData>", "<PointData>" + vectors));
  EXPECT_FALSE(read.has_radius);
  EXPECT_THAT(read.warnings,
              ElementsAre("There is no point data 'radius'; radius_from takes the radii from "
                          "another array. There are: point data 'Tube&Radius', point data "
                          "'diameter', cell data 'radius'."));
  EXPECT_THAT(read.passed_over, ElementsAre("point data 'tangent'", "point data 'Tube&Radius'",
                                            "point data 'diameter'", "cell data 'radius'"));
  // A radius for all, or that of the file, is what was asked for.
  EXPECT_THAT(parseFibers(file, "", kVtp, {1.0}).warnings, IsEmpty());
  const FiberFile with =
      parse(replaced(file, "<PointData>", "<PointData>" + radiusArray("1 1 1 1 1")));
  EXPECT_THAT(with.warnings, IsEmpty());
  EXPECT_THAT(with.passed_over, testing::SizeIs(3));
  std::string many;
  for (int i = 0; i < 30; ++i) many += arrayOf("Float32", "a" + std::to_string(i), "");
  EXPECT_THAT(parse(withPointData(textFile(), many)).passed_over, testing::SizeIs(9));
}

TEST(VtpTest, TakesRadiiFromAnotherArray) {
  // If this fails, radii are those of other points or lines, or those of some types are refused.
  const std::string file =
      withCellData(withPointData(textFile(), radiusArray("9 9 9 9 9") +
                                                 arrayOf("Float64", "R", "1 2 .5 .25 .125")),
                   arrayOf("Float32", "R", "9 9") + arrayOf("Int16", "L", "3 4"));
  const FiberFile points = parseFrom(file, "R");
  expectWellFormed(points.fibers);
  EXPECT_THAT(points.fibers.radii, ElementsAre(1, 2, 0.5, 1, 0.25, 0.125));
  EXPECT_THAT(points.passed_over,
              ElementsAre("point data 'radius'", "cell data 'R'", "cell data 'L'"));
  const FiberFile lines = parseFrom(file, "L");
  EXPECT_THAT(lines.fibers.radii, ElementsAre(3, 3, 3, 3, 4, 4));
  // The data of cells begin with those of vertices and end with those of strips and polygons.
  const std::string cells = replaced(replaced(file, ">3 4<", ">1 2 3 4 5<"), "<Piece ",
                                     "<Piece NumberOfVerts=\"2\" NumberOfPolys=\"1\" ");
  EXPECT_THAT(parseFrom(cells, "L").fibers.radii, ElementsAre(3, 3, 3, 3, 4, 4));
  FileBytes bytes;
  bytes.little(std::uint8_t{7}).little(std::uint8_t{8});
  const std::string binary =
      replaced(file, "\"Int16\" Name=\"L\" format=\"ascii\">3 4",
               "\"UInt8\" Name=\"L\" format=\"binary\">" + base64(sized(bytes.bytes())));
  EXPECT_THAT(parseFrom(binary, "L").fibers.radii, ElementsAre(7, 7, 7, 7, 8, 8));
}

TEST(VtpTest, SaysWhyAnArrayHoldsNoRadii) {
  // If this fails, radii are read from what is not there, or nobody is told of the choice.
  const std::string file = withCellData(
      withPointData(textFile(), arrayOf("Float64", "R", "1 2 3 4 5")),
      arrayOf("Int16", "L", "3 4 5") + arrayOf("String", "S", "3 4") +
          replaced(arrayOf("Int16", "V", "3 4"), "Name", "NumberOfComponents=\"2\" Name"));
  const auto refuses = [&](const std::string& name, const std::string& reason) {
    EXPECT_THAT([&] { parseFrom(file, name); },
                testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr(reason)));
  };
  refuses(
      "r",
      "there is no array 'r', which radius_from names; there are: point data 'R', cell data 'L'");
  refuses("L", "there are 3 numbers, but 2 cells");
  refuses("V", "NumberOfComponents is not 1");
  FiberFileOptions options;
  options.radius_from = "R";
  options.radius = 1;
  EXPECT_THAT(
      [&] { parseFibers(file, "", kVtp, options); },
      testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("radius_from is 'R'")));
  options.radius.reset();
  EXPECT_THAT(
      [&] { parseFibers("1 1 0 0 0 1 -1\n", "", FiberFormat::kSwc, options); },
      testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("radius_from is 'R'")));
}

TEST(VtpTest, TakesGroupsFromAnArray) {
  // If this fails, fibers are in the group of another line, or of a point that is not their last.
  const std::string file = withCellData(
      withPointData(textFile(), radiusArray("9 9 9 9 9") + arrayOf("Float64", "G", "4 4 4 4 2")),
      arrayOf("Int16", "L", "5 -3"));
  FiberFileOptions options;
  const auto from = [&](const std::string& bytes, const char* name) {
    options.groups_from = name;
    return parseFibers(bytes, "a file", kVtp, options);
  };
  const FiberFile lines = from(file, "L");
  EXPECT_THAT(lines.fibers.groups, ElementsAre(2, 1));
  EXPECT_THAT(lines.group_values, ElementsAre(-3, 5));
  EXPECT_TRUE(lines.has_radius);
  EXPECT_THAT(lines.passed_over, ElementsAre("point data 'G'"));
  const FiberFile points = from(file, "G");
  EXPECT_THAT(points.group_values, ElementsAre(2, 4));
  EXPECT_THAT(points.fibers.groups, ElementsAre(2, 1));
  EXPECT_THAT([&] { from(file, "g"); },
              testing::ThrowsMessage<std::runtime_error>(
                  testing::HasSubstr("there is no array 'g', which groups_from names")));
  EXPECT_THAT([&] { from(replaced(file, ">4 4 4 4 2<", ">4 4 nan 4 2<"), "G"); },
              testing::ThrowsMessage<std::runtime_error>(
                  testing::HasSubstr("the number of a group is nan")));
}

TEST(VtpTest, LinesWithoutPointsAreKept) {
  // If this fails, a cell that VTK's filters leave empty refuses a file, shifts radii, or gives all
  // lines after it the number of another.
  const std::string three = replaced(textFile(), "NumberOfLines=\"2\"", "NumberOfLines=\"4\"");
  FiberFile file = parse(replaced(three, "\t4 6", "\t0 4 4 6"));
  EXPECT_THAT(file.fibers.point_begin, ElementsAre(0, 0, 4, 4, 6));
  EXPECT_THAT(file.warnings, IsEmpty());
  EXPECT_THAT(file.fibers.closed, ElementsAre(0, 1, 0, 0));
  file.fibers.point_begin = {0, 4, 6};
  file.fibers.closed = {1, 0};
  expectTwoLines(file);
  const std::string with =
      withCellData(replaced(three, "\t4 6", "\t0 4 4 6"), arrayOf("Float32", "R", "9 1 9 2"));
  EXPECT_THAT(parseFrom(with, "R").fibers.radii, ElementsAre(1, 1, 1, 1, 2, 2));
  const std::string piece = pieceOf(with);
  EXPECT_THAT(parseFrom(replaced(with, piece, piece + piece), "R").fibers.radii,
              ElementsAre(1, 1, 1, 1, 2, 2, 1, 1, 1, 1, 2, 2));
}

TEST(VtpTest, PointsWithoutALineMayBeAnything) {
  // If this fails, a file is refused for numbers that mean nothing.
  std::string file = withPointData(textFile(), radiusArray("1 1 1 1 1 nan -1"));
  file = replaced(replaced(file, "7 8 9", "7 8 9 nan inf 0 -inf 0 0"), "=\"5\"", "=\"7\"");
  EXPECT_EQ(parse(file).fibers.points.size(), 6U);
  EXPECT_EQ(parse(file).fibers.radius, 1);
}

TEST(VtpTest, RefusesRadiiThatAreNone) {
  // If this fails, a NaN or a negative radius enters a scene, or that of another point.
  const auto refuses = [](const std::string& array, const std::string& reason) {
    const std::string bytes = withPointData(textFile(), array);
    const std::size_t at = bytes.find("<DataArray", bytes.find("<PointData>"));
    expectRefusal(bytes, kVtp, "byte " + std::to_string(at), reason);
  };
  refuses(radiusArray("1 2 3 4"), "there are 4 numbers, but 5 points");
  refuses(radiusArray("1 2 3 4 -5"), "a radius is -5");
  refuses(radiusArray("1 2 3 4 nan"), "a radius is nan");
  refuses(radiusArray("1 2 3 4 inf"), "a radius is inf");
  refuses(radiusArray("1 2 3 4 1e999"), "'1e999' is no finite number");
  refuses(replaced(radiusArray("1 2 3 4 5"), "Name", "NumberOfComponents=\"2\" Name"),
          "NumberOfComponents is not 1");
  const std::string file = textFile(), with = withPointData(file, radiusArray("1 2 3 4 5"));
  for (const auto& [first, second] : {std::pair(file, with), std::pair(with, file)}) {
    expectRefusal(replaced(first, "</PolyData>", pieceOf(second) + "</PolyData>"), kVtp, "byte 0",
                  "some pieces have point data 'radius'");
  }
}

TEST(VtpTest, SaysWhatIsMalformed) {
  // If this fails, a broken file is read as something else, or its author has to guess. Places are
  // those of the element that is wrong.
  const std::string file = textFile();
  const auto refuses = [&](const std::string& from, const std::string& to,
                           const std::string& element, const std::string& reason) {
    const std::string bytes = replaced(file, from, to);
    std::size_t at = 0;
    for (const std::string& name : {std::string("<VTKFile"), element}) at = bytes.find(name, at);
    expectRefusal(bytes, kVtp, "byte " + std::to_string(at), reason);
  };
  refuses("PolyData\"", "ImageData\"", "<VTKFile",
          "type is 'ImageData'; supported are 'PolyData' files (.vtp), as ParaView's");
  refuses("PolyData\"", "PolyData\" byte_order=\"Middle\"", "<VTKFile", "byte_order is 'Middle'");
  refuses("PolyData\"", "PolyData\" header_type=\"UInt8\"", "<VTKFile", "header_type is 'UInt8'");
  refuses("PolyData\"", "PolyData\" compressor=\"vtkLZ4DataCompressor\"", "<VTKFile",
          "compressor is 'vtkLZ4DataCompressor'; supported are '' and 'vtkZLibDataCompressor'");
  refuses("NumberOfLines=\"2\"", "NumberOfLines=\"0\"", "<VTKFile", "there are no lines");
  refuses("NumberOfLines=\"2\"", "NumberOfLines=\"two\"", "<Piece",
          "'two', which is no whole number");
  refuses("NumberOfLines=\"2\"", "NumberOfLines=\"3\"", kEndsElement,
          "there are 2 numbers, but NumberOfLines");
  refuses("NumberOfPoints=\"5\"", "NumberOfPoints=\"6\"", kPointsElement, "there are 15 numbers");
  refuses("NumberOfComponents=\"3\"", "NumberOfComponents=\"2\"", kPointsElement, "is not 3");
  refuses("7 8 9", "7 8 nan", kPointsElement, "point 4 is 7 8 nan");
  refuses("7 8 9", "7 8 x", kPointsElement, "'x' is no finite number");
  refuses("7 8 9", "7 8", kPointsElement, "there are 14 numbers");
  refuses("0 3 4", "0 3 5", kIndicesElement, "a line has point 5 of 5");
  refuses("0 3 4", "0 3 -1", kIndicesElement, "a line has point -1 of 5");
  refuses("0 3 4", "0 3", kEndsElement, "the last number is 6, but the lines have 5 points");
  refuses("0 3 4", "0 3 4 4", kEndsElement, "the last number is 6, but the lines have 7 points");
  refuses("\t4 6", "\t4 7", kEndsElement, "the last number is 7, but the lines have 6 points");
  refuses("\t4 6", "\t4 6 8", kEndsElement, "there are 3 numbers, but NumberOfLines is 2");
  refuses("7 8 9", "7 8 9 0 0 0", kPointsElement, "there are 18 numbers");
  for (const char* bad : {"\t6 4", "\t-1 6"}) {
    refuses("\t4 6", bad, kEndsElement, "do not ascend from 0 on");
  }
  refuses("\t4 6", "\t4 4", kEndsElement, "the last number is 4, but the lines have 6 points");
  refuses("Name=\"offsets\"", "Name=\"ends\"", "<Lines", "there is no DataArray 'offsets'");
  refuses("<Points>", "<Other/><Points format=\"none\"><Nothing/></Points><Points>", "<Points",
          "there is no element DataArray");
  refuses("format=\"ascii\"", "format=\"octal\"", kPointsElement,
          "format is 'octal'; supported are 'ascii'");
  refuses("format=\"ascii\"", "format=\"appended\"", kPointsElement,
          "offset is '', which is no whole number");
  expectRefusal("<a/>", kVtp, "byte 0", "there is no element VTKFile");
  expectRefusal("", kVtp, "byte 0", "No document element found");
  expectRefusal("<VTKFile><a></VTKFile>", kVtp, "byte 14", "tags mismatch");
}

TEST(VtpTest, SaysWhatIsWrongWithBytes) {
  // If this fails, broken arrays are read as others, or beyond the file.
  const auto refuses = [](const std::string& bytes, const std::string& element,
                          const std::string& reason) {
    expectRefusal(bytes, kVtp, "byte " + std::to_string(bytes.find(element)), reason);
  };
  refuses(replaced(inlineFile(), "Float32", "Int16"), "<DataArray",
          "type is 'Int16'; supported are Fl");
  refuses(replaced(inlineFile(), "Int32", "Int8"), "<DataArray type=\"Int8", "type is 'Int8'");
  refuses(replaced(inlineFile(), ">\n", ">\n!"), kPointsElement,
          "has '!', which base64 does not allow there");
  refuses(replaced(inlineFile(), ">\n", ">\n="), kPointsElement,
          "has '=', which base64 does not allow there");
  refuses(replaced(inlineFile(), ">\n", ">\n////"), kPointsElement,
          "ends before its 1023410175 bytes do");
  refuses(replaced(rawFile(), "offset=\"0\"", "offset=\"999\""), kPointsElement,
          "offset is 999, but only");
  refuses(replaced(rawFile(), "offset=\"0\"", "offset=\"64\""), kPointsElement,
          "there are 6 numbers");
  refuses(replaced(rawFile(), "offset=\"64\"", "offset=\"16\""), kIndicesElement,
          "ends before its ");
  refuses(replaced(rawFile(), "\"raw\"", "\"hex\""), "<AppendedData", "encoding is 'hex'");
  refuses(replaced(rawFile(), "\n _", "\n "), "<AppendedData", "do not start with '_'");
  refuses(replaced(rawFile(), "</AppendedData>", ""), "<AppendedData", "end with </AppendedData>");
  FileBytes nan;
  nan.text(pointBytes()).setLittle(16, HUGE_VALF);
  refuses(rawFileWith(sized(nan.bytes())), kPointsElement, "point 1 is 1 inf 0");
  refuses(rawFileWith(sized("123")), kPointsElement, "3 bytes are no multiple of 4");
}

TEST(VtpTest, ArraysAreNoLongerThanTheFile) {
  // If this fails, a file of pieces that share an array becomes as large as it likes.
  const std::string file = rawFile(), piece = pieceOf(file);
  EXPECT_TRUE(parsesSafely(replaced(file, piece, piece + piece), kVtp));
  // Twenty pieces of little text, and of the same 1 MB of points.
  const std::string points(12 * 87381, '\0');
  const std::string shared = rawFileWith(sized(points));
  const std::string one = replaced(pieceOf(shared), "NumberOfPoints=\"5\"",
                                   "NumberOfPoints=\"" + std::to_string(points.size() / 12) + "\"");
  std::string all;
  for (int i = 0; i < 20; ++i) all += one;
  const std::string bytes = replaced(shared, pieceOf(shared), all);
  EXPECT_FALSE(parsesSafely(bytes, kVtp));
  EXPECT_THAT([&] { parse(bytes); }, testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr(
                                         "all arrays together exceed the file's")));
}

TEST(VtpTest, RefusesBlocksThatAreNotAsTheySay) {
  // If this fails, a few bytes ask for all memory, or arrays hold what zlib never gave.
  const auto refuses = [](const std::string& array, const std::string& reason) {
    const std::string bytes = compressedRawFileWith(array);
    EXPECT_FALSE(parsesSafely(bytes, kVtp));
    expectRefusal(bytes, kVtp, "byte " + std::to_string(bytes.find("<DataArray")), reason);
  };
  const auto blocks = [](std::vector<std::uint32_t> header, const std::string& data) {
    FileBytes array;
    for (const std::uint32_t word : header) array.little(word);
    return array.text(data).bytes();
  };
  const std::string good = deflated(pointBytes());
  const auto size = static_cast<std::uint32_t>(good.size());
  refuses(blocks({~0U, 16, 0, size}, good), "has 4294967295 blocks of 16 bytes");
  refuses(blocks({1, ~0U, 0, size}, good), "has 1 blocks of 4294967295 bytes");
  refuses(blocks({1, 60, 61, size}, good), "the last one of 61");
  refuses(blocks({300, 30000, 0, size}, good), "exceed 64 times the file's ");
  refuses(blocks({1, 0, 0, size}, good), "has 1 blocks of 0 bytes");
  refuses(blocks({1, 60, 0, size + 1000}, good), "ends before its ");
  refuses(blocks({1, 60, 0, size - 1}, good), "zlib does not inflate to 60 bytes");
  refuses(blocks({1, 64, 0, size}, good), "zlib does not inflate to 64 bytes");
  refuses(blocks({1, 56, 0, size}, good), "zlib does not inflate to 56 bytes");
  refuses(blocks({0, 0, 0}, ""), "there are 0 numbers");
  // Zeros become a thousandth of themselves.
  const std::string zeros = deflated(std::string(1000000, '\0'));
  refuses(blocks({1, 1000000, 0, static_cast<std::uint32_t>(zeros.size())}, zeros),
          "beyond a file of ");
}

TEST(VtpTest, DamageIsRefusedOrHarmless) {
  // If this fails, a file that was not copied to its end is read as if it were whole, or a damaged
  // one crashes the reader or yields a scene that is not one.
  for (const std::string& bytes : sampleFiles()) {
    expectSafeTruncations(bytes, kVtp, bytes.size());
    expectSafeBitFlips(bytes, kVtp);
  }
  expectSafeBitFlips(withPointData(textFile(), radiusArray("1 2 3 4 5")), kVtp);
}

TEST(VtpTest, MemoryIsBoundedWhereElementsAreShortest) {
  // If this fails, a large file takes more memory than the reader promises.
  std::string elements, few_elements, attributes, numbers;
  for (int i = 0; i < 50000; ++i) {
    elements += "<a/>x";
    if (i % 4 == 0) few_elements += "<a b='' c=''/>xy";
    attributes += " a=''";
    numbers += "0 ";
  }
  const auto before = [](const std::string& xml) {
    return replaced(textFile(), "<PolyData>", xml + "<PolyData>");
  };
  EXPECT_FALSE(parsesSafely(before(elements), kVtp));
  expectRefusal(before(elements), kVtp, "byte 0", "there are 50016 tags in ");
  EXPECT_TRUE(parsesSafely(before(few_elements), kVtp));
  EXPECT_TRUE(parsesSafely(before("<a" + attributes + "/>"), kVtp));
  // Lines of one point, which take no more than its index and the end of the line.
  std::string ends;
  for (int i = 1; i <= 20000; ++i) ends += std::to_string(i) + ' ';
  const std::string lines = replaced(textFile(), "NumberOfLines=\"2\"", "NumberOfLines=\"20000\"");
  EXPECT_TRUE(parsesSafely(
      replaced(replaced(lines, "0 1 2 0 3 4", numbers.substr(0, 40000)), "\t4 6\n", ends), kVtp));
  const std::string indices =
      replaced(replaced(textFile(), "0 1 2 0 3 4", numbers), "6\n", "50000");
  EXPECT_TRUE(parsesSafely(indices, kVtp));
  // Radii that differ, so that each point has its own.
  EXPECT_TRUE(parsesSafely(
      withPointData(replaced(indices, numbers, "1 " + numbers.substr(2)), radiusArray("1 2 3 4 5")),
      kVtp));
  EXPECT_TRUE(parsesSafely(
      withPointData(replaced(indices, numbers, "1 " + numbers.substr(2)),
                    radiusArray("1 2 3 4 5") + arrayOf("Int64", "swc_sample", "1 2 3 4 5") +
                        arrayOf("Int64", "swc_type", "1 2 3 4 5")),
      kVtp));
}

// The points of the lines of the files that VTK wrote.
const std::vector<int> kWrittenPoints = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 6, 3, 10, 11};

class VtpWrittenByVtkTest : public testing::TestWithParam<const char*> {};

TEST_P(VtpWrittenByVtkTest, IsReadAsItIs) {
  // If this fails, we read what we write, and not what VTK does.
  const FiberFile file =
      readFibers(FCL_FIBERS_SOURCE_DIR "/tests/data/" + std::string(GetParam()), {0.1});
  EXPECT_EQ(file.format, kVtp);
  expectWellFormed(file.fibers);
  EXPECT_THAT(file.fibers.point_begin, ElementsAre(0, 4, 6, 11, 14));
  EXPECT_THAT(file.fibers.closed, ElementsAre(0, 0, 1, 0));
  EXPECT_THAT(file.fibers.starts_at, ElementsAre(-1, -1, -1, 3));
  ASSERT_EQ(file.fibers.points.size(), kWrittenPoints.size());
  for (std::size_t i = 0; i < kWrittenPoints.size(); ++i) {
    const double j = kWrittenPoints[i];
    EXPECT_EQ(file.fibers.points[i], (Point{0.5 * j, 0.25 * j * j, -1.125 * j}));
  }
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST(VtpRadiiTest, OfAFileWrittenByVtkAreRead) {
  // If this fails, we read radii as we write them, and not as VTK does.
  const FiberFile file = readFibers(FCL_FIBERS_SOURCE_DIR "/tests/data/radii.vtp");
  EXPECT_TRUE(file.has_radius);
  expectWellFormed(file.fibers);
  ASSERT_EQ(file.fibers.radii.size(), kWrittenPoints.size());
  const auto radius = [](std::size_t i) { return 0.5 + 0.25 * (kWrittenPoints[i] % 5); };
  for (std::size_t i = 0; i < kWrittenPoints.size(); ++i) {
    EXPECT_EQ(file.fibers.radii[i], radius(i)) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(File, VtpWrittenByVtkTest,
                         testing::Values("ascii_none_little_h32_float.vtp",
                                         "binary_none_big_h64_double.vtp",
                                         "binary_zlib_little_h32_float.vtp",
                                         "appended_raw_none_little_h64_double.vtp",
                                         "appended_raw_zlib_big_h32_float.vtp",
                                         "appended_base64_zlib_little_h64_double.vtp"),
                         [](const auto& file) {
                           const std::string name = file.param;
                           return name.substr(0, name.find('.'));
                         });

}  // namespace
}  // namespace fcl_fibers::io
