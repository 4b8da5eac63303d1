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

#include "../point_radii.h"
#include "formats.h"

namespace fcl_fibers::scenes {
namespace {

constexpr std::string_view kSpace = " \t\r\n";

/// Most bytes that all compressed arrays together may become, in sizes of the file. Deflate goes up
/// to 1032; indices that count up become 5 times as many bytes, coordinates 1 to 3 times.
constexpr std::uint64_t kMostInflation = 64;

/// Elements take 128 bytes each, with the text behind them, so that a file of nothing else would
/// take 26 times its size. There may be some, and one for so many bytes; files have far fewer.
constexpr std::uint64_t kSomeTags = 256, kBytesPerTag = 16;

/// Bytes of arrays, as they are or as base64, from an offset on.
class EncodedBytes {
 public:
  EncodedBytes(const ByteReader& file, std::uint64_t at, std::string_view text, bool base64)
      : file_(file), at_(at), text_(text), base64_(base64) {}

  /// The next `count` bytes.
  std::string take(std::uint64_t count) {
    // Four characters are three bytes at most; spaces among them make them fewer.
    const std::uint64_t most = base64_ ? decoded_.size() + text_.size() / 4 * 3 : text_.size();
    if (count > most) refuse("ends before its ", count, " bytes do");
    const auto size = static_cast<std::size_t>(count);
    std::string bytes;
    if (!base64_) {
      bytes = text_.substr(0, size);
      text_.remove_prefix(size);
      return bytes;
    }
    bytes.swap(decoded_);
    bytes.reserve(size + 2);
    while (bytes.size() < size) decodeQuartet(bytes);
    decoded_ = bytes.substr(size);
    bytes.resize(size);
    return bytes;
  }

  template <typename... Reason>
  [[noreturn]] void refuse(const Reason&... reason) const {
    file_.refuse(at_, "the array ", reason...);
  }

 private:
  /// What is padded ends a part, after which the next one starts: a header may be encoded for
  /// itself.
  void decodeQuartet(std::string& bytes) {
    std::uint32_t bits = 0;
    int padding = 0;
    for (int i = 0; i < 4; ++i) {
      text_.remove_prefix(std::min(text_.find_first_not_of(kSpace), text_.size()));
      if (text_.empty()) refuse("ends inside its base64 text");
      const char c = text_.front();
      text_.remove_prefix(1);
      const int value = c == '=' ? 0 : sextet(c);
      if (value < 0 || (c != '=' && padding > 0) || (c == '=' && i < 2)) {
        refuse("has '", ByteReader::shortened({&c, 1}), "' where base64 has none");
      }
      padding += c == '=';
      bits = bits << 6 | static_cast<std::uint32_t>(value);
    }
    for (int i = 0; i < 3 - padding; ++i) bytes += static_cast<char>(bits >> (16 - 8 * i) & 0xFF);
  }

  static int sextet(char c) {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : -1;
  }

  const ByteReader& file_;
  std::uint64_t at_;
  std::string_view text_;
  bool base64_;
  std::string decoded_;  ///< at most two bytes beyond what was taken
};

/// The XML format: see VTK File Formats, https://docs.vtk.org, section "XML File Formats".
class VtpParser {
 public:
  explicit VtpParser(ByteReader& file) : file_(file) {}

  ParsedFibers parse() {
    splitAppended();
    const auto tags = static_cast<std::uint64_t>(std::count(xml_.begin(), xml_.end(), '<'));
    if (tags > kSomeTags + xml_.size() / kBytesPerTag) {
      file_.refuse(0, "there are ", tags, " tags in ", xml_.size(), " bytes of XML; of so many, ",
                   kSomeTags + xml_.size() / kBytesPerTag, " are read");
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
    // Ends first, as they tell how much room all points need.
    const auto pieces = child(root, "PolyData").children("Piece");
    for (const pugi::xml_node piece : pieces) readEnds(piece);
    FiberScene& scene = parsed_.scene;
    if (scene.fiberCount() == 0) refuse(root, "there are no lines");
    scene.points.reserve(believable(scene.point_begin.back(), 1));
    for (const pugi::xml_node piece : pieces) readPoints(piece);
    if (!radii_.empty()) {
      if (radii_.size() != scene.points.size()) {
        refuse(root, "some pieces have point data 'radius', and some have none");
      }
      setPointRadii(scene, std::move(radii_));
      parsed_.has_radius = true;
    }
    return std::move(parsed_);
  }

 private:
  /// The file as XML: without the data of AppendedData, which need not be text.
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
    appended_ = bytes.substr(data + 1, end - data - 1);
    xml_.reserve(tag_end + 1 + bytes.size() - end);
    xml_.append(bytes.substr(0, tag_end + 1)).append(bytes.substr(end));
  }

