// SPDX-License-Identifier: BSD-3-Clause
#include <pugixml.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
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
  explicit VtpParser(ByteReader& file) : file_(file) {}

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
    if (scene.fiberCount() == 0) refuse(file_, root, "there are no lines");
    scene.points.reserve(arrays_.believable(scene.point_begin.back(), 1));
    for (const pugi::xml_node piece : pieces) readPoints(piece);
    if (!radii_.empty()) {
      if (radii_.size() != scene.points.size()) {
        refuse(file_, root, "some pieces have point data 'radius', and some have none");
      }
      setPointRadii(scene, std::move(radii_));
      parsed_.has_radius = true;
    }
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
    oneOf("type", "PolyData", "PolyData");
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
      if (end <= previous) refuse(file_, array, "the numbers do not ascend strictly from above 0");
      previous = end;
      if (read++ < line_count) begin.push_back(first + static_cast<std::size_t>(end));
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
    const std::vector<double> radii = readRadii(piece, points.size());

    FiberPolylines& scene = parsed_.fibers;
    const std::size_t first = scene.points.size();
    fibers_read_ += static_cast<std::size_t>(line_count);
    const std::size_t last = scene.point_begin[fibers_read_];
    if (!radii.empty()) radii_.reserve(scene.points.capacity());
    const pugi::xml_node lines = child(file_, piece, "Lines");
    const pugi::xml_node array = namedArray(file_, lines, "connectivity");
    std::size_t read = 0;
    arrays_.readNumbers<std::int64_t>(array, [&](std::int64_t index) {
      if (index < 0 || static_cast<std::uint64_t>(index) >= points.size()) {
        refuse(file_, array, "a line has point ", index, " of ", points.size());
      }
      if (read++ >= last - first) return;
      scene.points.push_back(points[static_cast<std::size_t>(index)]);
      if (!radii.empty()) radii_.push_back(radii[static_cast<std::size_t>(index)]);
    });
    if (read != last - first) {
      refuse(file_, namedArray(file_, lines, "offsets"), "the last number is ", last - first,
             ", but the lines have ", read, " points");
    }
  }

  std::vector<Point> readPointArray(const pugi::xml_node& piece) {
    const pugi::xml_node array = child(file_, child(file_, piece, "Points"), "DataArray");
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

  /// Reads the radii by point of a piece; empty if it has none.
  std::vector<double> readRadii(const pugi::xml_node& piece, std::size_t point_count) {
    const pugi::xml_node array =
        piece.child("PointData").find_child_by_attribute("DataArray", "Name", "radius");
    std::vector<double> radii;
    if (!array) return radii;
    if (array.attribute("NumberOfComponents") && count(file_, array, "NumberOfComponents") != 1) {
      refuse(file_, array, "NumberOfComponents is not 1");
    }
    radii.reserve(point_count);
    std::uint64_t read = 0;
    arrays_.readNumbers<double>(array, [&](double radius) {
      if (radius < 0) refuse(file_, array, "a radius is ", radius);
      if (read++ < point_count) radii.push_back(radius);
    });
    if (read != point_count) {
      refuse(file_, array, "there are ", read, " numbers, but ", point_count, " points");
    }
    return radii;
  }

  ByteReader& file_;
  Encoding encoding_;
  VtpArrays arrays_{file_, encoding_};
  ParsedFibers parsed_;
  std::vector<double> radii_;    ///< by point of the scene, if a piece has them
  std::size_t fibers_read_ = 0;  ///< fibers whose points have been read
  std::string xml_;              ///< the text that document_ points into
  pugi::xml_document document_;
};

}  // namespace

ParsedFibers parseVtp(ByteReader& file) { return VtpParser(file).parse(); }

}  // namespace fcl_fibers::io
