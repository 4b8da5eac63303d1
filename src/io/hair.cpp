// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "arguments.h"
#include "bytes.h"
#include "io/file_bytes.h"
#include "io/formats.h"
#include "io/point_radii.h"
#include "io/require_scene.h"

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

/// Half of a thickness that was read at a place.
double radiusOf(const ByteReader& file, std::uint64_t at, const char* what, float thickness) {
  if (!(thickness >= 0) || !std::isfinite(thickness)) file.refuse(at, what, " is ", thickness);
  return 0.5 * static_cast<double>(thickness);
}

void requireHair(const FiberPolylines& scene) {
  requireScene("writeHair", scene);
  if (scene.fiberCount() == 0) {
    refuseArgument("writeHair", "the number of fibers", 0, "give at least one");
  }
  if (scene.points.size() > std::numeric_limits<std::uint32_t>::max()) {
    refuseArgument("writeHair", "the number of points", scene.points.size(),
                   "the format holds at most 2^32 - 1; write several files");
  }
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t points = scene.point_begin[f + 1] - scene.point_begin[f];
    if (points > 0 && points <= std::size_t{1} << 16) continue;
    const std::string name = "the number of points of fiber " + std::to_string(f);
    refuseArgument("writeHair", name.c_str(), points,
                   points == 0 ? "the format holds at least 1; leave the fiber out, or write .vtp"
                               : "the format holds at most 65,536; divide the fiber");
  }
}

/// Refuses a number beyond the range of float.
void appendFloat(std::string& bytes, const char* name, double number) {
  if (!(std::abs(number) <= static_cast<double>(std::numeric_limits<float>::max()))) {
    refuseArgument("writeHair", name, number, "give a number that a float can hold");
  }
  appendLittleEndian(bytes, static_cast<float>(number));
}

}  // namespace

ParsedFibers parseHair(ByteReader& file, const FiberFileOptions&) {
  if (file.take(4, "the header") != "HAIR") file.refuse(0, "the file does not start with HAIR");
  const auto word = [&] { return file.number<std::uint32_t>("the header"); };
  const std::uint64_t strands = word(), points = word();
  const std::uint32_t flags = word(), default_segments = word();
  const auto default_thickness = file.number<float>("the header");
  const auto has = [&](std::uint32_t flag) { return (flags & flag) != 0; };
  file.seek(kHeaderSize, "the header");
  if (strands == 0) file.refuse(4, "there are no strands");
  if ((flags & ~kAllFlags) != 0) {
    file.refuse(12, "flags are ", flags, "; known flags are those up to 16");
  }
  if (!has(kPoints)) file.refuse(12, "there is no array of points");
  const std::uint64_t bytes_by_point =
      12 + (has(kThickness) ? 4 : 0) + (has(kTransparency) ? 4 : 0) + (has(kColor) ? 12 : 0);
  const std::uint64_t needed =
      kHeaderSize + (has(kSegments) ? 2 * strands : 0) + bytes_by_point * points;
  if (needed > file.size()) {
    file.refuse(8, strands, " strands of ", points, " points take ", needed,
                " bytes, but the file has ", file.size());
  }
  // Each strand has at least one point.
  if (strands > points) file.refuse(4, strands, " strands have only ", points, " points");

  ParsedFibers parsed;
  parsed.is_float = true;
  parsed.reserve(points, strands);
  FiberPolylines& scene = parsed.fibers;
  std::vector<std::size_t>& begin = scene.point_begin;
  for (std::uint64_t strand = 0; strand < strands; ++strand) {
    const std::uint64_t at = has(kSegments) ? file.offset() : 16;
    const std::uint32_t segments =
        has(kSegments) ? file.number<std::uint16_t>("the segments") : default_segments;
    const std::uint64_t end = begin.back() + std::uint64_t{segments} + 1;
    if (end > points) {
      file.refuse(at, "strand ", strand, " has ", segments, " segments and ends at point ", end,
                  " of ", points);
    }
    begin.push_back(static_cast<std::size_t>(end));
  }
  if (begin.back() != points) {
    file.refuse(8, "the header has ", points, " points, but the strands have ", begin.back());
  }
  for (std::uint64_t i = 0; i < points; ++i) scene.points.push_back(file.point());
  if (has(kThickness)) {
    std::vector<double> radii;
    radii.reserve(scene.points.size());
    for (std::uint64_t i = 0; i < points; ++i) {
      const std::uint64_t at = file.offset();
      radii.push_back(radiusOf(file, at, "a thickness", file.number<float>("the thickness")));
    }
    parsed.setRadii(std::move(radii));
  } else {
    scene.radius = radiusOf(file, 20, "the default thickness", default_thickness);
  }
  if (has(kTransparency)) {
    file.take(4 * points, "the transparency");
    parsed.passed_over.push_back("transparency");
  }
  if (has(kColor)) {
    file.take(12 * points, "the colour");
    parsed.passed_over.push_back("colour");
  }
  parsed.expectEnd(file);
  return parsed;
}

void writeHair(const std::string& path, const FiberPolylines& scene) {
  requireHair(scene);
  const bool by_point = !scene.radii.empty();
  std::string bytes = "HAIR";
  appendLittleEndian(bytes, static_cast<std::uint32_t>(scene.fiberCount()));
  appendLittleEndian(bytes, static_cast<std::uint32_t>(scene.points.size()));
  appendLittleEndian(bytes, kSegments | kPoints | (by_point ? kThickness : 0));
  appendLittleEndian(bytes, std::uint32_t{0});
  appendFloat(bytes, "thickness", 2 * scene.radius);
  appendLittleEndian(bytes, 0.0F);                              // transparency
  for (int k = 0; k < 3; ++k) appendLittleEndian(bytes, 1.0F);  // colour
  bytes.resize(kHeaderSize, '\0');
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    appendLittleEndian(bytes, static_cast<std::uint16_t>(scene.segmentCount(f)));
  }
  for (const Point& point : scene.points) {
    for (const double coordinate : point) appendFloat(bytes, "a coordinate", coordinate);
  }
  if (by_point) {
    for (const double radius : pointRadii(scene)) appendFloat(bytes, "thickness", 2 * radius);
  }
  writeBytes("writeHair", path, bytes);
}

}  // namespace fcl_fibers::io
