// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <zlib.h>
#include <pugixml.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "io/byte_reader.h"
#include "io/text.h"

/// VTK's XML format: see VTK File Formats, https://docs.vtk.org, section "XML File Formats".
namespace fcl_fibers::io::vtp {

constexpr std::string_view kBlank = " \t\r\n";

// Names of arrays that exportFibers() writes. The first two have a number for each line, and the
// other two one for each point; see the members of FiberPolylines.
constexpr const char *kStartsAt = "starts_at", *kEndsAt = "ends_at";
constexpr const char *kSample = "swc_sample", *kType = "swc_type";

/// The name of a type of numbers.
template <typename Number>
std::string typeName() {
  const char* const kind = std::is_floating_point_v<Number> ? "Float"
                           : std::is_signed_v<Number>       ? "Int"
                                                            : "UInt";
  return kind + std::to_string(8 * sizeof(Number));
}

/// Reads the bytes of an array, raw or in base64.
class EncodedBytes {
 public:
  EncodedBytes(const ByteReader& file, std::uint64_t at, std::string_view text, bool base64)
      : file_(file), at_(at), text_(text), base64_(base64) {}

  /// The next `count` bytes.
  std::string take(std::uint64_t count) {
    // Four characters hold at most three bytes, and spaces among them make that fewer.
    const std::uint64_t most = base64_ ? decoded_.size() + text_.size() / 4 * 3 : text_.size();
    if (count > most) refuse("ends before its ", count, " bytes do");
    const auto size = static_cast<std::size_t>(count);
    std::string bytes;
    if (base64_) {
      bytes.swap(decoded_);
      bytes.reserve(size + 2);
      while (bytes.size() < size) decodeQuartet(bytes);
      decoded_ = bytes.substr(size);
      bytes.resize(size);
    } else {
      bytes = text_.substr(0, size);
      text_.remove_prefix(size);
    }
    return bytes;
  }

  template <typename... Reason>
  [[noreturn]] void refuse(const Reason&... reason) const {
    file_.refuse(at_, "the array ", reason...);
  }

