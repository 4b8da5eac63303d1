// SPDX-License-Identifier: BSD-3-Clause
#include <zlib.h>
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

#include "io/encoded_bytes.h"
#include "io/formats.h"
#include "io/point_radii.h"

namespace fcl_fibers::io {
namespace {

/// The most that all compressed arrays together may inflate to, in multiples of the file's size.
/// Deflate reaches 1032; ascending indices inflate to 5 times their size, coordinates to 1 to 3
/// times.
constexpr std::uint64_t kMostInflation = 64;

/// An element and the text after it take 128 bytes, so a file of elements alone would take 26 times
/// its size. The limit is kSomeTags, plus one for each kBytesPerTag. Real files have far fewer.
constexpr std::uint64_t kSomeTags = 256, kBytesPerTag = 16;

template <typename... Reason>
[[noreturn]] void refuse(const ByteReader& file, const pugi::xml_node& node,
                         const Reason&... reason) {
  // The offset is that of the element's name. It holds for the file, because only data after the
  // element were split off.
  const auto at = std::max<std::ptrdiff_t>(node.offset_debug(), 1) - 1;
  file.refuse(static_cast<std::uint64_t>(at), node.name(), ": ", reason...);
}

pugi::xml_node child(const ByteReader& file, const pugi::xml_node& parent, const char* name) {
  const pugi::xml_node node = parent.child(name);
  if (!node) refuse(file, parent, "there is no element ", name);
  return node;
}

pugi::xml_node namedArray(const ByteReader& file, const pugi::xml_node& parent, const char* name) {
  const pugi::xml_node array = parent.find_child_by_attribute("DataArray", "Name", name);
  if (!array) refuse(file, parent, "there is no DataArray '", name, "'");
  return array;
}

std::string shown(const pugi::xml_attribute& attribute) {
  return ByteReader::shortened(attribute.value());
}

std::uint64_t count(const ByteReader& file, const pugi::xml_node& node, const char* name) {
  const std::string_view text = node.attribute(name).value();
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    refuse(file, node, name, " is '", ByteReader::shortened(text), "', which is no whole number");
  }
  return value;
}

/// The text of an array, which may follow elements that describe it.
std::string_view text(const pugi::xml_node& array) {
  for (const pugi::xml_node part : array.children()) {
    const std::string_view value = part.value();
    const bool is_text = part.type() == pugi::node_pcdata || part.type() == pugi::node_cdata;
    if (is_text && value.find_first_not_of(EncodedBytes::kSpace) != value.npos) return value;
  }
  return {};
}

/// How the file stores its arrays.
struct Encoding {
  ByteOrder order = ByteOrder::kLittle;
  bool wide_header = false;
  bool compressed = false;
  std::string_view appended;  ///< after its '_'
  bool appended_is_base64 = false;
};

/// Reads the numbers of the file's arrays, as text or bytes, inside the XML or appended.
class VtpArrays {
 public:
  /// @param encoding  is used from the first array on
  VtpArrays(const ByteReader& file, const Encoding& encoding) : file_(file), encoding_(encoding) {}

  /// The count that the file claims, or the most that it can hold of items with `numbers` numbers
  /// each.
  std::size_t believable(std::uint64_t told, std::uint64_t numbers) const {
    // In text a number takes a digit and, except the last one, a space.
    const std::uint64_t most =
        encoding_.compressed ? kMostInflation * file_.size() / 4 : (file_.size() + 1) / 2;
    return static_cast<std::size_t>(std::min(told, most / numbers));
  }

  /// Calls visit(number) for each number, without keeping them. T is double for numbers that must
  /// be finite, and std::int64_t for indices.
  template <typename T, typename Visit>
  void readNumbers(const pugi::xml_node& array, Visit&& visit) {
    const std::string_view type = array.attribute("type").value();
    const std::string_view format = array.attribute("format").value();
    constexpr bool kReal = std::is_same_v<T, double>;
    if (format == "ascii") return readText<T>(array, visit);
    const std::string bytes = readBytes(array, format);
    if (kReal && type == "Float32") return decodeAll<float, T>(array, bytes, visit);
    if (kReal && type == "Float64") return decodeAll<double, T>(array, bytes, visit);
    if (!kReal && type == "Int32") return decodeAll<std::int32_t, T>(array, bytes, visit);
    if (!kReal && type == "UInt32") return decodeAll<std::uint32_t, T>(array, bytes, visit);
    // A UInt64 beyond Int64 becomes negative and is refused.
    if (!kReal && (type == "Int64" || type == "UInt64")) {
      return decodeAll<std::int64_t, T>(array, bytes, visit);
    }
    refuse(file_, array, "type is '", ByteReader::shortened(type), "'; supported are ",
           kReal ? "Float32 and Float64" : "Int32, Int64, UInt32 and UInt64");
  }

 private:
  template <typename Stored, typename T, typename Visit>
  void decodeAll(const pugi::xml_node& array, const std::string& bytes, Visit&& visit) const {
    if (bytes.size() % sizeof(Stored) != 0) {
      refuse(file_, array, "its ", bytes.size(), " bytes are no multiple of ", sizeof(Stored));
    }
    for (std::size_t i = 0; i < bytes.size(); i += sizeof(Stored)) {
      const T number = static_cast<T>(decode<Stored>(&bytes[i], encoding_.order));
      if constexpr (std::is_same_v<T, double>) {
        if (!std::isfinite(number)) {
          refuse(file_, array, "number ", i / sizeof(Stored), " is ", number);
        }
      }
      visit(number);
    }
  }

