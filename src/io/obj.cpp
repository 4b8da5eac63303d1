// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/io/mesh_file.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/byte_reader.h"
#include "io/file_bytes.h"
#include "io/polygon.h"
#include "io/text.h"

namespace fcl_fibers::io {
namespace {

constexpr const char* kCall = "readMesh";
constexpr const char* kStatement = "a statement";

std::size_t lineEndSize(std::string_view text) {
  if (text.substr(0, 2) == "\r\n") return 2;
  return !text.empty() && (text[0] == '\n' || text[0] == '\r') ? 1 : 0;
}

/// Of a backslash that ends a line or the file, with the line's end.
std::size_t continuationSize(std::string_view text) {
  if (text.empty() || text[0] != '\\') return 0;
  const std::size_t end = lineEndSize(text.substr(1));
  return end > 0 || text.size() == 1 ? 1 + end : 0;
}

/// Takes the next word of a statement, which is empty if there is no other: the statement ends at
/// the end of its line, unless a backslash is there, or at a comment.
std::string_view takeWord(ByteReader& file) {
  const std::string_view text = file.bytes().substr(static_cast<std::size_t>(file.offset()));
  std::size_t begin = 0;
  for (;;) {
    begin = std::min(text.find_first_not_of(kSpace, begin), text.size());
    const std::size_t continuation = continuationSize(text.substr(begin));
    if (continuation == 0) break;
    begin += continuation;
  }
  std::size_t end = begin;
  for (;;) {
    end = std::min(text.find_first_of(" \t\r\n#\\", end), text.size());
    if (end == text.size() || text[end] != '\\' || continuationSize(text.substr(end)) > 0) break;
    ++end;
  }
  file.take(end, kStatement);
  return text.substr(begin, end - begin);
}

/// Calls read(file, keyword) at each statement. One that goes on in the next line is no other
/// keyword's, because names may end with a backslash.
template <typename Read>
void forStatements(ByteReader file, Read&& read) {
  while (!file.atEnd()) {
    read(file, takeWord(file));
    const std::size_t end = file.bytes().find_first_of("\r\n", file.offset());
    file.seek(std::min(end, file.bytes().size()), kStatement);
    file.take(lineEndSize(file.bytes().substr(file.offset(), 2)), kStatement);
  }
}

Point readPoint(ByteReader& file) {
  Point point;
  for (double& coordinate : point) {
    const std::string_view word = takeWord(file);
    if (word.empty()) file.refuse(file.offset(), "the point has fewer than three coordinates");
    coordinate = file.parse<double>(word);
  }
  return point;
}

std::size_t countTriangles(ByteReader& file) {
  const std::uint64_t at = file.offset();
  std::size_t corners = 0;
  while (!takeWord(file).empty()) ++corners;
  if (corners < 3) file.refuse(at, "the face has ", corners, " points; it needs 3");
  return corners - 2;
}

/// A number counts from 1, or if it is negative from the last point so far. `/` ends it.
std::int32_t pointOf(const ByteReader& file, std::string_view word, std::int64_t count,
                     std::int64_t before) {
  const std::string_view digits = word.substr(0, word.find('/'));
  const std::optional<std::int64_t> number = parsedNumber<std::int64_t>(digits);
  const std::uint64_t at = file.offsetOf(word);
  if (!number || *number == 0) {
    file.refuse(at, "'", ByteReader::shortened(digits),
                "' does not name a point; points count from 1");
  }
  if (*number > count) {
    file.refuse(at, "the face has point ", *number, ", and the file has ", count);
  }
  if (*number < -before) {
    file.refuse(at, "the face has point ", *number, ", and ", before, " are before it");
  }
  return static_cast<std::int32_t>(*number > 0 ? *number - 1 : *number + before);
}

}  // namespace

MeshFile parseMesh(std::string_view bytes, const std::string& name) {
  std::string room;
  ByteReader start(unpacked(ByteReader(bytes, name, kCall), room), name, kCall);
  startText(start);
  MeshFile mesh;
  // A face may come before its points.
  std::size_t triangles = 0;
  forStatements(start, [&](ByteReader& file, std::string_view keyword) {
    if (keyword == "v") {
      if (mesh.points.size() == std::numeric_limits<std::int32_t>::max()) {
        file.refuse(file.offset(), "there are more than 2^31 - 1 points; use several files");
      }
      mesh.points.push_back(readPoint(file));
    }
    if (keyword == "f") triangles += countTriangles(file);
  });
  if (triangles == 0) {
    start.refuse(start.size(), "there is no face; give a Wavefront OBJ file with faces");
  }
  mesh.triangles.reserve(3 * triangles);
  const auto count = static_cast<std::int64_t>(mesh.points.size());
  std::int64_t points_before = 0;
  std::vector<std::int32_t> face;
  forStatements(start, [&](ByteReader& file, std::string_view keyword) {
    if (keyword == "v") ++points_before;
    if (keyword != "f") return;
    const std::uint64_t at = file.offset();
    face.clear();
    for (auto word = takeWord(file); !word.empty(); word = takeWord(file)) {
      face.push_back(pointOf(file, word, count, points_before));
    }
    if (cutPolygon(mesh.points, face, mesh.triangles)) return;
    file.refuse(at,
                "the face crosses itself; bring its points into the order of its outline, or have "
                "the program that wrote the file cut its faces into triangles");
  });
  return mesh;
}

MeshFile readMesh(const std::string& path) { return parseMesh(readBytes(kCall, path), path); }

}  // namespace fcl_fibers::io
