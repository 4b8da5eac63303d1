// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "io/byte_reader.h"

namespace fcl_fibers::io {

/// Reads the bytes of an array, raw or in base64.
class EncodedBytes {
 public:
  static constexpr std::string_view kSpace = " \t\r\n";

  EncodedBytes(const ByteReader& file, std::uint64_t at, std::string_view text, bool base64)
      : file_(file), at_(at), text_(text), base64_(base64) {}

  /// The next `count` bytes.
  std::string take(std::uint64_t count) {
    // Four characters hold at most three bytes, and spaces among them make that fewer.
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
  /// Padding may end a part before the array ends, because a header may be encoded on its own.
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

}  // namespace fcl_fibers::io
