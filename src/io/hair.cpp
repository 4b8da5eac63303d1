// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "arguments.h"
#include "io/formats.h"
#include "io/point_radii.h"

namespace fcl_fibers::io {
namespace {

// The format, from http://www.cemyuksel.com/research/hairmodels/: numbers are little endian, and
// arrays follow the header in the order of their flags.
//
//     byte 0     4        8       12     16                20                 24 .. 128
//     "HAIR"     strands  points  flags  default segments  default thickness  colours, text
//
//     flag       1                2        4          8             16
//     array of   uint16 segments  float 3  float      float         float 3
//                by strand        points   thickness  transparency  colour, by point
constexpr std::uint64_t kHeaderSize = 128;
constexpr std::uint32_t kSegments = 1, kPoints = 2, kThickness = 4, kTransparency = 8, kColor = 16;
constexpr std::uint32_t kAllFlags = kSegments | kPoints | kThickness | kTransparency | kColor;

struct Header {
  std::uint64_t strands;
  std::uint64_t points;
  std::uint32_t flags;
  std::uint32_t default_segments;
  float default_thickness;

  bool has(std::uint32_t flag) const { return (flags & flag) != 0; }
};

// Counts in the returned header fit the file's size.
Header readHeader(ByteReader& file) {
  if (file.take(4, "the header") != "HAIR") file.refuse(0, "the file does not start with HAIR");
  Header header;
  header.strands = file.number<std::uint32_t>("the header");
  header.points = file.number<std::uint32_t>("the header");
  header.flags = file.number<std::uint32_t>("the header");
  header.default_segments = file.number<std::uint32_t>("the header");
  header.default_thickness = file.number<float>("the header");
  file.seek(kHeaderSize, "the header");

  if (header.strands == 0) file.refuse(4, "there are no strands");
  if ((header.flags & ~kAllFlags) != 0) {
    file.refuse(12, "flags are ", header.flags, "; known flags are those up to 16");
  }
  if (!header.has(kPoints)) file.refuse(12, "there is no array of points");
  const std::uint64_t bytes_by_point = 12 + (header.has(kThickness) ? 4 : 0) +
                                       (header.has(kTransparency) ? 4 : 0) +
                                       (header.has(kColor) ? 12 : 0);
  const std::uint64_t needed = kHeaderSize + (header.has(kSegments) ? 2 * header.strands : 0) +
                               bytes_by_point * header.points;
  if (needed > file.size()) {
    file.refuse(8, header.strands, " strands of ", header.points, " points take ", needed,
                " bytes, but the file has ", file.size());
  }
  return header;
}

void readSegments(ByteReader& file, const Header& header, ParsedFibers& parsed) {
  // Each strand has at least one point.
  if (header.strands > header.points) {
    file.refuse(4, header.strands, " strands have only ", header.points, " points");
  }
  std::vector<std::size_t>& begin = parsed.fibers.point_begin;
  begin.reserve(static_cast<std::size_t>(header.strands) + 1);
  for (std::uint64_t strand = 0; strand < header.strands; ++strand) {
    const std::uint64_t at = file.offset();
    const std::uint32_t segments = header.has(kSegments)
                                       ? file.number<std::uint16_t>("the segments")
                                       : header.default_segments;
    const std::uint64_t end = begin.back() + std::uint64_t{segments} + 1;
    if (end > header.points) {
      file.refuse(header.has(kSegments) ? at : 16, "strand ", strand, " has ", segments,
                  " segments and ends at point ", end, " of ", header.points);
    }
    begin.push_back(static_cast<std::size_t>(end));
  }
  if (begin.back() != header.points) {
    file.refuse(8, "the header has ", header.points, " points, but the strands have ",
                begin.back());
  }
}

float readThickness(ByteReader& file) {
  const std::uint64_t at = file.offset();
  const float thickness = file.number<float>("the thickness");
  if (!(thickness >= 0) || !std::isfinite(thickness)) {
    file.refuse(at, "a thickness is ", thickness);
  }
  return thickness;
}

void readRadii(ByteReader& file, FiberPolylines& scene) {
  std::vector<double> radii;
  radii.reserve(scene.points.size());
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    radii.push_back(0.5 * static_cast<double>(readThickness(file)));
  }
  setPointRadii(scene, std::move(radii));
}

class HairWriter {
 public:
  void add(std::uint32_t word) { addBits(word, 4); }
  void add(std::uint16_t word) { addBits(word, 2); }
  void add(float number) {
    std::uint32_t word = 0;
    std::memcpy(&word, &number, sizeof word);
    add(word);
  }
  /// Refuses a number beyond the range of float.
  void addAsFloat(const char* name, double number) {
    if (!(std::abs(number) <= static_cast<double>(std::numeric_limits<float>::max()))) {
      refuseArgument("writeHair", name, number, "give a number that a float can hold");
    }
    add(static_cast<float>(number));
  }
  void addZeros(std::size_t count) { bytes_.append(count, '\0'); }
  void addText(const char* text) { bytes_ += text; }
  const std::string& bytes() const { return bytes_; }