  /// A count that the file tells of things of so many numbers each, or as many as it can hold.
  std::size_t believable(std::uint64_t told, std::uint64_t numbers) const {
    // In text a number takes a digit and, except the last one, a space.
    const std::uint64_t most =
        compressed_ ? kMostInflation * file_.size() / 4 : (file_.size() + 1) / 2;
    return static_cast<std::size_t>(std::min(told, most / numbers));
  }

  template <typename... Reason>
  [[noreturn]] void refuse(const pugi::xml_node& node, const Reason&... reason) const {
    // Offsets are to the element's name, and as in the file: only what comes after it is cut out.
    const auto at = std::max<std::ptrdiff_t>(node.offset_debug(), 1) - 1;
    file_.refuse(static_cast<std::uint64_t>(at), node.name(), ": ", reason...);
  }

  pugi::xml_node child(const pugi::xml_node& parent, const char* name) const {
    const pugi::xml_node node = parent.child(name);
    if (!node) refuse(parent, "there is no element ", name);
    return node;
  }

  static std::string shown(const pugi::xml_attribute& attribute) {
    return ByteReader::shortened(attribute.value());
  }

  std::uint64_t count(const pugi::xml_node& node, const char* name) const {
    const std::string_view text = node.attribute(name).value();
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) {
      refuse(node, name, " is '", ByteReader::shortened(text), "', no whole number");
    }
    return value;
  }

  void readAttributes(const pugi::xml_node& root) {
    const auto oneOf = [&](const char* name, std::string_view usual, std::string_view other) {
      const pugi::xml_attribute attribute = root.attribute(name);
      if (!attribute || attribute.value() == usual) return false;
      if (attribute.value() == other) return true;
      refuse(root, name, " is '", shown(attribute), "', read are '", usual, "' and '", other, "'");
    };
    oneOf("type", "PolyData", "PolyData");
    order_ =
        oneOf("byte_order", "LittleEndian", "BigEndian") ? ByteOrder::kBig : ByteOrder::kLittle;
    wide_header_ = oneOf("header_type", "UInt32", "UInt64");
    compressed_ = oneOf("compressor", "", "vtkZLibDataCompressor");
    if (const pugi::xml_node appended = root.child("AppendedData")) {
      const std::string_view encoding = appended.attribute("encoding").value();
      if (encoding != "raw" && encoding != "base64") {
        refuse(appended, "encoding is '", ByteReader::shortened(encoding),
               "', read are 'raw' and 'base64'");
      }
      appended_is_base64_ = encoding == "base64";
    }
  }

  /// Where the lines of a piece end in the list of their points.
  void readEnds(const pugi::xml_node& piece) {
    const std::uint64_t line_count = count(piece, "NumberOfLines");
    if (line_count == 0) return;
    const pugi::xml_node array = namedArray(child(piece, "Lines"), "offsets");
    std::vector<std::size_t>& begin = parsed_.scene.point_begin;
    const std::size_t first = begin.back();
    std::uint64_t read = 0;
    std::int64_t previous = 0;
    readNumbers<std::int64_t>(array, [&](std::int64_t end) {
      if (end <= previous) refuse(array, "the numbers do not ascend strictly from above 0");
      previous = end;
      if (read++ < line_count) begin.push_back(first + static_cast<std::size_t>(end));
    });
    if (read != line_count) {
      refuse(array, "there are ", read, " numbers, NumberOfLines is ", line_count);
    }
  }

