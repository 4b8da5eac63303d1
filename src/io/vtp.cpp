// SPDX-License-Identifier: BSD-3-Clause
#include <pugixml.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/formats.h"
#include "io/point_radii.h"
#include "io/vtp_arrays.h"

namespace fcl_fibers::io {
namespace {

using namespace vtp;

/// The XML format: see VTK File Formats, https://docs.vtk.org, section "XML File Formats".
class VtpParser {
 public:
  VtpParser(ByteReader& file, const FiberFileOptions& options) : file_(file), options_(options) {}

  ParsedFibers parse() {
    splitAppended();
    const auto tags = static_cast<std::uint64_t>(std::count(xml_.begin(), xml_.end(), '<'));
    if (tags > kSomeTags + xml_.size() / kBytesPerTag) {
      file_.refuse(0, "there are ", tags, " tags in ", xml_.size(), " bytes of XML; at most ",
                   kSomeTags + xml_.size() / kBytesPerTag, " are supported");
    }
    const pugi::xml_parse_result result = document_.load_buffer_inplace(
        xml_.data(), xml_.size(), pugi::parse_default, pugi::encoding_utf8);
    if (!result) {
      const auto at = static_cast<std::uint64_t>(result.offset);
      file_.refuse(std::min(at, file_.size()), result.description());
    }
    const pugi::xml_node root = document_.child("VTKFile");
    if (!root) file_.refuse(0, "there is no element VTKFile");
    readAttributes(root);
    // The ends are read first, because they tell how much room all points need.
    const auto pieces = child(file_, root, "PolyData").children("Piece");
    for (const pugi::xml_node piece : pieces) readEnds(piece);
    FiberPolylines& scene = parsed_.fibers;
    if (scene.fiberCount() == 0) refuse(file_, root, "there are no lines with points");
    scene.points.reserve(arrays_.believable(scene.point_begin.back(), 1));
    for (const pugi::xml_node piece : pieces) readPoints(piece);
    if (!radii_.empty()) {
      if (radii_.size() != scene.points.size()) {
        refuse(file_, root, "some pieces have point data 'radius', and some have none");
      }
      setPointRadii(scene, std::move(radii_));
      parsed_.holds_radii = true;
    } else if (!options_.radius) {
      warnOfOtherRadii();
    }
    parsed_.warnOfEmptyFibers(empty_.size(), "line");
    return std::move(parsed_);
  }

 private:
  /// Splits the file into XML and the data of AppendedData, which need not be text.
  void splitAppended() {
    const std::string_view bytes = file_.bytes();
    const std::size_t start = bytes.find("<AppendedData");
    if (start == bytes.npos) {
      xml_ = bytes;
      return;
    }
    const std::size_t data = bytes.find('_', start);
    const std::size_t end = bytes.rfind("</AppendedData>");
    const std::size_t tag_end = std::min(bytes.find('>', start), bytes.size());
    if (data == bytes.npos || end == bytes.npos || end < data || tag_end > data) {
      file_.refuse(start, "the appended data do not start with '_' and end with </AppendedData>");
    }
    encoding_.appended = bytes.substr(data + 1, end - data - 1);
    xml_.reserve(tag_end + 1 + bytes.size() - end);
    xml_.append(bytes.substr(0, tag_end + 1)).append(bytes.substr(end));
  }

  void readAttributes(const pugi::xml_node& root) {
    const auto oneOf = [&](const char* name, std::string_view usual, std::string_view other) {
      const pugi::xml_attribute attribute = root.attribute(name);
      if (!attribute || attribute.value() == usual) return false;
      if (attribute.value() == other) return true;
      refuse(file_, root, name, " is '", shown(attribute), "'; supported are '", usual, "' and '",
             other, "'");
    };
    const pugi::xml_attribute type = root.attribute("type");
    if (type && type.value() != std::string_view("PolyData")) {
      refuse(file_, root, "type is '", shown(type),
             "'; supported are 'PolyData' files (.vtp), as ParaView's Extract Surface makes them");
    }
    encoding_.order =
        oneOf("byte_order", "LittleEndian", "BigEndian") ? ByteOrder::kBig : ByteOrder::kLittle;
    encoding_.wide_header = oneOf("header_type", "UInt32", "UInt64");
    encoding_.compressed = oneOf("compressor", "", "vtkZLibDataCompressor");
    if (const pugi::xml_node appended = root.child("AppendedData")) {
      const std::string_view encoding = appended.attribute("encoding").value();
      if (encoding != "raw" && encoding != "base64") {
        refuse(file_, appended, "encoding is '", ByteReader::shortened(encoding),
               "'; supported are 'raw' and 'base64'");
      }
      encoding_.appended_is_base64 = encoding == "base64";
    }
  }

