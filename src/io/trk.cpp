// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "io/formats.h"
#include "io/vectors.h"

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

using Matrix3 = std::array<Point, 3>;  ///< rows

/// Where an axis may point to: right, left, to the front (anterior), back, up (superior) or down
/// (inferior).
constexpr std::string_view kLetters = "RLAPSI";

/// The line of a letter's direction: 0 for R and L, 1 for A and P, 2 for S and I.
std::size_t lineOf(char letter) { return kLetters.find(letter) / 2; }

/// Returns the letters of a matrix, whose columns are the voxel axes in the world; none if they are
/// nearly in one plane. The nearest rotation or reflection decides, as in nibabel, so that a
/// sheared matrix has three different axes too.
std::string nearestAxes(Matrix3 m) {
  constexpr double kFlat = 1e-6;  // Entries are floats, which are exact to 6e-8.
  for (std::size_t k = 0; k < 3; ++k) {
    const double length = norm({m[0][k], m[1][k], m[2][k]});
    if (length == 0) return {};
    for (auto& row : m) row[k] /= length;
  }
  // Newton's iteration m = (m + inverse transpose of m) / 2 halves the singular values until they
  // are near 1, which takes 20 steps at most, and then squares their distance to 1.
  for (int step = 0; step < 30; ++step) {
    const Matrix3 c = {cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])};  // cofactors
    const double det = dot(m[0], c[0]);
    if (!(std::abs(det) > kFlat)) return {};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) m[i][k] = (m[i][k] + c[i][k] / det) / 2;
    }
  }
  std::string axes;
  std::array<bool, 3> is_taken{};
  for (std::size_t k = 0; k < 3; ++k) {
    std::size_t direction = 3;
    for (std::size_t i = 0; i < 3; ++i) {
      if (is_taken[i]) continue;
      if (direction == 3 || std::abs(m[i][k]) > std::abs(m[direction][k])) direction = i;
    }
    is_taken[direction] = true;
    axes += kLetters[2 * direction + (m[direction][k] < 0 ? 1 : 0)];
  }
  return axes;
}

/// The header, of which `to_world` takes a track's points, which are millimetres along the voxel
/// axes from the corner of the first voxel on, to the world's right, front and up.
struct Header {
  std::uint64_t floats_per_point = 3;
  std::uint64_t floats_per_streamline = 0;
  std::uint64_t streamlines = 0;  // 0: the file does not tell

  std::array<double, 3> voxel_size{};
  std::array<double, 3> dimensions{};  ///< in voxels
  Matrix3 to_world = {
      {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< from voxels, of which whole numbers are centres
  Point origin{};

  // Voxel axis k of `to_world` is axis from[k] of the points, reversed if sign[k] is -1.
  std::array<std::size_t, 3> from = {0, 1, 2};
  std::array<int, 3> sign = {1, 1, 1};

  Point toWorld(const Point& point) const {
    Point voxel{};
    for (std::size_t k = 0; k < 3; ++k) {
      const double along = point[from[k]] / voxel_size[from[k]] - 0.5;
      voxel[k] = sign[k] < 0 ? dimensions[k] - 1 - along : along;
    }
    Point world{};
    for (std::size_t i = 0; i < 3; ++i) world[i] = dot(to_world[i], voxel) + origin[i];
    return world;
  }
};

template <typename T>
T numberAt(ByteReader& file, std::uint64_t at) {
  file.seek(at, "the header");
  return file.number<T>("the header");
}

template <typename T>
std::uint64_t countAt(ByteReader& file, std::uint64_t at, const char* what) {
  const T count = numberAt<T>(file, at);
  if (count < 0) file.refuse(at, "the number of ", what, " is ", count);
  return static_cast<std::uint64_t>(count);
}

/// Reads the letters of the axes, for example LPS.
std::string readVoxelOrder(ByteReader& file, ParsedFibers& parsed) {
  file.seek(kVoxelOrder, "the header");
  std::string letters(file.take(4, "the header"));
  letters.resize(letters.find_last_not_of(std::string_view(" \0", 2)) + 1);
  for (char& c : letters) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  if (letters.empty()) {
    letters = "LPS";
    parsed.warn("The header has no voxel order; LPS is assumed, TrackVis's default.");
  }
  bool is_order = letters.size() == 3;
  for (std::size_t line = 0; line < 3; ++line) {
    is_order = is_order && std::any_of(letters.begin(), letters.end(),
                                       [&](char letter) { return lineOf(letter) == line; });
  }
  if (!is_order) {
    file.refuse(kVoxelOrder, "the voxel order is '", ByteReader::shortened(letters),
                "'; give one letter each of R or L, A or P, and S or I");
  }
  return letters;
}

void readVoxToRas(ByteReader& file, std::int32_t version, Header& header, ParsedFibers& parsed) {
  std::array<double, 16> entries{};
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const std::uint64_t at = kVoxToRas + sizeof(float) * i;
    entries[i] = static_cast<double>(numberAt<float>(file, at));
    if (version != 1 && !std::isfinite(entries[i])) {
      file.refuse(at, "an entry of vox_to_ras is ", entries[i]);
    }
  }
  if (version == 1 || entries.back() == 0) {  // which tells that there is no matrix
    parsed.warn("The header has no vox_to_ras; the identity is assumed.");
    return;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    std::copy_n(&entries[4 * i], 3, header.to_world[i].begin());
    header.origin[i] = entries[4 * i + 3];
  }
}

void readSpace(ByteReader& file, std::int32_t version, Header& header, ParsedFibers& parsed) {
  for (std::size_t k = 0; k < 3; ++k) {
    header.dimensions[k] = numberAt<std::int16_t>(file, kDimensions + 2 * k);
    const std::uint64_t at = kVoxelSize + 4 * k;
    header.voxel_size[k] = static_cast<double>(numberAt<float>(file, at));
    if (!(header.voxel_size[k] > 0) || !std::isfinite(header.voxel_size[k])) {
      file.refuse(at, "a voxel size is ", header.voxel_size[k]);
    }
  }
  readVoxToRas(file, version, header, parsed);
  const std::string axes = nearestAxes(header.to_world);
  if (axes.empty()) file.refuse(kVoxToRas, "vox_to_ras is flat: its columns are not independent");
  const std::string points = readVoxelOrder(file, parsed);
  bool needs_dimensions = false;
  // This is nibabel's rule, also where axes are exchanged: what another program would make of such
  // a file is not known, and nibabel wrote most of them.
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t other = 0; other < 3; ++other) {
      if (lineOf(points[k]) != lineOf(axes[other])) continue;
      header.from[k] = other;
      header.sign[k] = points[k] == axes[other] ? 1 : -1;
    }
    needs_dimensions |= header.sign[k] < 0 && header.dimensions[k] <= 0;
  }
  if (needs_dimensions) {
    parsed.warn(
        "The header has no dimensions, which the voxel order needs; the fibers may be displaced.");
  }
}

