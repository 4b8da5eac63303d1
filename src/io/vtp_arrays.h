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

#include "io/encoded_bytes.h"
#include "io/formats.h"

/// The parts of the reader of .vtp files: elements of the XML, and the arrays in them.
namespace fcl_fibers::io::vtp {

/// The most that all compressed arrays together may inflate to, in multiples of the file's size.
/// Deflate reaches 1032; ascending indices inflate to 5 times their size, coordinates to 1 to 3
/// times.
inline constexpr std::uint64_t kMostInflation = 64;

/// An element and the text after it take 128 bytes, so a file of elements alone would take 26 times
/// its size. The limit is kSomeTags, plus one for each kBytesPerTag. Real files have far fewer.
inline constexpr std::uint64_t kSomeTags = 256, kBytesPerTag = 16;

template <typename... Reason>
[[noreturn]] void refuse(const ByteReader& file, const pugi::xml_node& node,
                         const Reason&... reason) {
  // This is the offset of the element's name. It is right for the file too, because only data after
  // the element were split off.
  const auto at = std::max<std::ptrdiff_t>(node.offset_debug(), 1) - 1;
  file.refuse(static_cast<std::uint64_t>(at), node.name(), ": ", reason...);
}

inline pugi::xml_node child(const ByteReader& file, const pugi::xml_node& parent,
                            const char* name) {
  const pugi::xml_node node = parent.child(name);
  if (!node) refuse(file, parent, "there is no element ", name);
  return node;
}

inline pugi::xml_node namedArray(const ByteReader& file, const pugi::xml_node& parent,
                                 const char* name) {
  const pugi::xml_node array = parent.find_child_by_attribute("DataArray", "Name", name);
  if (!array) refuse(file, parent, "there is no DataArray '", name, "'");
  return array;
}

inline std::string shown(const pugi::xml_attribute& attribute) {
  return ByteReader::shortened(attribute.value());
}

inline std::uint64_t count(const ByteReader& file, const pugi::xml_node& node, const char* name) {
  const std::string_view text = node.attribute(name).value();
  const std::optional<std::uint64_t> value = parsedNumber<std::uint64_t>(text);
  if (!value) {
    refuse(file, node, name, " is '", ByteReader::shortened(text), "', which is no whole number");
  }
  return *value;
}

/// The text of an array, which may follow elements that describe it.
inline std::string_view text(const pugi::xml_node& array) {
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

  /// The count that the file claims, or the number of items of `numbers` numbers each that it can
  /// hold, whichever is less.
  std::size_t believable(std::uint64_t told, std::uint64_t numbers) const {
    // In text a number takes at least a digit, and a space if it is not the last one.
    const std::uint64_t most =
        encoding_.compressed ? kMostInflation * file_.size() / 4 : (file_.size() + 1) / 2;
    return static_cast<std::size_t>(std::min(told, most / numbers));
  }

  /// Calls visit(number) for each number, without keeping them. T is double for coordinates, which
  /// may be NaN or infinite, and std::int64_t for indices.
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

  /// Calls visit(number) for each number of an array with one number for each point or cell, which
  /// may be of any type of VTK's.
  template <typename Visit>
  void readScalars(const pugi::xml_node& array, Visit&& visit) {
    if (array.attribute("NumberOfComponents") && count(file_, array, "NumberOfComponents") != 1) {
      refuse(file_, array, "NumberOfComponents is not 1");
    }
    const std::string_view type = array.attribute("type").value();
    const std::string_view format = array.attribute("format").value();
    const auto decoded = [&](auto zero) {
      decodeAll<decltype(zero), double>(array, readBytes(array, format), visit);
    };
    if (format == "ascii" || type == "Float32" || type == "Float64") {
      return readNumbers<double>(array, visit);
    }
    if (type == "Int8") return decoded(std::int8_t{});
    if (type == "UInt8") return decoded(std::uint8_t{});
    if (type == "Int16") return decoded(std::int16_t{});
    if (type == "UInt16") return decoded(std::uint16_t{});
    if (type == "Int32") return decoded(std::int32_t{});
    if (type == "UInt32") return decoded(std::uint32_t{});
    if (type == "Int64") return decoded(std::int64_t{});
    if (type == "UInt64") return decoded(std::uint64_t{});
    refuse(file_, array, "type is '", ByteReader::shortened(type),
           "', which is no type of numbers");
  }

 private:
  template <typename Stored, typename T, typename Visit>
  void decodeAll(const pugi::xml_node& array, const std::string& bytes, Visit&& visit) const {
    if (bytes.size() % sizeof(Stored) != 0) {
      refuse(file_, array, "its ", bytes.size(), " bytes are no multiple of ", sizeof(Stored));
    }
    for (std::size_t i = 0; i < bytes.size(); i += sizeof(Stored)) {
      visit(static_cast<T>(decode<Stored>(&bytes[i], encoding_.order)));
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
      const std::optional<T> value = parsedNumber<T>(word);
      if (!value) {
        refuse(file_, array, "'", ByteReader::shortened(word), "' is no ",
               std::is_same_v<T, double> ? "finite number" : "whole number that fits");
      }
      visit(*value);
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

}  // namespace fcl_fibers::io::vtp