 private:
  void addBits(std::uint32_t word, int count) {
    for (int i = 0; i < count; ++i) bytes_ += static_cast<char>(word >> (8 * i) & 0xFF);
  }
  std::string bytes_;
};

void requireHair(const FiberPolylines& scene) {
  requireFiberRanges("writeHair", scene);
  requireRadii<double>("writeHair", scene);
  if (scene.fiberCount() == 0) {
    refuseArgument("writeHair", "the number of fibers", 0, "give at least one");
  }
  if (scene.points.size() > std::numeric_limits<std::uint32_t>::max()) {
    refuseArgument("writeHair", "the number of points", scene.points.size(),
                   "the format holds at most 2^32 - 1; write several files");
  }
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t points = scene.point_begin[f + 1] - scene.point_begin[f];
    if (points <= std::size_t{1} << 16) continue;
    const std::string name = "the number of points of fiber " + std::to_string(f);
    refuseArgument("writeHair", name.c_str(), points,
                   "the format holds at most 65,536; divide the fiber");
  }
}

std::string hairBytes(const FiberPolylines& scene) {
  const bool by_point = !scene.radii.empty() || hasPointRadii(scene);
  HairWriter file;
  file.addText("HAIR");
  file.add(static_cast<std::uint32_t>(scene.fiberCount()));
  file.add(static_cast<std::uint32_t>(scene.points.size()));
  file.add(kSegments | kPoints | (by_point ? kThickness : 0));
  file.add(std::uint32_t{0});
  file.addAsFloat("thickness", 2 * scene.radius);
  file.add(0.0F);                              // transparency
  for (int k = 0; k < 3; ++k) file.add(1.0F);  // colour
  file.addZeros(kHeaderSize - file.bytes().size());

  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    file.add(static_cast<std::uint16_t>(scene.point_begin[f + 1] - scene.point_begin[f] - 1));
  }
  for (const Point& point : scene.points) {
    for (const double coordinate : point) file.addAsFloat("a coordinate", coordinate);
  }
  if (by_point) {
    for (const double radius : pointRadii(scene)) file.addAsFloat("thickness", 2 * radius);
  }
  return file.bytes();
}

}  // namespace

ParsedFibers parseHair(ByteReader& file) {
  const Header header = readHeader(file);
  ParsedFibers parsed;
  parsed.is_float = true;
  readSegments(file, header, parsed);

  FiberPolylines& scene = parsed.fibers;
  scene.points.reserve(static_cast<std::size_t>(header.points));
  for (std::uint64_t i = 0; i < header.points; ++i) {
    Point& point = scene.points.emplace_back();
    for (double& coordinate : point) coordinate = file.coordinate<float>();
  }
  if (header.has(kThickness)) {
    readRadii(file, scene);
    parsed.holds_radii = true;
  } else {
    if (!(header.default_thickness >= 0) || !std::isfinite(header.default_thickness)) {
      file.refuse(20, "the default thickness is ", header.default_thickness);
    }
    scene.radius = 0.5 * static_cast<double>(header.default_thickness);
  }
  if (header.has(kTransparency)) {
    file.take(4 * header.points, "the transparency");
    parsed.passed_over.push_back("transparency");
  }
  if (header.has(kColor)) {
    file.take(12 * header.points, "the colour");
    parsed.passed_over.push_back("colour");
  }
  expectEnd(file, parsed);
  return parsed;
}

void writeHair(const std::string& path, const FiberPolylines& scene) {
  requireHair(scene);
  const std::string bytes = hairBytes(scene);
  std::ofstream stream(path, std::ios::binary);
  if (!stream) {
    throw std::runtime_error(
        "writeHair: '" + path +
        "' cannot be opened; check that its folder exists and may be written to");
  }
  stream << bytes;
  stream.close();
  if (!stream) {
    throw std::runtime_error("writeHair: '" + path +
                             "': writing failed; check that the disk has room");
  }
}

}  // namespace fcl_fibers::io