 private:
  /// Padding may end a part before the array ends, because a header may be encoded on its own.
  void decodeQuartet(std::string& bytes) {
    std::uint32_t bits = 0;
    int padding = 0;
    for (int i = 0; i < 4; ++i) {
      text_.remove_prefix(std::min(text_.find_first_not_of(kBlank), text_.size()));
      if (text_.empty()) refuse("ends inside its base64 text");
      const char c = text_.front();
      text_.remove_prefix(1);
      const int value = c == '=' ? 0 : sextet(c);
      if (value < 0 || (c != '=' && padding > 0) || (c == '=' && i < 2)) {
        refuse("has '", ByteReader::shortened({&c, 1}), "', which base64 does not allow there");
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
  std::string decoded_;  ///< holds at most two bytes that were not taken
};

/// The elements of a file, and the numbers of its arrays, which are text or bytes inside the XML,
/// or bytes behind it. The constructor and functions that read throw std::runtime_error, with the
/// file's name and the byte, if the file is malformed or of a kind that is not supported.
class VtpFile {
 public:
  explicit VtpFile(const ByteReader& file) : file_(file) {
    splitAppended();
    const auto tags = static_cast<std::uint64_t>(std::count(xml_.begin(), xml_.end(), '<'));
    const std::uint64_t most = kSomeTags + xml_.size() / kBytesPerTag;
    if (tags > most) {
      file.refuse(0, "there are ", tags, " tags in ", xml_.size(), " bytes of XML; at most ", most,
                  " are supported");
    }
    const pugi::xml_parse_result result = document_.load_buffer_inplace(
        xml_.data(), xml_.size(), pugi::parse_default, pugi::encoding_utf8);
    if (!result) {
      const auto at = static_cast<std::uint64_t>(result.offset);
      file.refuse(std::min(at, file.size()), result.description());
    }
    if (!root()) file.refuse(0, "there is no element VTKFile");
    readAttributes();
  }

  pugi::xml_node root() const { return document_.child("VTKFile"); }

  template <typename... Reason>
  [[noreturn]] void refuse(const pugi::xml_node& node, const Reason&... reason) const {
    file_.refuse(placeOf(node), node.name(), ": ", reason...);
  }

  pugi::xml_node child(const pugi::xml_node& parent, const char* name) const {
    const pugi::xml_node node = parent.child(name);
    if (!node) refuse(parent, "there is no element ", name);
    return node;
  }

  pugi::xml_node namedArray(const pugi::xml_node& parent, const char* name) const {
    const pugi::xml_node array = parent.find_child_by_attribute("DataArray", "Name", name);
    if (!array) refuse(parent, "there is no DataArray '", name, "'");
    return array;
  }

  std::uint64_t count(const pugi::xml_node& node, const char* name) const {
    const std::string_view text = node.attribute(name).value();
    const std::optional<std::uint64_t> value = parsedNumber<std::uint64_t>(text);
    if (!value) {
      refuse(node, name, " is '", ByteReader::shortened(text), "', which is no whole number");
    }
    return *value;
  }

  /// The count that the file claims, or the number of items of `numbers` numbers each that it can
  /// hold, whichever is less.
  std::size_t believable(std::uint64_t told, std::uint64_t numbers) const {
    // In text a number takes at least a digit, and a space if it is not the last one.
    const std::uint64_t most =
        compressed_ ? kMostInflation * file_.size() / 4 : (file_.size() + 1) / 2;
    return static_cast<std::size_t>(std::min(told, most / numbers));
  }

  /// Calls visit(number) for each number, without keeping them. T is double for coordinates, which
  /// may be NaN or infinite, and std::int64_t for indices.
  template <typename T, typename Visit>
  void readNumbers(const pugi::xml_node& array, Visit&& visit) {
    if constexpr (std::is_same_v<T, double>) {
      if (read<T, float, double>(array, visit)) return;
      refuseType(array, "; supported are Float32 and Float64");
    } else {
      // A UInt64 beyond Int64 becomes negative and is refused.
      if (read<T, std::int32_t, std::uint32_t, std::int64_t, std::uint64_t>(array, visit)) return;
      refuseType(array, "; supported are Int32, Int64, UInt32 and UInt64");
    }
  }

  /// Calls visit(number) for each number of an array with one number for each point or cell, which
  /// may be of any type of VTK's.
  template <typename Visit>
  void readScalars(const pugi::xml_node& array, Visit&& visit) {
    if (array.attribute("NumberOfComponents") && count(array, "NumberOfComponents") != 1) {
      refuse(array, "NumberOfComponents is not 1");
    }
    if (!read<double, float, double, std::int8_t, std::uint8_t, std::int16_t, std::uint16_t,
              std::int32_t, std::uint32_t, std::int64_t, std::uint64_t>(array, visit)) {
      refuseType(array, ", which is no type of numbers");
    }
  }

 private:
  /// The most that all compressed arrays together may inflate to, in multiples of the file's size.
  /// Deflate reaches 1032; ascending indices inflate to 5 times their size, coordinates to 1 to 3
  /// times.
  static constexpr std::uint64_t kMostInflation = 64;

  /// An element and the text after it take 128 bytes, so a file of elements alone would take 26
  /// times its size. The limit is kSomeTags, plus one for each kBytesPerTag. Real files have far
  /// fewer.
  static constexpr std::uint64_t kSomeTags = 256, kBytesPerTag = 16;

  /// The offset of the element's name. It is right for the file too, because only data after the
  /// element were split off.
  static std::uint64_t placeOf(const pugi::xml_node& node) {
    return static_cast<std::uint64_t>(std::max<std::ptrdiff_t>(node.offset_debug(), 1) - 1);
  }

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
    appended_ = bytes.substr(data + 1, end - data - 1);
    xml_.reserve(tag_end + 1 + bytes.size() - end);
    xml_.append(bytes.substr(0, tag_end + 1)).append(bytes.substr(end));
  }

  void readAttributes() {
    const auto one_of = [&](const char* name, std::string_view usual, std::string_view other) {
      const pugi::xml_attribute attribute = root().attribute(name);
      if (!attribute || attribute.value() == usual) return false;
      if (attribute.value() == other) return true;
      refuse(root(), name, " is '", ByteReader::shortened(attribute.value()), "'; supported are '",
             usual, "' and '", other, "'");
    };
    const std::string_view type = root().attribute("type").as_string("PolyData");
    if (type != "PolyData") {
      refuse(root(), "type is '", ByteReader::shortened(type),
             "'; supported are 'PolyData' files (.vtp), as ParaView's Extract Surface makes them");
    }
    order_ =
        one_of("byte_order", "LittleEndian", "BigEndian") ? ByteOrder::kBig : ByteOrder::kLittle;
    wide_header_ = one_of("header_type", "UInt32", "UInt64");
    compressed_ = one_of("compressor", "", "vtkZLibDataCompressor");
    if (const pugi::xml_node appended = root().child("AppendedData")) {
      const std::string_view encoding = appended.attribute("encoding").value();
      if (encoding != "raw" && encoding != "base64") {
        refuse(appended, "encoding is '", ByteReader::shortened(encoding),
               "'; supported are 'raw' and 'base64'");
      }
      appended_is_base64_ = encoding == "base64";
    }
  }

  [[noreturn]] void refuseType(const pugi::xml_node& array, const char* remedy) const {
    refuse(array, "type is '", ByteReader::shortened(array.attribute("type").value()), "'", remedy);
  }

  /// Returns whether the array is text, or of one of the types, and was read.
  template <typename T, typename... Stored, typename Visit>
  bool read(const pugi::xml_node& array, Visit& visit) {
    if (array.attribute("format").value() == std::string_view("ascii")) {
      readText<T>(array, visit);
      return true;
    }
    const std::string_view type = array.attribute("type").value();
    return ((type == typeName<Stored>() && (readStored<Stored, T>(array, visit), true)) || ...);
  }

  template <typename Stored, typename T, typename Visit>
  void readStored(const pugi::xml_node& array, Visit& visit) {
    const std::string bytes = readBytes(array);
    if (bytes.size() % sizeof(Stored) != 0) {
      refuse(array, "its ", bytes.size(), " bytes are no multiple of ", sizeof(Stored));
    }
    for (std::size_t i = 0; i < bytes.size(); i += sizeof(Stored)) {
      visit(static_cast<T>(decode<Stored>(&bytes[i], order_)));
    }
  }

  template <typename T, typename Visit>
  void readText(const pugi::xml_node& array, Visit& visit) const {
    std::string_view rest = textOf(array);
    for (auto word = takeWord(rest, kBlank); !word.empty(); word = takeWord(rest, kBlank)) {
      const std::optional<T> value = parsedNumber<T>(word);
      if (!value) {
        refuse(array, "'", ByteReader::shortened(word), "' is no ",
               std::is_same_v<T, double> ? "finite number" : "whole number that fits");
      }
      visit(*value);
    }
  }

  /// The text of an array, which may follow elements that describe it.
  static std::string_view textOf(const pugi::xml_node& array) {
    for (const pugi::xml_node part : array.children()) {
      const std::string_view value = part.value();
      const bool is_text = part.type() == pugi::node_pcdata || part.type() == pugi::node_cdata;
      if (is_text && value.find_first_not_of(kBlank) != value.npos) return value;
    }
    return {};
  }

  std::string readBytes(const pugi::xml_node& array) {
    const std::string_view format = array.attribute("format").value();
    if (format == "binary") return readBytes({file_, placeOf(array), textOf(array), true});
    if (format != "appended") {
      refuse(array, "format is '", ByteReader::shortened(format),
             "'; supported are 'ascii', 'binary' and 'appended'");
    }
    const std::uint64_t offset = count(array, "offset");
    if (offset > appended_.size()) {
      refuse(array, "offset is ", offset, ", but only ", appended_.size(), " bytes are appended");
    }
    return readBytes({file_, placeOf(array), appended_.substr(static_cast<std::size_t>(offset)),
                      appended_is_base64_});
  }

  /// Uncompressed: the number of bytes, then the bytes. Compressed: the number of blocks, their
  /// size, the size of the last one (0 if it is whole), their compressed sizes, then the blocks.
  std::string readBytes(EncodedBytes bytes) {
    const auto word = [&]() -> std::uint64_t {
      if (wide_header_) return decode<std::uint64_t>(bytes.take(8).data(), order_);
      return decode<std::uint32_t>(bytes.take(4).data(), order_);
    };
    const std::uint64_t blocks_or_bytes = word();
    if (!compressed_) {
      std::string all = bytes.take(blocks_or_bytes);
      // Several pieces may refer to the same appended array.
      if (all.size() > file_.size() - decoded_) {
        bytes.refuse("has ", all.size(), " bytes; all arrays together exceed the file's ",
                     file_.size(), " bytes");
      }
      decoded_ += all.size();
      return all;
    }
    const std::uint64_t blocks = blocks_or_bytes, block_size = word(), last_size = word();
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
    for (std::uint64_t i = 0; i < blocks; ++i) compressed_sizes.push_back(word());

    std::string inflated(static_cast<std::size_t>(size), '\0');
    std::size_t begin = 0;
    for (const std::uint64_t compressed_size : compressed_sizes) {
      const std::string compressed = bytes.take(compressed_size);
      const std::size_t expected =
          std::min(static_cast<std::size_t>(block_size), inflated.size() - begin);
      auto got = static_cast<uLongf>(expected);
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
  ByteOrder order_ = ByteOrder::kLittle;
  bool wide_header_ = false, compressed_ = false, appended_is_base64_ = false;
  std::string_view appended_;  ///< the data after their '_'
  std::uint64_t decoded_ = 0;  ///< bytes of all arrays so far
  std::string xml_;            ///< the text that document_ points into
  pugi::xml_document document_;
};

}  // namespace fcl_fibers::io::vtp