  /// Reads where the lines of a piece end in the list of their points.
  void readEnds(const pugi::xml_node& piece) {
    const std::uint64_t line_count = count(file_, piece, "NumberOfLines");
    if (line_count == 0) return;
    const pugi::xml_node array = namedArray(file_, child(file_, piece, "Lines"), "offsets");
    std::vector<std::size_t>& begin = parsed_.fibers.point_begin;
    const std::size_t first = begin.back();
    std::uint64_t read = 0;
    std::int64_t previous = 0;
    arrays_.readNumbers<std::int64_t>(array, [&](std::int64_t end) {
      if (end < previous) refuse(file_, array, "the numbers do not ascend from 0 on");
      if (read++ < line_count) {
        if (end == previous) {
          empty_.push_back(begin.size() - 1);
        } else {
          begin.push_back(first + static_cast<std::size_t>(end));
        }
      }
      previous = end;
    });
    if (read != line_count) {
      refuse(file_, array, "there are ", read, " numbers, but NumberOfLines is ", line_count);
    }
  }

  /// Reads the points of a piece's lines, after all ends have been read.
  void readPoints(const pugi::xml_node& piece) {
    const std::uint64_t line_count = count(file_, piece, "NumberOfLines");
    if (line_count == 0) return;
    const std::vector<Point> points = readPointArray(piece);
    const RadiusArray radius = findRadii(piece);
    noteOtherArrays(piece, radius);
    const std::vector<double> radii = readRadii(piece, radius, points.size(), line_count);

    FiberPolylines& scene = parsed_.fibers;
    const std::size_t first = scene.points.size(), first_fiber = fibers_read_;
    const std::vector<double> by_fiber = takeFibers(line_count, radius.of_cells ? &radii : nullptr);
    const std::size_t last = scene.point_begin[fibers_read_];
    if (radius.array) radii_.reserve(scene.points.capacity());
    const pugi::xml_node lines = child(file_, piece, "Lines");
    const pugi::xml_node array = namedArray(file_, lines, "connectivity");
    std::size_t read = 0, fiber = first_fiber;
    arrays_.readNumbers<std::int64_t>(array, [&](std::int64_t index) {
      if (index < 0 || static_cast<std::uint64_t>(index) >= points.size()) {
        refuse(file_, array, "a line has point ", index, " of ", points.size());
      }
      if (read >= last - first) {
        ++read;
        return;
      }
      if (first + read++ == scene.point_begin[fiber + 1]) ++fiber;
      // Points without a line may be anything.
      const auto i = static_cast<std::size_t>(index);
      for (const double c : points[i]) {
        if (!std::isfinite(c)) {
          refuse(file_, pointArray(piece), "point ", i, " is ", points[i][0], ' ', points[i][1],
                 ' ', points[i][2]);
        }
      }
      scene.points.push_back(points[i]);
      if (!radius.array) return;
      const double r = radius.of_cells ? by_fiber[fiber - first_fiber] : radii[i];
      if (!(r >= 0) || !std::isfinite(r)) refuse(file_, radius.array, "a radius is ", r);
      radii_.push_back(r);
    });
    if (read != last - first) {
      refuse(file_, namedArray(file_, lines, "offsets"), "the last number is ", last - first,
             ", but the lines have ", read, " points");
    }
  }

  /// Counts a piece's lines with points as read. Returns those numbers of `by_line`, if there are
  /// any, that are theirs.
  std::vector<double> takeFibers(std::uint64_t line_count, const std::vector<double>* by_line) {
    std::vector<double> by_fiber;
    for (std::size_t line = 0; line < line_count; ++line) {
      if (empty_read_ < empty_.size() && empty_[empty_read_] == fibers_read_) {
        ++empty_read_;
        continue;
      }
      ++fibers_read_;
      if (by_line != nullptr) by_fiber.push_back((*by_line)[line]);
    }
    return by_fiber;
  }

  pugi::xml_node pointArray(const pugi::xml_node& piece) const {
    return child(file_, child(file_, piece, "Points"), "DataArray");
  }

  std::vector<Point> readPointArray(const pugi::xml_node& piece) {
    const pugi::xml_node array = pointArray(piece);
    if (count(file_, array, "NumberOfComponents") != 3)
      refuse(file_, array, "NumberOfComponents is not 3");
    const std::uint64_t point_count = count(file_, piece, "NumberOfPoints");
    std::vector<Point> points;
    points.reserve(arrays_.believable(point_count, 3));
    std::uint64_t read = 0;
    arrays_.readNumbers<double>(array, [&](double coordinate) {
      const std::size_t k = read++ % 3;
      if (k == 0 && points.size() < point_count) points.emplace_back();
      if (read <= 3 * points.size()) points.back()[k] = coordinate;
    });
    if (read % 3 != 0 || read / 3 != point_count) {
      refuse(file_, array, "there are ", read, " numbers, but NumberOfPoints is ", point_count);
    }
    parsed_.is_float |= std::string_view(array.attribute("type").value()) == "Float32";
    return points;
  }

  /// The array with the radii of a piece, if it has them.
  struct RadiusArray {
    pugi::xml_node array;
    bool of_cells = false;
  };

