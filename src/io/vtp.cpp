// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/formats.h"
#include "io/vtp_file.h"

namespace fcl_fibers::io {
namespace {

bool isOfCells(const pugi::xml_node& array) {
  return array.parent().name() == std::string_view("CellData");
}

/// Whether an array has no name, or one that exportFibers() or exportSegments() writes, which tells
/// no more than the lines do.
bool isOwn(const pugi::xml_node& array) {
  const std::string_view name = array.attribute("Name").value();
  return name.empty() || name == "fiber" || name == "number" || name == "touching";
}

/// Adds the names of arrays of points and cells, of a few of them.
/// @param radii_only  of those that could be radii
void addNames(const pugi::xml_node& piece, const pugi::xml_node& without, bool radii_only,
              std::vector<std::string>& names) {
  constexpr std::size_t kMost = 8;
  for (const char* const data : {"PointData", "CellData"}) {
    for (const pugi::xml_node array : piece.child(data).children("DataArray")) {
      const std::string_view components = array.attribute("NumberOfComponents").value();
      const bool is_one = components.empty() || components == "1";
      const bool is_number = array.attribute("type").value() != std::string_view("String");
      if (names.size() > kMost) return;
      if (array == without || isOwn(array) || (radii_only && !(is_one && is_number))) continue;
      std::string name = joinedText(isOfCells(array) ? "cell" : "point", " data '",
                                    ByteReader::shortened(array.attribute("Name").value()), "'");
      if (std::find(names.begin(), names.end(), name) != names.end()) continue;
      names.push_back(names.size() == kMost ? "others" : std::move(name));
    }
  }
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

class VtpParser {
 public:
  VtpParser(const ByteReader& file, const FiberFileOptions& options)
      : file_(file), options_(options) {}

  ParsedFibers parse() {
    // The ends are read first, because they tell how much room all points need.
    const auto pieces = file_.child(file_.root(), "PolyData").children("Piece");
    for (const pugi::xml_node piece : pieces) readEnds(piece);
    FiberPolylines& scene = parsed_.fibers;
    if (scene.point_begin.back() == 0) file_.refuse(file_.root(), "there are no lines with points");
    scene.points.reserve(file_.believable(scene.point_begin.back(), 1));
    for (const pugi::xml_node piece : pieces) readPoints(piece);
    if (!radii_.empty()) {
      if (radii_.size() != scene.points.size()) {
        file_.refuse(file_.root(), "some pieces have point data 'radius', and some have none");
      }
      parsed_.setRadii(std::move(radii_));
    } else if (!options_.radius && !other_radii_.empty()) {
      parsed_.warn(
          "There is no point data 'radius'; radius_from takes the radii from another array. "
          "There are: ",
          listed(other_radii_), ".");
    }
    return std::move(parsed_);
  }

 private:
  /// Reads where the lines of a piece end in the list of their points.
  void readEnds(const pugi::xml_node& piece) {
    const std::uint64_t line_count = file_.count(piece, "NumberOfLines");
    if (line_count == 0) return;
    const pugi::xml_node array = file_.namedArray(file_.child(piece, "Lines"), "offsets");
    std::vector<std::size_t>& begin = parsed_.fibers.point_begin;
    const std::size_t first = begin.back();
    std::vector<std::size_t>& ends = ends_.emplace_back();
    ends.reserve(file_.believable(line_count, 1));
    std::uint64_t read = 0;
    std::int64_t previous = 0;
    file_.readNumbers<std::int64_t>(array, [&](std::int64_t end) {
      if (end < previous) file_.refuse(array, "the numbers do not ascend from 0 on");
      if (read++ < line_count) {
        ends.push_back(static_cast<std::size_t>(end));
        begin.push_back(first + ends.back());
      }
      previous = end;
    });
    if (read != line_count) {
      file_.refuse(array, "there are ", read, " numbers, but NumberOfLines is ", line_count);
    }
  }

  /// Reads the points of a piece's lines, after all ends have been read.
  void readPoints(const pugi::xml_node& piece) {
    const std::uint64_t line_count = file_.count(piece, "NumberOfLines");
    if (line_count == 0) return;
    const std::vector<Point> points = readPointArray(piece);
    const pugi::xml_node radius = findRadii(piece);
    addNames(piece, radius, false, parsed_.passed_over);
    if (!radius) addNames(piece, radius, true, other_radii_);
    const std::vector<double> radii = readRadii(piece, radius, points.size(), line_count);

    FiberPolylines& scene = parsed_.fibers;
    if (radius) radii_.reserve(scene.points.capacity());
    const std::vector<std::size_t>& ends = ends_[pieces_read_++];
    const std::size_t expected = ends.back();
    const pugi::xml_node lines = file_.child(piece, "Lines");
    const pugi::xml_node array = file_.namedArray(lines, "connectivity");
    std::size_t read = 0, line = 0;
    file_.readNumbers<std::int64_t>(array, [&](std::int64_t index) {
      if (index < 0 || static_cast<std::uint64_t>(index) >= points.size()) {
        file_.refuse(array, "a line has point ", index, " of ", points.size());
      }
      if (read++ >= expected) return;
      while (ends[line] < read) ++line;
      // Points without a line may be anything.
      const auto i = static_cast<std::size_t>(index);
      for (const double c : points[i]) {
        if (!std::isfinite(c)) {
          file_.refuse(pointArray(piece), "point ", i, " is ", points[i][0], ' ', points[i][1], ' ',
                       points[i][2]);
        }
      }
      scene.points.push_back(points[i]);
      if (!radius) return;
      const double r = radii[isOfCells(radius) ? line : i];
      if (!(r >= 0) || !std::isfinite(r)) file_.refuse(radius, "a radius is ", r);
      radii_.push_back(r);
    });
    if (read != expected) {
      file_.refuse(file_.namedArray(lines, "offsets"), "the last number is ", expected,
                   ", but the lines have ", read, " points");
    }
  }

  pugi::xml_node pointArray(const pugi::xml_node& piece) const {
    return file_.child(file_.child(piece, "Points"), "DataArray");
  }

  std::vector<Point> readPointArray(const pugi::xml_node& piece) {
    const pugi::xml_node array = pointArray(piece);
    if (file_.count(array, "NumberOfComponents") != 3) {
      file_.refuse(array, "NumberOfComponents is not 3");
    }
    const std::uint64_t point_count = file_.count(piece, "NumberOfPoints");
    std::vector<Point> points;
    points.reserve(file_.believable(point_count, 3));
    std::uint64_t read = 0;
    file_.readNumbers<double>(array, [&](double coordinate) {
      const std::size_t k = read++ % 3;
      if (k == 0 && points.size() < point_count) points.emplace_back();
      if (read <= 3 * points.size()) points.back()[k] = coordinate;
    });
    if (read % 3 != 0 || read / 3 != point_count) {
      file_.refuse(array, "there are ", read, " numbers, but NumberOfPoints is ", point_count);
    }
    parsed_.is_float |= array.attribute("type").value() == std::string_view("Float32");
    return points;
  }

  /// The array with the radii of a piece, if it has them.
  pugi::xml_node findRadii(const pugi::xml_node& piece) const {
    const auto named = [&](const char* data, const char* name) {
      return piece.child(data).find_child_by_attribute("DataArray", "Name", name);
    };
    if (options_.radius_from.empty()) return named("PointData", "radius");
    const char* const name = options_.radius_from.c_str();
    if (const pugi::xml_node array = named("PointData", name)) return array;
    if (const pugi::xml_node array = named("CellData", name)) return array;
    std::vector<std::string> names;
    addNames(piece, {}, true, names);
    file_.refuse(piece, "there is no array '", ByteReader::shortened(name),
                 "', which radius_from names; ",
                 names.empty() ? "points and cells have no data" : "there are: ", listed(names));
  }

  /// Reads the radii by point or by line; empty if there are none.
  std::vector<double> readRadii(const pugi::xml_node& piece, const pugi::xml_node& radius,
                                std::uint64_t point_count, std::uint64_t line_count) {
    std::vector<double> radii;
    if (!radius) return radii;
    const bool of_cells = isOfCells(radius);
    const auto cells = [&](const char* name) {
      return of_cells && piece.attribute(name) ? file_.count(piece, name) : 0;
    };
    // In the data of cells, lines follow vertices.
    const std::uint64_t begin = cells("NumberOfVerts"), kept = of_cells ? line_count : point_count;
    const std::uint64_t expected = begin + kept + cells("NumberOfStrips") + cells("NumberOfPolys");
    radii.reserve(static_cast<std::size_t>(kept));
    std::uint64_t read = 0;
    file_.readScalars(radius, [&](double number) {
      if (read >= begin && radii.size() < kept) radii.push_back(number);
      ++read;
    });
    if (read != expected || radii.size() != kept) {
      file_.refuse(radius, "there are ", read, " numbers, but ", expected,
                   of_cells ? " cells" : " points");
    }
    return radii;
  }

  vtp::VtpFile file_;
  const FiberFileOptions& options_;
  ParsedFibers parsed_;
  std::vector<double> radii_;                   ///< by point of the scene, if a piece has them
  std::vector<std::vector<std::size_t>> ends_;  ///< of lines, by piece that has any
  std::size_t pieces_read_ = 0;                 ///< of those
  std::vector<std::string> other_radii_;        ///< names of arrays that could be radii
};

}  // namespace

ParsedFibers parseVtp(ByteReader& file, const FiberFileOptions& options) {
  return VtpParser(file, options).parse();
}

}  // namespace fcl_fibers::io
