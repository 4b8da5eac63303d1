// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>

#include "io/formats.h"

namespace fcl_fibers::io {

// The fields in which versions of the format differ. Numbers are little endian, sizes are in bytes.
//
//     version  0          4        8                  12              144
//     3        float 3.x  strands  points per strand                  offset of the points
//     4        float 4.x  strands  points per strand  same as at 144
ParsedFibers parseTfx(ByteReader& file, const FiberFileOptions&) {
  const float version = file.number<float>("the header");
  const bool is_version_3 = version >= 3 && version < 4;
  if (!is_version_3 && !(version >= 4 && version < 5)) {
    file.refuse(0, "version is ", version, "; supported are 3 and 4");
  }
  // Of version 3 this is the known part; in files, points start at byte 296.
  const std::uint64_t header_size = is_version_3 ? 148 : 160;
  const std::uint64_t offset_field = is_version_3 ? 144 : 12;
  const std::uint64_t point_size = is_version_3 ? 12 : 16;
  if (file.size() < header_size) file.refuseEnd("the header");

  const auto word = [&] { return file.number<std::uint32_t>("the header"); };
  const std::uint64_t strands = word(), points_per_strand = word();
  file.seek(offset_field, "the header");
  const std::uint64_t offset = word();
  if (strands == 0) file.refuse(4, "there are no strands");
  if (points_per_strand < 2) {
    file.refuse(8, "points per strand are ", points_per_strand, "; at least 2 are needed");
  }
  file.seekPoints(offset, header_size, offset_field);
  // The product of two 32-bit counts fits 64 bits; times the size of a point it might not.
  const std::uint64_t points = strands * points_per_strand;
  if (points > file.remaining() / point_size) {
    file.refuse(4, strands, " strands of ", points_per_strand, " points from byte ", offset,
                " on end beyond the file of ", file.size(), " bytes");
  }

  ParsedFibers parsed;
  parsed.is_float = true;
  parsed.reserve(points, strands);
  for (std::uint64_t i = 1; i <= points; ++i) {
    parsed.fibers.points.push_back(file.point());
    file.take(point_size - 12, "the points");
    if (i % points_per_strand == 0) parsed.endFiber();
  }
  return parsed;  // Other arrays may follow.
}

}  // namespace fcl_fibers::io
