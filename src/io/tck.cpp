// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdint>
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
  bool is_double = false;
  ByteOrder order = ByteOrder::kLittle;
  std::uint64_t points_offset = 0;
  std::string_view count;

  std::uint64_t pointSize() const { return is_double ? 24 : 12; }
};

std::string lowerCase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

void readDatatype(const ByteReader& file, std::uint64_t at, std::string_view value,
                  Header& header) {
  const std::string type = lowerCase(value);  // as MRtrix does
  const std::string_view number = std::string_view(type).substr(0, 7);
  const std::string_view order =
      std::string_view(type).substr(std::min<std::size_t>(7, type.size()));
  if ((number != "float32" && number != "float64") || (order != "le" && order != "be")) {
    file.refuse(at, "datatype is '", ByteReader::shortened(value),
                "'; supported are Float32LE, Float32BE, Float64LE and Float64BE");
  }
  header.is_double = number == "float64";
  header.order = order == "be" ? ByteOrder::kBig : ByteOrder::kLittle;
}

void readPlace(const ByteReader& file, std::uint64_t at, std::string_view value, Header& header) {
  if (takeWord(value) != ".")
    file.refuse(at, "the points are in another file; give it as '. OFFSET'");
  header.points_offset = file.parse<std::uint64_t>(trimmed(value));
}

// The points begin after the header that it returns, and inside the file.
Header readHeader(ByteReader& file) {
  file.setPlaces(ByteReader::Places::kLines);
  if (trimmed(file.line()) != "mrtrix tracks") {
    file.refuse(0, "the file does not start with 'mrtrix tracks'");
  }
  Header header;
  bool has_datatype = false, has_place = false, has_end = false;
  std::uint64_t place_at = 0;
  while (!has_end && !file.atEnd()) {
    const std::uint64_t at = file.offset();
    std::string_view line = trimmed(file.line());
    // Blanks may stand for the line feed between the last line and the points.
    if (has_place && header.points_offset > at && header.points_offset < file.offset()) {
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
    if ((has_datatype && key == "datatype") || (has_place && key == "file")) {
      file.refuse(at, "there is a second '", key, ":'");
    }
    if (key == "datatype") {
      readDatatype(file, at, value, header);
      has_datatype = true;
    } else if (key == "file") {
      readPlace(file, at, value, header);
      has_place = true;
      place_at = at;
    } else if (key == "count") {
      header.count = value;
    }
    has_end = line == "END";
  }
  if (!has_end) file.refuseEnd("the header, which has no line END");
  if (!has_datatype) file.refuse(file.offset(), "the header has no 'datatype:'");
  if (!has_place) file.refuse(file.offset(), "the header has no 'file:'");
  if (header.points_offset < file.offset()) {
    file.refuse(place_at, "points start at byte ", header.points_offset, ", inside the header of ",
                file.offset(), " bytes");
  }
  if (header.points_offset > file.size()) {
    file.refuse(place_at, "points start at byte ", header.points_offset, " of a file of ",
                file.size(), " bytes");
  }
  file.setPlaces(ByteReader::Places::kBytes);
  file.seek(header.points_offset, "the points");
  return header;
}

enum class Triplet { kPoint, kEndOfStreamline, kEndOfFile };

Triplet readTriplet(ByteReader& file, const Header& header, Point& point) {
  const std::uint64_t at = file.offset();
  for (double& c : point) {
    c = header.is_double ? file.number<double>("the points", header.order)
                         : static_cast<double>(file.number<float>("the points", header.order));
  }
  const auto all = [&](auto&& is) { return std::all_of(point.begin(), point.end(), is); };
  if (all([](double c) { return std::isfinite(c); })) return Triplet::kPoint;
  if (all([](double c) { return std::isnan(c); })) return Triplet::kEndOfStreamline;
  if (all([](double c) { return std::isinf(c); })) return Triplet::kEndOfFile;
  file.refuse(at, "a point is ", point[0], ' ', point[1], ' ', point[2]);
}

/// Makes room for all points and fibers at once, because growing vectors take three times as much.
void reserve(ByteReader file, const Header& header, FiberPolylines& scene) {
  std::size_t points = 0, streamlines = 1;  // The last one may lack its end.
  Point point;
  while (file.remaining() >= header.pointSize()) {
    const Triplet triplet = readTriplet(file, header, point);
    if (triplet == Triplet::kEndOfFile) break;
    ++(triplet == Triplet::kPoint ? points : streamlines);
  }
  scene.points.reserve(points);
  scene.point_begin.reserve(std::min(streamlines, points) + 1);
}

/// The number of streamlines, those without points included, is known only now.
void compareCount(const Header& header, std::uint64_t streamlines, ParsedFibers& parsed) {
  if (header.count.empty()) return;
  const std::optional<std::uint64_t> count = parsedNumber<std::uint64_t>(header.count);
  // MRtrix writes 0 where it does not know the number.
  if (count && (*count == 0 || *count == streamlines)) return;
  parsed.warnings.push_back("The header's count is '" + ByteReader::shortened(header.count) +
                            "', but the file has " + std::to_string(streamlines) +
                            " streamlines; it may be truncated.");
}

}  // namespace

ParsedFibers parseTck(ByteReader& file) {
  const Header header = readHeader(file);
  ParsedFibers parsed;
  parsed.is_float = !header.is_double;
  FiberPolylines& scene = parsed.fibers;
  reserve(file, header, scene);

  std::uint64_t streamlines = 0, empty = 0;
  const auto end_streamline = [&] {
    ++streamlines;
    if (scene.points.size() > scene.point_begin.back()) {
      parsed.endFiber();
    } else {
      ++empty;
    }
  };
  bool has_end = false;
  while (!has_end && file.remaining() >= header.pointSize()) {
    Point point;
    const Triplet triplet = readTriplet(file, header, point);
    if (triplet == Triplet::kPoint) scene.points.push_back(point);
    if (triplet == Triplet::kEndOfStreamline) end_streamline();
    has_end = triplet == Triplet::kEndOfFile;
  }
  if (scene.points.size() > scene.point_begin.back()) {
    end_streamline();
    if (has_end) parsed.warnings.push_back("The last streamline has no end; it may be truncated.");
  }
  if (scene.points.empty()) file.refuse(header.points_offset, "there are no streamlines");
  if (has_end) {
    expectEnd(file, parsed);
  } else {
    parsed.warnings.push_back("The file has no end mark; it may be truncated.");
  }
  warnOfEmptyFibers(empty, "streamline", parsed);
  compareCount(header, streamlines, parsed);
  return parsed;
}

}  // namespace fcl_fibers::io
