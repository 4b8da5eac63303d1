// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>

#include "io/formats.h"

namespace fcl_fibers::io {
namespace {

// The fields in which versions of the format differ. Numbers are little endian, sizes are in bytes.
//
//     version  0          4        8                  12              144
//     3        float 3.x  strands  points per strand                  offset of the points
//     4        float 4.x  strands  points per strand  same as at 144
struct Layout {
  std::uint64_t header_size;
  std::uint64_t points_field;
  std::uint64_t point_size;
};
constexpr Layout kVersion3 = {148, 144, 12};  // The known part; in files, points start at byte 296.
constexpr Layout kVersion4 = {160, 12, 16};

struct Header {
  std::uint64_t strands;
  std::uint64_t points_per_strand;
  std::uint64_t points_offset;
  std::uint64_t point_size;
};

// The header that it returns is consistent: points lie after the header and inside the file.
Header readHeader(ByteReader& file) {
  const float version = file.number<float>("the header");
  const bool is_version_3 = version >= 3 && version < 4;
  const bool is_version_4 = version >= 4 && version < 5;
  if (!is_version_3 && !is_version_4) {
    file.refuse(0, "version is ", version, "; supported are 3 and 4");
  }
  const Layout& layout = is_version_3 ? kVersion3 : kVersion4;
  if (file.size() < layout.header_size) file.refuseEnd("the header");

  Header header;
  header.strands = file.number<std::uint32_t>("the header");
  header.points_per_strand = file.number<std::uint32_t>("the header");
  file.seek(layout.points_field, "the header");
  header.points_offset = file.number<std::uint32_t>("the header");
  header.point_size = layout.point_size;
  if (header.strands == 0) file.refuse(4, "there are no strands");
  if (header.points_per_strand < 2) {
    file.refuse(8, "points per strand are ", header.points_per_strand, "; at least 2 are needed");
  }
  if (header.points_offset < layout.header_size) {
    file.refuse(layout.points_field, "points start at byte ", header.points_offset,
                ", inside the header of ", layout.header_size, " bytes");
  }
  if (header.points_offset > file.size()) {
    file.refuse(layout.points_field, "points start at byte ", header.points_offset,
                " of a file of ", file.size(), " bytes");
  }
  // The product of two 32-bit counts fits 64 bits; times the size of a point it might not.
  const std::uint64_t points = header.strands * header.points_per_strand;
  if (points > (file.size() - header.points_offset) / header.point_size) {
    file.refuse(4, header.strands, " strands of ", header.points_per_strand, " points from byte ",
                header.points_offset, " on end beyond the file of ", file.size(), " bytes");
  }
  return header;
}

}  // namespace

ParsedFibers parseTfx(ByteReader& file) {
  const Header header = readHeader(file);
  ParsedFibers parsed;
  parsed.is_float = true;
  FiberPolylines& scene = parsed.fibers;
  scene.points.reserve(static_cast<std::size_t>(header.strands * header.points_per_strand));
  scene.point_begin.reserve(static_cast<std::size_t>(header.strands + 1));

  file.seek(header.points_offset, "the points");
  for (std::uint64_t strand = 0; strand < header.strands; ++strand) {
    for (std::uint64_t i = 0; i < header.points_per_strand; ++i) {
      Point& point = scene.points.emplace_back();
      for (double& coordinate : point) coordinate = file.coordinate<float>();
      file.take(header.point_size - 12, "the points");
    }
    parsed.endFiber();
  }
  return parsed;  // Other arrays may follow.
}

}  // namespace fcl_fibers::io
