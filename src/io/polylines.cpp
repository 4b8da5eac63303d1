// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <string_view>

#include "io/formats.h"
#include "io/text.h"

namespace fcl_fibers::io {
namespace {

/// Spreadsheets fill blank lines with separators.
bool isBlank(std::string_view line) {
  return line.find_first_not_of(" \t,;") == std::string_view::npos;
}

bool isComment(std::string_view line) { return trimmed(line).front() == '#'; }

/// Splits a line at commas or at semicolons, if its first column ends at one, or else at spaces and
/// tabs. Thus decimal commas are refused rather than misread, and columns after the third may be
/// any text.
class Columns {
 public:
  explicit Columns(std::string_view line) : rest_(trimmed(line)) {
    const std::size_t next = rest_.find_first_not_of(kSpace, rest_.find_first_of(" \t,;"));
    if (next != rest_.npos && (rest_[next] == ',' || rest_[next] == ';')) {
      separators_ = rest_.substr(next, 1);
    }
  }

  bool empty() const { return rest_.empty(); }

  std::string_view take() {
    const std::size_t end = std::min(rest_.find_first_of(separators_), rest_.size());
    const std::string_view column = trimmed(rest_.substr(0, end));
    rest_ = trimmed(rest_.substr(std::min(end + 1, rest_.size())));
    return column;
  }

 private:
  std::string_view rest_;
  std::string_view separators_ = kSpace;
};

/// Makes room for all points and fibers at once, because growing vectors take three times as much.
void reserve(const ByteReader& file, FiberPolylines& scene) {
  std::size_t points = 0, fibers = 0;
  bool is_inside = false;  // a fiber
  for (ByteReader lines = file; !lines.atEnd();) {
    const std::string_view line = lines.line();
    const bool is_blank = isBlank(line);
    if (!is_blank && isComment(line)) continue;
    fibers += !is_blank && !is_inside ? 1 : 0;
    is_inside = !is_blank;
    points += is_inside ? 1 : 0;
  }
  // A point takes at least "0 0 0" and the end of its line. Shorter lines will be refused.
  points = std::min<std::size_t>(points, (file.bytes().size() + 1) / 6);
  scene.points.reserve(points);
  scene.point_begin.reserve(std::min(fibers, points) + 1);
}

}  // namespace

ParsedFibers parsePolylines(ByteReader& file) {
  file.setPlaces(ByteReader::Places::kLines);
  ParsedFibers parsed;
  FiberPolylines& scene = parsed.fibers;
  skipByteOrderMark(file);
  reserve(file, scene);
  while (!file.atEnd()) {
    const std::uint64_t at = file.offset();
    const std::string_view line = file.line();
    if (isBlank(line)) {
      if (scene.points.size() > scene.point_begin.back()) parsed.endFiber();
      continue;
    }
    if (isComment(line)) continue;
    Columns columns(line);
    Point point;
    for (std::size_t k = 0; k < 3; ++k) {
      if (columns.empty()) file.refuse(at, "there are ", k, " columns; 3 are needed: x y z");
      point[k] = file.parse<double>(columns.take());
    }
    scene.points.push_back(point);
  }
  if (scene.points.size() > scene.point_begin.back()) parsed.endFiber();
  if (scene.points.empty()) file.refuse(file.size(), "there are no points");
  expectLineEnd(file, parsed);
  return parsed;
}

}  // namespace fcl_fibers::io
