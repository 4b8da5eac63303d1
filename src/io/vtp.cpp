// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
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
/// no more than the lines do, or that is read.
bool isOwn(const pugi::xml_node& array) {
  const std::string_view name = array.attribute("Name").value();
  for (const std::string_view own : {"", "fiber", "number", "touching", vtp::kStartsAt,
                                     vtp::kEndsAt, vtp::kSample, vtp::kType}) {
    if (name == own) return true;
  }
  return false;
}

/// Adds the names of arrays of points and cells, of a few of them.
/// @param without  arrays that are read
/// @param numbers_only  of those that have one number each, such as radii
void addNames(const pugi::xml_node& piece, const std::vector<pugi::xml_node>& without,
              bool numbers_only, std::vector<std::string>& names) {
  constexpr std::size_t kMost = 8;
  for (const char* const data : {"PointData", "CellData"}) {
    for (const pugi::xml_node array : piece.child(data).children("DataArray")) {
      const std::string_view components = array.attribute("NumberOfComponents").value();
      const bool is_one = components.empty() || components == "1";
      const bool is_number = array.attribute("type").value() != std::string_view("String");
      if (names.size() > kMost) return;
      const bool is_read = std::find(without.begin(), without.end(), array) != without.end();
      if (is_read || isOwn(array) || (numbers_only && !(is_one && is_number))) continue;
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

constexpr std::int32_t kNone = -1, kNowhere = -2;

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
    scene.samples = byPoint(std::move(samples_));
    scene.types = byPoint(std::move(types_));
    if (const char* const misfit = findBranches()) {
      parsed_.warn("Cell data '", misfit, "' does not fit the points, perhaps because a filter ",
                   "renumbered them; fibers branch only where their lines share a point, so merge ",
                   "points at the same place, as ParaView's Clean does, or read the file from ",
                   "before the filter.");
      starts_at_ = ends_at_ = {};
      findBranches();
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
    const pugi::xml_node radius = options_.radius_from.empty()
                                      ? named(piece, "PointData", "radius")
                                      : find(piece, "radius_from", options_.radius_from);
    const pugi::xml_node group = options_.groups_from.empty()
                                     ? pugi::xml_node()
                                     : find(piece, "groups_from", options_.groups_from);
    addNames(piece, {radius, group}, false, parsed_.passed_over);
    if (!radius) addNames(piece, {group}, true, other_radii_);
    const auto radii = readData<double>(piece, radius, points.size(), line_count);
    const auto groups = readData<double>(piece, group, points.size(), line_count);
    // Pieces before may have none.
    const auto add = [&](const char* data, const char* name, std::size_t before,
                         std::vector<std::int64_t>& all) {
      const auto numbers =
          readData<std::int64_t>(piece, named(piece, data, name), points.size(), line_count);
      if (!numbers.empty()) all.resize(before, kNone);
      all.insert(all.end(), numbers.begin(), numbers.end());
    };
    add("PointData", vtp::kSample, id_count_, samples_);
    add("PointData", vtp::kType, id_count_, types_);
    const auto addNamedPoints = [&](const char* name, std::vector<std::int64_t>& all) {
      add("CellData", name, lines_read_, all);
      for (std::size_t i = lines_read_; i < all.size(); ++i) {
        if (all[i] >= static_cast<std::int64_t>(points.size())) all[i] = kNowhere;
        if (all[i] >= 0) all[i] += static_cast<std::int64_t>(id_count_);
      }
    };
    addNamedPoints(vtp::kStartsAt, starts_at_);
    addNamedPoints(vtp::kEndsAt, ends_at_);
    lines_read_ += static_cast<std::size_t>(line_count);

    FiberPolylines& scene = parsed_.fibers;
    ids_.reserve(scene.points.capacity());
    if (radius) radii_.reserve(scene.points.capacity());
    if (group) parsed_.groups.numbers.reserve(scene.fiberCount());
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
      ids_.push_back(id_count_ + i);
      if (group) {
        const double number = groups[isOfCells(group) ? line : i];
        if (!std::isfinite(number)) file_.refuse(group, "the number of a group is ", number);
        parsed_.groups.add(number, read - 1 - (line > 0 ? ends[line - 1] : 0));
      }
      if (!radius) return;
      const double r = radii[isOfCells(radius) ? line : i];
      if (!(r >= 0) || !std::isfinite(r)) file_.refuse(radius, "a radius is ", r);
      radii_.push_back(r);
    });
    if (read != expected) {
      file_.refuse(file_.namedArray(lines, "offsets"), "the last number is ", expected,
                   ", but the lines have ", read, " points");
    }
    id_count_ += points.size();
  }

  /// Returns the numbers of points of the file by point of the scene; empty if there are none.
  std::vector<std::int64_t> byPoint(std::vector<std::int64_t> of_file) const {
    std::vector<std::int64_t> numbers;
    if (of_file.empty()) return numbers;
    of_file.resize(id_count_, kNone);
    numbers.reserve(ids_.size());
    for (const std::size_t id : ids_) numbers.push_back(of_file[id]);
    return numbers;
  }

  /// A fiber starts or ends at another one where its arrays name a point of that, or where its line
  /// begins or ends with a point of another line. Of the lines that share a point, the one inside
  /// of which it is has it, or else the first one that ends there, or else that begins there.
  /// Returns the name of an array that does not fit, of which nothing is taken then: it names a
  /// point of no line or at another place, or the fiber's own end. Null if all fit.
  const char* findBranches() {
    FiberPolylines& scene = parsed_.fibers;
    const bool are_named = !starts_at_.empty() || !ends_at_.empty();
    const bool share =
        std::adjacent_find(ids_.begin(), ids_.end(), std::greater_equal<>()) != ids_.end();
    constexpr auto kMost = static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max());
    if ((!share && !are_named) || ids_.size() > kMost) return nullptr;
    const auto forFibers = [&](auto&& visit) {
      for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
        const std::size_t begin = scene.point_begin[f], end = scene.point_begin[f + 1];
        if (begin == end) continue;
        const bool closes = end - begin > 3 && ids_[begin] == ids_[end - 1];
        visit(f, begin, end - 1, closes);
      }
    };
    std::vector<std::int32_t> owners(id_count_ + 1, kNone);  // the last one is that of no point
    const auto own = [&](std::size_t i) {
      std::int32_t& owner = owners[ids_[i]];
      if (owner == kNone) owner = static_cast<std::int32_t>(i);
    };
    forFibers([&](std::size_t, std::size_t first, std::size_t last, bool) {
      for (std::size_t i = first + 1; i < last; ++i) own(i);
    });
    // A curve that closes ends at its seam, which is one point of it.
    forFibers([&](std::size_t, std::size_t first, std::size_t last, bool closes) {
      own(closes ? first : last);
    });
    forFibers([&](std::size_t, std::size_t first, std::size_t, bool) { own(first); });

    const char* misfit = nullptr;
    const auto find = [&](const char* name, std::vector<std::int64_t>& named, bool are_starts) {
      std::vector<std::int32_t> found(scene.fiberCount(), kNone);
      named.resize(found.size(), kNone);
      forFibers([&](std::size_t f, std::size_t first, std::size_t last, bool closes) {
        const std::size_t i = are_starts ? first : last;
        if (are_named ? named[f] == kNone : closes && !are_starts) return;
        const auto id = are_named ? static_cast<std::size_t>(named[f]) : ids_[i];
        const std::int32_t at = owners[std::min(id, id_count_)];
        if (at != kNone && at != static_cast<std::int32_t>(i) &&
            scene.points[static_cast<std::size_t>(at)] == scene.points[i]) {
          found[f] = at;
        } else if (are_named) {
          misfit = name;
        }
      });
      if (std::count(found.begin(), found.end(), kNone) == std::ptrdiff_t(found.size())) found = {};
      return found;
    };
    auto starts_at = find(vtp::kStartsAt, starts_at_, true);
    auto ends_at = find(vtp::kEndsAt, ends_at_, false);
    if (misfit == nullptr) {
      scene.starts_at = std::move(starts_at);
      scene.ends_at = std::move(ends_at);
    }
    return misfit;
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

  static pugi::xml_node named(const pugi::xml_node& piece, const char* data, const char* name) {
    return piece.child(data).find_child_by_attribute("DataArray", "Name", name);
  }

  /// The array of a piece that an option names.
  pugi::xml_node find(const pugi::xml_node& piece, const char* option,
                      const std::string& name) const {
    for (const char* const data : {"PointData", "CellData"}) {
      if (const pugi::xml_node array = named(piece, data, name.c_str())) return array;
    }
    std::vector<std::string> names;
    addNames(piece, {}, true, names);
    file_.refuse(piece, "there is no array '", ByteReader::shortened(name), "', which ", option,
                 " names; ",
                 names.empty() ? "points and cells have no data" : "there are: ", listed(names));
  }

  /// Reads numbers by point or by line, which are indices or of any type; empty without an array.
  template <typename Number>
  std::vector<Number> readData(const pugi::xml_node& piece, const pugi::xml_node& array,
                               std::uint64_t point_count, std::uint64_t line_count) {
    std::vector<Number> numbers;
    if (!array) return numbers;
    const bool of_cells = isOfCells(array);
    const auto cells = [&](const char* name) {
      return of_cells && piece.attribute(name) ? file_.count(piece, name) : 0;
    };
    // In the data of cells, lines follow vertices.
    const std::uint64_t begin = cells("NumberOfVerts"), kept = of_cells ? line_count : point_count;
    const std::uint64_t expected = begin + kept + cells("NumberOfStrips") + cells("NumberOfPolys");
    numbers.reserve(static_cast<std::size_t>(kept));
    std::uint64_t read = 0;
    const auto keep = [&](Number number) {
      if (read >= begin && numbers.size() < kept) numbers.push_back(number);
      ++read;
    };
    if constexpr (std::is_floating_point_v<Number>) {
      file_.readScalars(array, keep);
    } else {
      file_.readNumbers<Number>(array, keep);
    }
    if (read != expected || numbers.size() != kept) {
      file_.refuse(array, "there are ", read, " numbers, but ", expected,
                   of_cells ? " cells" : " points");
    }
    return numbers;
  }

  vtp::VtpFile file_;
  const FiberFileOptions& options_;
  ParsedFibers parsed_;
  std::vector<double> radii_;                     ///< by point of the scene, if a piece has them
  std::vector<std::vector<std::size_t>> ends_;    ///< of lines, by piece that has any
  std::size_t pieces_read_ = 0, lines_read_ = 0;  ///< of those
  std::vector<std::size_t> ids_;  ///< by point of the scene: its index among all points of the file
  std::size_t id_count_ = 0;      ///< of pieces that were read
  std::vector<std::int64_t> samples_,
      types_;  ///< by such an index, and kNone for none; may be short
  std::vector<std::int64_t> starts_at_, ends_at_;  ///< by line: such an index or kNone; as above
  std::vector<std::string> other_radii_;           ///< names of arrays that could be radii
};

}  // namespace

ParsedFibers parseVtp(ByteReader& file, const FiberFileOptions& options) {
  return VtpParser(file, options).parse();
}

}  // namespace fcl_fibers::io