  RadiusArray findRadii(const pugi::xml_node& piece) const {
    const auto named = [&](const char* data, const char* name) {
      return piece.child(data).find_child_by_attribute("DataArray", "Name", name);
    };
    if (options_.radius_from.empty()) return {named("PointData", "radius")};
    const char* const name = options_.radius_from.c_str();
    if (const pugi::xml_node array = named("PointData", name)) return {array};
    if (const pugi::xml_node array = named("CellData", name)) return {array, true};
    std::vector<std::string> names;
    addNames(piece, {}, true, names);
    refuse(file_, piece, "there is no array '", ByteReader::shortened(name),
           "', which radius_from names; ",
           names.empty() ? "points and cells have no data" : "there are: ", listed(names));
  }

  /// Reads the radii by point or by line; empty if there are none.
  std::vector<double> readRadii(const pugi::xml_node& piece, const RadiusArray& radius,
                                std::uint64_t point_count, std::uint64_t line_count) {
    std::vector<double> radii;
    if (!radius.array) return radii;
    // In the data of cells, lines follow vertices.
    const std::uint64_t begin = radius.of_cells ? cellCount(piece, "NumberOfVerts") : 0;
    const std::uint64_t kept = radius.of_cells ? line_count : point_count;
    const std::uint64_t expected =
        begin + kept +
        (radius.of_cells ? cellCount(piece, "NumberOfStrips") + cellCount(piece, "NumberOfPolys")
                         : 0);
    radii.reserve(static_cast<std::size_t>(kept));
    std::uint64_t read = 0;
    arrays_.readScalars(radius.array, [&](double number) {
      if (read >= begin && radii.size() < kept) radii.push_back(number);
      ++read;
    });
    if (read != expected || radii.size() != kept) {
      refuse(file_, radius.array, "there are ", read, " numbers, but ", expected,
             radius.of_cells ? " cells" : " points");
    }
    return radii;
  }

  std::uint64_t cellCount(const pugi::xml_node& piece, const char* name) const {
    return piece.attribute(name) ? count(file_, piece, name) : 0;
  }

  /// Adds the names of arrays of points and cells, of a few of them.
  /// @param radii_only  of those that could be radii
  static void addNames(const pugi::xml_node& piece, const RadiusArray& without, bool radii_only,
                       std::vector<std::string>& names) {
    constexpr std::size_t kMost = 8;
    for (const char* const data : {"PointData", "CellData"}) {
      for (const pugi::xml_node array : piece.child(data).children("DataArray")) {
        const std::string_view components = array.attribute("NumberOfComponents").value();
        const bool is_one = components.empty() || components == "1";
        const bool is_number = std::string_view(array.attribute("type").value()) != "String";
        if (names.size() > kMost) return;
        if (array == without.array || isOwn(array) || (radii_only && !(is_one && is_number))) {
          continue;
        }
        std::string name = joinedText(data == std::string_view("PointData") ? "point" : "cell",
                                      " data '", shown(array.attribute("Name")), "'");
        if (std::find(names.begin(), names.end(), name) != names.end()) continue;
        if (names.size() == kMost) name = "others";
        if (names.size() <= kMost) names.push_back(std::move(name));
      }
    }
  }

  /// Whether an array has no name, or one that exportFibers() or exportSegments() writes, which
  /// tells no more than the lines do.
  static bool isOwn(const pugi::xml_node& array) {
    const std::string_view name = array.attribute("Name").value();
    return name.empty() || name == "fiber" || name == "segment" || name == "touching";
  }

  void noteOtherArrays(const pugi::xml_node& piece, const RadiusArray& radius) {
    addNames(piece, radius, false, parsed_.passed_over);
    if (!radius.array) addNames(piece, radius, true, other_radii_);
  }

  void warnOfOtherRadii() {
    if (other_radii_.empty()) return;
    parsed_.warnings.push_back(
        "There is no point data 'radius'; radius_from takes the radii from "
        "another array. There are: " +
        listed(other_radii_) + ".");
  }

  static std::string listed(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
  }

  ByteReader& file_;
  const FiberFileOptions& options_;
  Encoding encoding_;
  VtpArrays arrays_{file_, encoding_};
  ParsedFibers parsed_;
  std::vector<double> radii_;             ///< by point of the scene, if a piece has them
  std::vector<std::size_t> empty_;        ///< lines without points: numbers of fibers before them
  std::size_t fibers_read_ = 0;           ///< fibers whose points have been read
  std::size_t empty_read_ = 0;            ///< and of `empty_`
  std::vector<std::string> other_radii_;  ///< names of arrays that could be radii
  std::string xml_;                       ///< the text that document_ points into
  pugi::xml_document document_;
};

}  // namespace

ParsedFibers parseVtp(ByteReader& file, const FiberFileOptions& options) {
  return VtpParser(file, options).parse();
}

}  // namespace fcl_fibers::io
