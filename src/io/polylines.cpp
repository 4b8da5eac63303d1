// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <string_view>

#include "io/formats.h"

namespace fcl_fibers::io {
namespace {

constexpr std::string_view kSpace = " \t";

/// Takes the next column off the line; empty if there is none.
std::string_view takeColumn(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(kSpace), line.size()));
  const std::string_view column = line.substr(0, line.find_first_of(kSpace));
  line.remove_prefix(column.size());
  return column;
}

/// Makes room for all points and fibers at once, because growing vectors take three times as much.
void reserve(const ByteReader& file, FiberPolylines& scene) {
  std::size_t points = 0, fibers = 0;
  bool is_inside = false;  // a fiber
  for (ByteReader lines = file; !lines.atEnd();) {
    std::string_view line = lines.line();
    const std::string_view column = takeColumn(line);
    if (!column.empty() && column.front() == '#') continue;
    fibers += !column.empty() && !is_inside ? 1 : 0;
    is_inside = !column.empty();
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
  reserve(file, scene);
  while (!file.atEnd()) {
    const std::uint64_t at = file.offset();
    std::string_view line = file.line();
    std::string_view column = takeColumn(line);
    if (column.empty()) {
      if (scene.points.size() > scene.point_begin.back()) parsed.endFiber();
      continue;
    }
    if (column.front() == '#') continue;
    Point point;
    for (std::size_t k = 0; k < 3; ++k) {
      if (column.empty()) file.refuse(at, "there are ", k, " columns; 3 are needed: x y z");
      point[k] = file.parse<double>(column);
      column = takeColumn(line);
    }
    scene.points.push_back(point);
  }
  if (scene.points.size() > scene.point_begin.back()) parsed.endFiber();
  if (scene.points.empty()) file.refuse(file.size(), "there are no points");
  expectLineEnd(file, parsed);
  return parsed;
}

}  // namespace fcl_fibers::io
