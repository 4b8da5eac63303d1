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
#include "io/point_radii.h"
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
  std::string_view rest() const { return rest_; }

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

constexpr std::size_t kCoordinates = 3;

/// Returns the column of the radius, counted from 1, or 0 if there is none.
std::size_t radiusColumn(const FiberFileOptions& options) {
  if (options.radius_from.empty()) return 0;
  const std::optional<std::size_t> column = parsedNumber<std::size_t>(options.radius_from);
  if (!column || *column <= kCoordinates) {
    const std::string shown = "'" + ByteReader::shortened(options.radius_from) + "'";
    refuseArgument("readFibers", "radius_from", shown,
                   "for text give the number of a column, from 4 on");
  }
  return *column;
}

class PolylinesParser {
 public:
  PolylinesParser(ByteReader& file, const FiberFileOptions& options)
      : file_(file), radius_column_(radiusColumn(options)) {}

  ParsedFibers parse() {
    startText(file_);
    FiberPolylines& scene = parsed_.fibers;
    reserve(file_, scene);
    if (radius_column_ > 0) radii_.reserve(scene.points.capacity());
    while (!file_.atEnd()) {
      const std::uint64_t at = file_.offset();
      const std::string_view line = file_.line();
      if (isBlank(line)) {
        if (scene.points.size() > scene.point_begin.back()) parsed_.endFiber();
      } else if (!isComment(line)) {
        readPoint(at, Columns(line));
      }
    }
    if (scene.points.size() > scene.point_begin.back()) parsed_.endFiber();
    if (scene.points.empty()) file_.refuse(file_.size(), "there are no points");
    if (radius_column_ > 0) {
      setPointRadii(scene, std::move(radii_));
      parsed_.holds_radii = true;
    }
    warnOfFurtherColumns();
    parsed_.expectLineEnd(file_);
    return std::move(parsed_);
  }

 private:
  void readPoint(std::uint64_t at, Columns columns) {
    Point point;
    for (std::size_t k = 0; k < kCoordinates; ++k) {
      if (columns.empty()) file_.refuse(at, "there are ", k, " columns; 3 are needed: x y z");
      point[k] = number(columns.take(), k);
    }
    parsed_.fibers.points.push_back(point);
    if (radius_column_ > 0) readRadius(at, columns);
    // What follows may be a comment.
    if (columns.empty() || columns.rest().front() == '#') return;
    if (further_columns_++ == 0) first_further_ = at;
  }

  void readRadius(std::uint64_t at, Columns& columns) {
    for (std::size_t column = kCoordinates + 1;; ++column) {
      if (columns.empty()) {
        file_.refuse(at, "there are ", column - 1, " columns; radius_from is ", radius_column_);
      }
      const std::string_view text = columns.take();
      if (column < radius_column_) continue;
      radii_.push_back(number(text, column));
      if (radii_.back() < 0) file_.refuse(at, "the radius is ", radii_.back());
      return;
    }
  }

  /// Texts that are no numbers are often of a few kinds, of which the error tells the remedy.
  double number(std::string_view text, std::size_t column) const {
    const std::optional<double> value = parsedNumber<double>(text);
    if (value && std::isfinite(*value)) return *value;
    const char* remedy = "";
    if (value && std::isnan(*value)) {
      remedy = "; where a fiber ends, leave a line blank";
    } else if (text.find_first_of(" ,;\t") != text.npos) {
      remedy =
          "; separate columns by spaces, tabs, commas or semicolons, and write decimals with a "
          "point";
    } else if (column == 0 && !text.empty() && kNumber.find(text.front()) == kNumber.npos) {
      remedy = "; start headings and comments with #, and where a fiber ends, leave a line blank";
    }
    file_.refuse(file_.offsetOf(text), "'", ByteReader::shortened(text), "' is no finite number",
                 remedy);
  }

  /// Radii may be among them, or the coordinates, if what was read as x is a number of the point.
  void warnOfFurtherColumns() {
    if (further_columns_ == 0) return;
    parsed_.warnings.push_back(joinedText(
        "Columns after the ", radius_column_ > 0 ? "radius" : "third", " are passed over, in ",
        further_columns_, further_columns_ == 1 ? " line" : " lines", " from line ",
        file_.lineAt(first_further_), " on; x, y and z are the first three",
        radius_column_ > 0 ? "." : ", and radius_from 4 takes the radius from the fourth."));
  }

  static constexpr std::string_view kNumber = "+-.0123456789";

  ByteReader& file_;
  const std::size_t radius_column_;  ///< counted from 1; 0: there is none
  ParsedFibers parsed_;
  std::vector<double> radii_;          ///< by point, if there is a column of them
  std::uint64_t further_columns_ = 0;  ///< lines that have columns after those that are read
  std::uint64_t first_further_ = 0;    ///< where the first of them is
};

}  // namespace

ParsedFibers parsePolylines(ByteReader& file, const FiberFileOptions& options) {
  return PolylinesParser(file, options).parse();
}

}  // namespace fcl_fibers::io