  /// The points of a piece's lines, after all ends.
  void readPoints(const pugi::xml_node& piece) {
    const std::uint64_t line_count = count(piece, "NumberOfLines");
    if (line_count == 0) return;
    const std::vector<Point> points = readPointArray(piece);
    const std::vector<double> radii = readRadii(piece, points.size());

    FiberScene& scene = parsed_.scene;
    const std::size_t first = scene.points.size();
    fibers_read_ += static_cast<std::size_t>(line_count);
    const std::size_t last = scene.point_begin[fibers_read_];
    if (!radii.empty()) radii_.reserve(scene.points.capacity());
    const pugi::xml_node lines = child(piece, "Lines");
    const pugi::xml_node array = namedArray(lines, "connectivity");
    std::size_t read = 0;
    readNumbers<std::int64_t>(array, [&](std::int64_t index) {
      if (index < 0 || static_cast<std::uint64_t>(index) >= points.size()) {
        refuse(array, "a line has point ", index, " of ", points.size());
      }
      if (read++ >= last - first) return;
      scene.points.push_back(points[static_cast<std::size_t>(index)]);
      if (!radii.empty()) radii_.push_back(radii[static_cast<std::size_t>(index)]);
    });
    if (read != last - first) {
      refuse(namedArray(lines, "offsets"), "the last number is ", last - first, ", the lines have ",
             read, " points");
    }
  }

  std::vector<Point> readPointArray(const pugi::xml_node& piece) {
    const pugi::xml_node array = child(child(piece, "Points"), "DataArray");
    if (count(array, "NumberOfComponents") != 3) refuse(array, "NumberOfComponents is not 3");
    const std::uint64_t point_count = count(piece, "NumberOfPoints");
    std::vector<Point> points;
    points.reserve(believable(point_count, 3));
    std::uint64_t read = 0;
    readNumbers<double>(array, [&](double coordinate) {
      const std::size_t k = read++ % 3;
      if (k == 0 && points.size() < point_count) points.emplace_back();
      if (read <= 3 * points.size()) points.back()[k] = coordinate;
    });
    if (read % 3 != 0 || read / 3 != point_count) {
      refuse(array, "there are ", read, " numbers, NumberOfPoints is ", point_count);
    }
    parsed_.is_float |= std::string_view(array.attribute("type").value()) == "Float32";
    return points;
  }

  /// By point of a piece; none if it has no such data.
  std::vector<double> readRadii(const pugi::xml_node& piece, std::size_t point_count) {
    const pugi::xml_node array =
        piece.child("PointData").find_child_by_attribute("DataArray", "Name", "radius");
    std::vector<double> radii;
    if (!array) return radii;
    if (array.attribute("NumberOfComponents") && count(array, "NumberOfComponents") != 1) {
      refuse(array, "NumberOfComponents is not 1");
    }
    radii.reserve(point_count);
    std::uint64_t read = 0;
    readNumbers<double>(array, [&](double radius) {
      if (radius < 0) refuse(array, "a radius is ", radius);
      if (read++ < point_count) radii.push_back(radius);
    });
    if (read != point_count) {
      refuse(array, "there are ", read, " numbers, and ", point_count, " points");
    }
    return radii;
  }

  pugi::xml_node namedArray(const pugi::xml_node& parent, const char* name) const {
    const pugi::xml_node array = parent.find_child_by_attribute("DataArray", "Name", name);
    if (!array) refuse(parent, "there is no DataArray '", name, "'");
    return array;
  }

  /// Calls visit(number) for each number, without keeping them. T is double for what has to be
  /// finite, and std::int64_t for indices.
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
    // Of UInt64, what is beyond Int64 becomes negative, and refused.
    if (!kReal && (type == "Int64" || type == "UInt64")) {
      return decodeAll<std::int64_t, T>(array, bytes, visit);
    }
    refuse(array, "type is '", ByteReader::shortened(type), "', read are ",
           kReal ? "Float32 and Float64" : "Int32, Int64, UInt32 and UInt64");
  }

