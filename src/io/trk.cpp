// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "io/formats.h"
#include "io/trk_space.h"

namespace fcl_fibers::io {
namespace {

// The format, from https://trackvis.org/docs/?subsect=fileformat: a header, then for each
// streamline an int32 of its points, these with their scalars, and its properties, all floats.
//
//     byte 0       6              12              36             238
//     "TRACK"      int16 3        float 3         int16          int16
//                  dimensions     voxel size      scalars        properties
//
//     byte 440         948              988             992        996
//     float 4 x 4      char 4           int32           int32      int32
//     vox_to_ras       voxel order      streamlines     version    1000, the header's size
constexpr std::uint64_t kDimensions = 6, kVoxelSize = 12, kScalars = 36, kProperties = 238,
                        kVoxToRas = 440, kVoxelOrder = 948, kStreamlines = 988, kVersion = 992,
                        kSize = 996;
constexpr std::int32_t kHeaderSize = 1000;

struct Header {
  ByteOrder order = ByteOrder::kLittle;
  std::uint64_t floats_per_point = 3;
  std::uint64_t floats_per_streamline = 0;
  std::uint64_t streamlines = 0;  // 0: the file does not tell
  TrkSpace space;
};

template <typename T>
T numberAt(ByteReader& file, std::uint64_t at, ByteOrder order) {
  file.seek(at, "the header");
  return file.number<T>("the header", order);
}

ByteOrder readByteOrder(ByteReader& file) {
  for (const ByteOrder order : {ByteOrder::kLittle, ByteOrder::kBig}) {
    if (numberAt<std::int32_t>(file, kSize, order) == kHeaderSize) return order;
  }
  file.refuse(kSize, "the header's size is not 1000 in either byte order");
}

std::uint64_t countAt(ByteReader& file, std::uint64_t at, std::int64_t count, const char* what) {
  if (count < 0) file.refuse(at, "the number of ", what, " is ", count);
  return static_cast<std::uint64_t>(count);
}

/// Reads the letters of the axes, for example LPS.
VoxelAxes readVoxelOrder(ByteReader& file, ParsedFibers& parsed) {
  file.seek(kVoxelOrder, "the header");
  std::string letters(file.take(4, "the header"));
  letters.resize(letters.find_last_not_of(std::string_view(" \0", 2)) + 1);
  for (char& c : letters) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  if (letters.empty()) {
    letters = "LPS";
    parsed.warnings.push_back("The header has no voxel order; LPS is assumed, TrackVis's default.");
  }
  const std::optional<VoxelAxes> axes = namedAxes(letters);
  if (!axes) {
    file.refuse(kVoxelOrder, "the voxel order is '", ByteReader::shortened(letters),
                "'; give one letter each of R or L, A or P, and S or I");
  }
  return *axes;
}

void readVoxToRas(ByteReader& file, ByteOrder order, std::int32_t version, TrkSpace& space,
                  ParsedFibers& parsed) {
  space.to_world = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  space.origin = {0, 0, 0};
  std::array<double, 16> entries{};
  file.seek(kVoxToRas, "the header");
  for (double& entry : entries) {
    entry = static_cast<double>(file.number<float>("the header", order));
    if (version != 1 && !std::isfinite(entry)) {
      file.refuse(file.offset() - sizeof(float), "an entry of vox_to_ras is ", entry);
    }
  }
  if (version == 1 || entries.back() == 0) {  // which tells that there is no matrix
    parsed.warnings.push_back("The header has no vox_to_ras; the identity is assumed.");
    return;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) space.to_world[i][k] = entries[4 * i + k];
    space.origin[i] = entries[4 * i + 3];
  }
}

TrkSpace readSpace(ByteReader& file, ByteOrder order, std::int32_t version, ParsedFibers& parsed) {
  TrkSpace space;
  for (std::size_t k = 0; k < 3; ++k) {
    space.dimensions[k] = numberAt<std::int16_t>(file, kDimensions + 2 * k, order);
    const std::uint64_t at = kVoxelSize + 4 * k;
    space.voxel_size[k] = static_cast<double>(numberAt<float>(file, at, order));
    if (!(space.voxel_size[k] > 0) || !std::isfinite(space.voxel_size[k])) {
      file.refuse(at, "a voxel size is ", space.voxel_size[k]);
    }
  }
  readVoxToRas(file, order, version, space, parsed);
  const std::optional<VoxelAxes> axes = nearestAxes(space.to_world);
  if (!axes) file.refuse(kVoxToRas, "vox_to_ras is flat: its columns are not independent");
  space.setAxes(readVoxelOrder(file, parsed), *axes);
  for (std::size_t k = 0; k < 3; ++k) {
    if (space.sign[k] > 0 || space.dimensions[k] > 0) continue;
    parsed.warnings.push_back(
        "The header has no dimensions, which the voxel order needs; the fibers may be displaced.");
    break;
  }
  return space;
}

Header readHeader(ByteReader& file, ParsedFibers& parsed) {
  if (file.take(5, "the header") != "TRACK") file.refuse(0, "the file does not start with TRACK");
  Header header;
  header.order = readByteOrder(file);
  const auto version = numberAt<std::int32_t>(file, kVersion, header.order);
  if (version < 1 || version > 3) {
    file.refuse(kVersion, "version is ", version, "; supported are 1 and 2");
  }
  if (version == 3)
    parsed.warnings.push_back("Version is 3; the file is read as one of version 2.");
  const auto scalars = numberAt<std::int16_t>(file, kScalars, header.order);
  header.floats_per_point = 3 + countAt(file, kScalars, scalars, "scalars");
  const auto properties = numberAt<std::int16_t>(file, kProperties, header.order);
  header.floats_per_streamline = countAt(file, kProperties, properties, "properties");
  const auto streamlines = numberAt<std::int32_t>(file, kStreamlines, header.order);
  header.streamlines = countAt(file, kStreamlines, streamlines, "streamlines");
  header.space = readSpace(file, header.order, version, parsed);
  file.seek(kHeaderSize, "the header");
  return header;
}

struct Extent {
  std::uint64_t streamlines = 0, empty = 0, points = 0;
};

/// Goes from streamline to streamline. Those that are counted are inside the file.
Extent measure(ByteReader file, const Header& header) {
  Extent extent;
  while (!file.atEnd() && (header.streamlines == 0 || extent.streamlines < header.streamlines)) {
    const std::uint64_t at = file.offset();
    const auto count = file.number<std::int32_t>("a streamline", header.order);
    const std::uint64_t points = countAt(file, at, count, "points");
    // The product has 31 and 16 bits.
    const std::uint64_t floats = points * header.floats_per_point + header.floats_per_streamline;
    if (floats > file.remaining() / sizeof(float)) {
      file.refuse(at, "a streamline of ", points, " points takes ", floats * sizeof(float),
                  " bytes, but ", file.remaining(), " follow");
    }
    file.take(floats * sizeof(float), "a streamline");
    ++extent.streamlines;
    extent.empty += points == 0 ? 1 : 0;
    extent.points += points;
  }
  return extent;
}

Point readPoint(ByteReader& file, const Header& header) {
  const std::uint64_t at = file.offset();
  Point point;
  for (double& c : point) c = file.coordinate<float>(header.order);
  const Point world = header.space.toWorld(point);
  for (const double c : world) {
    // A double holds any product of floats, but what is beyond them is no place.
    if (std::abs(c) > static_cast<double>(std::numeric_limits<float>::max())) {
      file.refuse(at, "a coordinate is ", c, " by vox_to_ras");
    }
  }
  return world;
}

}  // namespace