  template <typename T, typename Visit>
  void readText(const pugi::xml_node& array, Visit&& visit) const {
    std::string_view rest = text(array);
    while (true) {
      rest.remove_prefix(std::min(rest.find_first_not_of(EncodedBytes::kSpace), rest.size()));
      if (rest.empty()) return;
      const std::string_view word = rest.substr(0, rest.find_first_of(EncodedBytes::kSpace));
      rest.remove_prefix(word.size());
      T value{};
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
      bool good = error == std::errc() && end == word.data() + word.size();
      if constexpr (std::is_same_v<T, double>) good = good && std::isfinite(value);
      if (!good) {
        refuse(file_, array, "'", ByteReader::shortened(word), "' is no ",
               std::is_same_v<T, double> ? "finite number" : "whole number that fits");
      }
      visit(value);
    }
  }

  std::string readBytes(const pugi::xml_node& array, std::string_view format) {
    const auto at =
        static_cast<std::uint64_t>(std::max<std::ptrdiff_t>(array.offset_debug(), 1) - 1);
    if (format == "binary") return readBytes(EncodedBytes(file_, at, text(array), true));
    if (format != "appended") {
      refuse(file_, array, "format is '", ByteReader::shortened(format),
             "'; supported are 'ascii', 'binary' and 'appended'");
    }
    const std::uint64_t offset = count(file_, array, "offset");
    if (offset > encoding_.appended.size()) {
      refuse(file_, array, "offset is ", offset, ", but only ", encoding_.appended.size(),
             " bytes are appended");
    }
    return readBytes(EncodedBytes(file_, at,
                                  encoding_.appended.substr(static_cast<std::size_t>(offset)),
                                  encoding_.appended_is_base64));
  }

  std::uint64_t readWord(EncodedBytes& bytes) const {
    if (encoding_.wide_header) return decode<std::uint64_t>(bytes.take(8).data(), encoding_.order);
    return decode<std::uint32_t>(bytes.take(4).data(), encoding_.order);
  }

  /// Uncompressed: the number of bytes, then the bytes. Compressed: the number of blocks, their
  /// size, the size of the last one (0 if it is whole), their compressed sizes, then the blocks.
  std::string readBytes(EncodedBytes bytes) {
    const std::uint64_t blocks_or_bytes = readWord(bytes);
    if (!encoding_.compressed) {
      std::string all = bytes.take(blocks_or_bytes);
      // Several pieces may refer to the same appended array.
      if (all.size() > file_.size() - decoded_) {
        bytes.refuse("has ", all.size(), " bytes; all arrays together exceed the file's ",
                     file_.size(), " bytes");
      }
      decoded_ += all.size();
      return all;
    }
    const std::uint64_t blocks = blocks_or_bytes;
    const std::uint64_t block_size = readWord(bytes);
    const std::uint64_t last_size = readWord(bytes);
    if (blocks == 0) return {};
    const std::uint64_t most = kMostInflation * file_.size();
    if (block_size == 0 || blocks > file_.size() || block_size > most || last_size > block_size) {
      bytes.refuse("has ", blocks, " blocks of ", block_size, " bytes, the last one of ", last_size,
                   ", beyond a file of ", file_.size(), " bytes");
    }
    if (blocks > (most - decoded_) / block_size) {
      bytes.refuse("has ", blocks, " blocks of ", block_size, " bytes; all arrays together exceed ",
                   kMostInflation, " times the file's ", file_.size(), " bytes");
    }
    const std::uint64_t size =
        (blocks - 1) * block_size + (last_size == 0 ? block_size : last_size);
    decoded_ += size;
    std::vector<std::uint64_t> compressed_sizes;
    for (std::uint64_t i = 0; i < blocks; ++i) compressed_sizes.push_back(readWord(bytes));

    std::string inflated(static_cast<std::size_t>(size), '\0');
    std::size_t begin = 0;
    for (const std::uint64_t compressed_size : compressed_sizes) {
      const std::string compressed = bytes.take(compressed_size);
      const std::size_t expected =
          std::min(static_cast<std::size_t>(block_size), inflated.size() - begin);
      uLongf got = static_cast<uLongf>(expected);
      const int status = uncompress(reinterpret_cast<Bytef*>(&inflated[begin]), &got,
                                    reinterpret_cast<const Bytef*>(compressed.data()),
                                    static_cast<uLong>(compressed.size()));
      if (status != Z_OK || got != expected) {
        bytes.refuse("has a block that zlib does not inflate to ", expected, " bytes");
      }
      begin += expected;
    }
    return inflated;
  }

  const ByteReader& file_;
  const Encoding& encoding_;
  std::uint64_t decoded_ = 0;  ///< bytes of all arrays so far
};

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
    // Ends come first, because they tell how much room all points need.
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

  /// The radii by point of a piece, empty if it has none.
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