  template <typename Stored, typename T, typename Visit>
  void decodeAll(const pugi::xml_node& array, const std::string& bytes, Visit&& visit) const {
    if (bytes.size() % sizeof(Stored) != 0) {
      refuse(array, "its ", bytes.size(), " bytes are no multiple of ", sizeof(Stored));
    }
    for (std::size_t i = 0; i < bytes.size(); i += sizeof(Stored)) {
      const T number = static_cast<T>(decode<Stored>(&bytes[i], order_));
      if constexpr (std::is_same_v<T, double>) {
        if (!std::isfinite(number)) refuse(array, "number ", i / sizeof(Stored), " is ", number);
      }
      visit(number);
    }
  }

  /// The text of an array, which may stand behind elements that describe it.
  static std::string_view text(const pugi::xml_node& array) {
    for (const pugi::xml_node part : array.children()) {
      const std::string_view value = part.value();
      const bool is_text = part.type() == pugi::node_pcdata || part.type() == pugi::node_cdata;
      if (is_text && value.find_first_not_of(kSpace) != value.npos) return value;
    }
    return {};
  }

  template <typename T, typename Visit>
  void readText(const pugi::xml_node& array, Visit&& visit) const {
    std::string_view rest = text(array);
    while (true) {
      rest.remove_prefix(std::min(rest.find_first_not_of(kSpace), rest.size()));
      if (rest.empty()) return;
      const std::string_view word = rest.substr(0, rest.find_first_of(kSpace));
      rest.remove_prefix(word.size());
      T value{};
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
      bool good = error == std::errc() && end == word.data() + word.size();
      if constexpr (std::is_same_v<T, double>) good = good && std::isfinite(value);
      if (!good) {
        refuse(array, "'", ByteReader::shortened(word), "' is no ",
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
      refuse(array, "format is '", ByteReader::shortened(format),
             "', read are 'ascii', 'binary' and 'appended'");
    }
    const std::uint64_t offset = count(array, "offset");
    if (offset > appended_.size()) {
      refuse(array, "offset is ", offset, ", appended are ", appended_.size(), " bytes");
    }
    return readBytes(EncodedBytes(file_, at, appended_.substr(static_cast<std::size_t>(offset)),
                                  appended_is_base64_));
  }

  std::uint64_t readWord(EncodedBytes& bytes) const {
    if (wide_header_) return decode<std::uint64_t>(bytes.take(8).data(), order_);
    return decode<std::uint32_t>(bytes.take(4).data(), order_);
  }

  /// Uncompressed: the number of bytes, then the bytes. Compressed: the number of blocks, their
  /// size, that of the last one unless it is a whole one, their compressed sizes, then the blocks.
  std::string readBytes(EncodedBytes bytes) {
    const std::uint64_t blocks_or_bytes = readWord(bytes);
    if (!compressed_) {
      std::string all = bytes.take(blocks_or_bytes);
      // Arrays of several pieces may be one and the same of the appended data.
      if (all.size() > file_.size() - decoded_) {
        bytes.refuse("has ", all.size(), " bytes: all arrays become more than the file's ",
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
      bytes.refuse("has ", blocks, " blocks of ", block_size,
                   " bytes: all arrays become more than ", kMostInflation, " times the file's ",
                   file_.size(), " bytes");
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
        bytes.refuse("has a block that zlib does not make ", expected, " bytes of");
      }
      begin += expected;
    }
    return inflated;
  }

  ByteReader& file_;
  ParsedFibers parsed_;
  std::vector<double> radii_;    ///< by point of the scene, if a piece has them
  std::size_t fibers_read_ = 0;  ///< those with points
  std::string xml_;              ///< what document_ refers to
  pugi::xml_document document_;
  std::string_view appended_;  ///< behind its '_'
  bool appended_is_base64_ = false;
  ByteOrder order_ = ByteOrder::kLittle;
  bool wide_header_ = false;
  bool compressed_ = false;
  std::uint64_t decoded_ = 0;  ///< bytes of all arrays so far
};

}  // namespace

ParsedFibers parseVtp(ByteReader& file) { return VtpParser(file).parse(); }

}  // namespace fcl_fibers::scenes
