// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "arguments.h"
#include "io/formats.h"
#include "io/text.h"

namespace fcl_fibers::io {
namespace {

/// Spreadsheets fill blank lines with separators.
bool isBlank(std::string_view line) {
  return line.find_first_not_of(" \t,;") == std::string_view::npos;
}

bool isComment(std::string_view line) { return trimmed(line).front() == '#'; }

/// Returns what separates the columns of a line: a comma or a semicolon, if its first column ends
/// at one, or else spaces and tabs. Thus decimal commas are refused rather than misread, and
/// columns after the third may be any text.
std::string_view separatorsOf(std::string_view line) {
  const std::size_t next = line.find_first_not_of(kSpace, line.find_first_of(" \t,;"));
  const bool is_separator = next != line.npos && (line[next] == ',' || line[next] == ';');
  return is_separator ? line.substr(next, 1) : kSpace;
}

/// @param line  without spaces around it, and so it remains
std::string_view takeColumn(std::string_view& line, std::string_view separators) {
  const std::size_t end = std::min(line.find_first_of(separators), line.size());
  const std::string_view column = trimmed(line.substr(0, end));
  line = trimmed(line.substr(std::min(end + 1, line.size())));
  return column;
}

/// Makes room for all points and fibers at once, because growing vectors take three times as much.
void reserve(const ByteReader& file, ParsedFibers& parsed) {
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
  parsed.reserve(points, std::min(fibers, points));
}

constexpr std::size_t kCoordinates = 3;

/// Returns the column that an option names, counted from 1, or 0 if it names none.
std::size_t columnOf(const char* option, const std::string& name) {
  if (name.empty()) return 0;
  const std::optional<std::size_t> column = parsedNumber<std::size_t>(name);
  if (!column || *column <= kCoordinates) {
    const std::string shown = "'" + ByteReader::shortened(name) + "'";
    refuseArgument("readFibers", option, shown, "for text give the number of a column, from 4 on");
  }
  return *column;
}

/// Texts that are no numbers are often of a few kinds, of which the error tells the remedy.
double readNumber(const ByteReader& file, std::string_view text, std::size_t column) {
  constexpr std::string_view kNumber = "+-.0123456789";
  const std::optional<double> value = parsedNumber<double>(text);
  if (value && std::isfinite(*value)) return *value;
  const char* remedy = "";
  if (value && std::isnan(*value)) {
    remedy = "; where a fiber ends, leave a line blank";
  } else if (text.find_first_of(" ,;\t") != text.npos) {
    remedy =
        "; separate columns by spaces, tabs, commas or semicolons, and write decimals with a point";
  } else if (column == 1 && !text.empty() && kNumber.find(text.front()) == kNumber.npos) {
    remedy = "; start headings and comments with #, and where a fiber ends, leave a line blank";
  }
  file.refuse(file.offsetOf(text), "'", ByteReader::shortened(text), "' is no finite number",
              remedy);
}

}  // namespace

ParsedFibers parsePolylines(ByteReader& file, const FiberFileOptions& options) {
  const std::size_t radius_column = columnOf("radius_from", options.radius_from);
  const std::size_t group_column = columnOf("groups_from", options.groups_from);
  const std::size_t last_column = std::max({kCoordinates, radius_column, group_column});
  startText(file);
  ParsedFibers parsed;
  reserve(file, parsed);
  std::vector<Point>& points = parsed.fibers.points;
  std::vector<double> radii;
  if (radius_column > 0) radii.reserve(points.capacity());
  if (group_column > 0) parsed.groups.numbers.reserve(parsed.fibers.point_begin.capacity());
  std::uint64_t further_lines = 0;  // which have columns after those that are read
  std::uint64_t first_further = 0;
  while (!file.atEnd()) {
    const std::uint64_t at = file.offset();
    std::string_view line = file.line();
    if (isBlank(line)) {
      if (parsed.isInFiber()) parsed.endFiber();
      continue;
    }
    if (isComment(line)) continue;
    line = trimmed(line);
    const std::string_view separators = separatorsOf(line);
    Point& point = points.emplace_back();
    for (std::size_t column = 1; column <= last_column; ++column) {
      if (line.empty() && column <= kCoordinates) {
        file.refuse(at, "there are ", column - 1, " columns; 3 are needed: x y z");
      }
      if (line.empty()) {
        const bool is_radius = column <= radius_column;
        file.refuse(at, "there are ", column - 1, " columns; ",
                    is_radius ? "radius_from is " : "groups_from is ",
                    is_radius ? radius_column : group_column);
      }
      const std::string_view text = takeColumn(line, separators);
      if (column <= kCoordinates) point[column - 1] = readNumber(file, text, column);
      if (column == radius_column) radii.push_back(readNumber(file, text, column));
      if (column == group_column) {
        parsed.groups.add(readNumber(file, text, column),
                          points.size() - 1 - parsed.fibers.point_begin.back());
      }
    }
    if (radius_column > 0 && radii.back() < 0) file.refuse(at, "the radius is ", radii.back());
    // What follows may be a comment.
    if (line.empty() || line.front() == '#') continue;
    if (further_lines++ == 0) first_further = at;
  }
  if (parsed.isInFiber()) parsed.endFiber();
  if (points.empty()) file.refuse(file.size(), "there are no points");
  if (radius_column > 0) parsed.setRadii(std::move(radii));
  // Radii may be among them, or the coordinates, if what was read as x is a number of the point.
  if (further_lines > 0) {
    const bool has_more = last_column > kCoordinates;
    parsed.warn("Columns after the ",
                !has_more                      ? "third"
                : last_column == radius_column ? "radius"
                                               : "group",
                " are passed over, in ", further_lines, further_lines == 1 ? " line" : " lines",
                " from line ", file.lineAt(first_further), " on; x, y and z are the first three",
                has_more ? "." : ", and radius_from 4 takes the radius from the fourth.");
  }
  parsed.expectLineEnd(file);
  return parsed;
}

}  // namespace fcl_fibers::io