ParsedFibers parseTrk(ByteReader& file) {
  ParsedFibers parsed;
  parsed.is_float = true;
  const Header header = readHeader(file, parsed);
  const Extent extent = measure(file, header);
  if (extent.points == 0) file.refuse(kStreamlines, "there are no streamlines with points");
  FiberPolylines& scene = parsed.fibers;
  scene.points.reserve(static_cast<std::size_t>(extent.points));
  scene.point_begin.reserve(static_cast<std::size_t>(extent.streamlines - extent.empty + 1));
  for (std::uint64_t s = 0; s < extent.streamlines; ++s) {
    const auto points = file.number<std::int32_t>("a streamline", header.order);
    for (std::int32_t i = 0; i < points; ++i) {
      scene.points.push_back(readPoint(file, header));
      file.take(sizeof(float) * (header.floats_per_point - 3), "the scalars");
    }
    file.take(sizeof(float) * header.floats_per_streamline, "the properties");
    if (points > 0) parsed.endFiber();
  }
  if (header.floats_per_point > 3) parsed.passed_over.push_back("scalars");
  if (header.floats_per_streamline > 0) parsed.passed_over.push_back("properties");
  warnOfEmptyFibers(extent.empty, "streamline", parsed);
  if (header.streamlines == 0) {
    parsed.warnings.push_back(
        "The header does not tell the number of streamlines, so a truncated file may pass for "
        "whole.");
  } else if (extent.streamlines < header.streamlines) {
    parsed.warnings.push_back("The header has " + std::to_string(header.streamlines) +
                              " streamlines, but the file has " +
                              std::to_string(extent.streamlines) + "; it may be truncated.");
  }
  expectEnd(file, parsed);
  return parsed;
}

}  // namespace fcl_fibers::io
