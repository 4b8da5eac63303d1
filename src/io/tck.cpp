// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>

#include "io/formats.h"
#include "io/text.h"

namespace fcl_fibers::io {
namespace {

// The format, from https://mrtrix.readthedocs.io/en/latest/getting_started/image_data.html: lines
// of text, then points of three numbers each.
//
//     mrtrix tracks
//     datatype: Float32LE
//     count: 0000000123         may be absent or 0
//     file: . 67                where the points begin in this file
//     END
//
// Three NaN end a streamline, three infinite numbers end the file.
struct Header {
  std::uint64_t number_size = 0;
  std::uint64_t points_offset = 0;
  std::string_view count;
};

/// Sets the byte order of the file, and returns the size of its numbers.
std::uint64_t readDatatype(ByteReader& file, std::uint64_t at, std::string_view value) {
  constexpr std::string_view kTypes[] = {"float32le", "float32be", "float64le", "float64be"};
  const auto* const type =
      std::find(std::begin(kTypes), std::end(kTypes), lowerCase(std::string(value)));  // as MRtrix
  if (type == std::end(kTypes)) {
    file.refuse(at, "datatype is '", ByteReader::shortened(value),
                "'; supported are Float32LE, Float32BE, Float64LE and Float64BE");
  }
  file.setOrder((type - kTypes) % 2 == 1 ? ByteOrder::kBig : ByteOrder::kLittle);
  return type - kTypes < 2 ? 4 : 8;
}

// The points begin after the header that it returns, and inside the file.
Header readHeader(ByteReader& file) {
  file.setInLines(true);
  if (trimmed(file.line()) != "mrtrix tracks") {
    file.refuse(0, "the file does not start with 'mrtrix tracks'");
  }
  Header header;
  std::optional<std::uint64_t> place_at;
  bool has_end = false;
  while (!has_end && !file.atEnd()) {
    const std::uint64_t at = file.offset();
    std::string_view line = trimmed(file.line());
    // Blanks may stand for the line feed between the last line and the points.
    if (place_at && header.points_offset > at && header.points_offset < file.offset()) {
      const auto before_points = static_cast<std::size_t>(header.points_offset - at);
      const std::string_view last = trimmed(file.bytes().substr(at, before_points));
      if (line != "END" && last == "END") {
        line = last;
        file.seek(header.points_offset, "the points");
      }
    }
    const std::size_t colon = std::min(line.find(':'), line.size());
    const std::string_view key = trimmed(line.substr(0, colon));
    const std::string_view value = trimmed(line.substr(std::min(colon + 1, line.size())));
    // Two of them would leave open which counts.
    if ((header.number_size > 0 && key == "datatype") || (place_at && key == "file")) {
      file.refuse(at, "there is a second '", key, ":'");
    }
    if (key == "datatype") {
      header.number_size = readDatatype(file, at, value);
    } else if (key == "file") {
      std::string_view rest = value;
      if (takeWord(rest) != ".") {
        file.refuse(at, "the points are in another file; give it as '. OFFSET'");
      }
      header.points_offset = file.parse<std::uint64_t>(trimmed(rest));
      place_at = at;
    } else if (key == "count") {
      header.count = value;
    }
    has_end = line == "END";
  }
  if (!has_end) file.refuseEnd("the header, which has no line END");
  if (header.number_size == 0) file.refuse(file.offset(), "the header has no 'datatype:'");
  if (!place_at) file.refuse(file.offset(), "the header has no 'file:'");
  file.seekPoints(header.points_offset, file.offset(), *place_at);
  file.setInLines(false);
  return header;
}

enum class Triplet { kPoint, kEndOfStreamline, kEndOfFile };

Triplet readTriplet(ByteReader& file, const Header& header, Point& point) {
  const std::uint64_t at = file.offset();
  for (double& c : point) {
    c = header.number_size == 8 ? file.number<double>("the points")
                                : static_cast<double>(file.number<float>("the points"));
  }
  const auto all = [&](auto&& is) { return std::all_of(point.begin(), point.end(), is); };
  if (all([](double c) { return std::isfinite(c); })) return Triplet::kPoint;
  if (all([](double c) { return std::isnan(c); })) return Triplet::kEndOfStreamline;
  if (all([](double c) { return std::isinf(c); })) return Triplet::kEndOfFile;
  file.refuse(at, "a point is ", point[0], ' ', point[1], ' ', point[2]);
}

/// Calls visit(triplet, point) until the file ends, by its mark or without it.
template <typename Visit>
void forTriplets(ByteReader& file, const Header& header, Visit&& visit) {
  Triplet triplet = Triplet::kPoint;
  for (Point point; triplet != Triplet::kEndOfFile && file.remaining() >= 3 * header.number_size;) {
    triplet = readTriplet(file, header, point);
    visit(triplet, point);
  }
}

}  // namespace

ParsedFibers parseTck(ByteReader& file, const FiberFileOptions&) {
  const Header header = readHeader(file);
  ParsedFibers parsed;
  parsed.is_float = header.number_size == 4;
  FiberPolylines& scene = parsed.fibers;
  std::uint64_t counts[3] = {0, 1, 0};  // by triplet; the last streamline may lack its end
  ByteReader ahead = file;
  forTriplets(ahead, header,
              [&](Triplet triplet, const Point&) { ++counts[static_cast<std::size_t>(triplet)]; });
  parsed.reserve(counts[0], counts[1]);

  bool has_end = false;
  forTriplets(file, header, [&](Triplet triplet, const Point& point) {
    if (triplet == Triplet::kPoint) scene.points.push_back(point);
    if (triplet == Triplet::kEndOfStreamline) parsed.endFiber();
    has_end = triplet == Triplet::kEndOfFile;
  });
  if (parsed.isInFiber()) {
    parsed.endFiber();
    if (has_end) parsed.warn("The last streamline has no end; it may be truncated.");
  }
  if (scene.points.empty()) file.refuse(header.points_offset, "there are no streamlines");
  if (has_end) {
    parsed.expectEnd(file);
  } else {
    parsed.warn("The file has no end mark; it may be truncated.");
  }
  const std::size_t streamlines = scene.fiberCount();
  // MRtrix counts those without points, and writes 0 where it does not know the number.
  const auto count = parsedNumber<std::uint64_t>(header.count);
  if (!header.count.empty() && (!count || (*count != 0 && *count != streamlines))) {
    parsed.warn("The header's count is '", ByteReader::shortened(header.count),
                "', but the file has ", streamlines, " streamlines; it may be truncated.");
  }
  return parsed;
}

}  // namespace fcl_fibers::io