Header readHeader(ByteReader& file, ParsedFibers& parsed) {
  if (file.take(5, "the header") != "TRACK") file.refuse(0, "the file does not start with TRACK");
  Header header;
  const auto has_order = [&](ByteOrder order) {
    file.setOrder(order);
    return numberAt<std::int32_t>(file, kSize) == kHeaderSize;
  };
  if (!has_order(ByteOrder::kLittle) && !has_order(ByteOrder::kBig)) {
    file.refuse(kSize, "the header's size is not 1000 in either byte order");
  }
  const auto version = numberAt<std::int32_t>(file, kVersion);
  if (version < 1 || version > 3) {
    file.refuse(kVersion, "version is ", version, "; supported are 1 and 2");
  }
  if (version == 3) parsed.warn("Version is 3; the file is read as one of version 2.");
  header.floats_per_point = 3 + countAt<std::int16_t>(file, kScalars, "scalars");
  header.floats_per_streamline = countAt<std::int16_t>(file, kProperties, "properties");
  header.streamlines = countAt<std::int32_t>(file, kStreamlines, "streamlines");
  readSpace(file, version, header, parsed);
  file.seek(kHeaderSize, "the header");
  return header;
}

/// Calls visit(points) at the points of each streamline, which are inside the file, and goes on to
/// the next one.
template <typename Visit>
void forStreamlines(ByteReader& file, const Header& header, Visit&& visit) {
  for (std::uint64_t i = 0; !file.atEnd() && (header.streamlines == 0 || i < header.streamlines);
       ++i) {
    const std::uint64_t at = file.offset();
    const auto count = file.number<std::int32_t>("a streamline");
    if (count < 0) file.refuse(at, "the number of points is ", count);
    const auto points = static_cast<std::uint64_t>(count);
    // The product has 31 and 16 bits.
    const std::uint64_t floats = points * header.floats_per_point + header.floats_per_streamline;
    if (floats > file.remaining() / sizeof(float)) {
      file.refuse(at, "a streamline of ", points, " points takes ", floats * sizeof(float),
                  " bytes, but ", file.remaining(), " follow");
    }
    const std::uint64_t end = file.offset() + floats * sizeof(float);
    visit(points);
    file.seek(end, "a streamline");
  }
}

Point readPoint(ByteReader& file, const Header& header) {
  const std::uint64_t at = file.offset();
  const Point world = header.toWorld(file.point());
  for (const double c : world) {
    // A double holds any product of floats, but what is beyond them is no place.
    if (std::abs(c) > static_cast<double>(std::numeric_limits<float>::max())) {
      file.refuse(at, "a coordinate is ", c, " by vox_to_ras");
    }
  }
  return world;
}

}  // namespace

ParsedFibers parseTrk(ByteReader& file, const FiberFileOptions&) {
  ParsedFibers parsed;
  parsed.is_float = true;
  const Header header = readHeader(file, parsed);
  std::uint64_t streamlines = 0, all_points = 0;
  ByteReader ahead = file;
  forStreamlines(ahead, header, [&](std::uint64_t points) {
    ++streamlines;
    all_points += points;
  });
  if (all_points == 0) file.refuse(kStreamlines, "there are no streamlines with points");
  parsed.reserve(all_points, streamlines);
  forStreamlines(file, header, [&](std::uint64_t points) {
    for (std::uint64_t i = 0; i < points; ++i) {
      parsed.fibers.points.push_back(readPoint(file, header));
      file.take(sizeof(float) * (header.floats_per_point - 3), "the scalars");
    }
    parsed.endFiber();
  });
  if (header.floats_per_point > 3) parsed.passed_over.push_back("scalars");
  if (header.floats_per_streamline > 0) parsed.passed_over.push_back("properties");
  if (header.streamlines == 0) {
    parsed.warn(
        "The header does not tell the number of streamlines, so a truncated file may pass for "
        "whole.");
  } else if (streamlines < header.streamlines) {
    parsed.warn("The header has ", header.streamlines, " streamlines, but the file has ",
                streamlines, "; it may be truncated.");
  }
  parsed.expectEnd(file);
  return parsed;
}

}  // namespace fcl_fibers::io
