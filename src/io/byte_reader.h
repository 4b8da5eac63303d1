// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "io/number.h"
#include "joined_text.h"

namespace fcl_fibers::io {

enum class ByteOrder { kLittle, kBig };

template <typename T>
T decode(const char* bytes, ByteOrder order) {
  static_assert(sizeof(T) == 1 || sizeof(T) == 2 || sizeof(T) == 4 || sizeof(T) == 8);
  std::uint64_t word = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    const std::size_t next = order == ByteOrder::kBig ? i : sizeof(T) - 1 - i;
    word = word << 8 | static_cast<unsigned char>(bytes[next]);
  }
  using Word = std::conditional_t<
      sizeof(T) == 8, std::uint64_t,
      std::conditional_t<sizeof(T) == 4, std::uint32_t,
                         std::conditional_t<sizeof(T) == 2, std::uint16_t, std::uint8_t>>>;
  const Word narrow = static_cast<Word>(word);
  T number;
  std::memcpy(&number, &narrow, sizeof number);
  return number;
}

/// Reads a file's bytes from front to back, and never beyond them. Errors tell the file's name, the
/// place and the reason.
class ByteReader {
 public:
  /// How errors give a place. Lines end at each line feed, or at each carriage return if the file
  /// has no line feed.
  enum class Places { kBytes, kLines };

  /// @param call  the function that reads, for error texts
  ByteReader(std::string_view bytes, std::string name, Places places = Places::kBytes,
             const char* call = "readFibers")
      : bytes_(bytes), name_(std::move(name)), places_(places), call_(call) {}

  void setPlaces(Places places) {
    places_ = places;
    if (places == Places::kLines && bytes_.find('\n') == bytes_.npos) line_end_ = '\r';
  }

  std::string_view bytes() const { return bytes_; }
  std::uint64_t size() const { return bytes_.size(); }
  std::uint64_t offset() const { return offset_; }
  std::uint64_t remaining() const { return size() - offset_; }
  bool atEnd() const { return remaining() == 0; }

  /// @param part  what the bytes belong to, for the error text
  void seek(std::uint64_t offset, const char* part) {
    if (offset > size()) refuseEnd(part);
    offset_ = static_cast<std::size_t>(offset);
  }

  std::string_view take(std::uint64_t count, const char* part) {
    if (count > remaining()) refuseEnd(part);
    const std::string_view taken = bytes_.substr(offset_, static_cast<std::size_t>(count));
    offset_ += taken.size();
    return taken;
  }

  template <typename T>
  T number(const char* part, ByteOrder order = ByteOrder::kLittle) {
    return decode<T>(take(sizeof(T), part).data(), order);
  }

  template <typename T>
  double coordinate(ByteOrder order = ByteOrder::kLittle) {
    const std::uint64_t at = offset_;
    const double value = static_cast<double>(number<T>("the points", order));
    if (!std::isfinite(value)) refuse(at, "a coordinate is ", value);
    return value;
  }

  /// Returns the next line without its end, which the last line may lack.
  std::string_view line() {
    const std::size_t end = std::min(bytes_.find(line_end_, offset_), bytes_.size());
    std::string_view line = bytes_.substr(offset_, end - offset_);
    offset_ = std::min(end + 1, bytes_.size());
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    return line;
  }

  /// @pre `text` is part of the file
  template <typename T>
  T parse(std::string_view text) const {
    const std::optional<T> value = parsedNumber<T>(text);
    bool good = value.has_value();
    if constexpr (std::is_floating_point_v<T>) good = good && std::isfinite(*value);
    if (!good) {
      refuse(offsetOf(text), "'", shortened(text), "' is no ",
             std::is_floating_point_v<T> ? "finite number" : "whole number that fits");
    }
    return *value;
  }

  /// @pre `text` is part of the file
  std::uint64_t offsetOf(std::string_view text) const {
    return static_cast<std::uint64_t>(text.data() - bytes_.data());
  }

  /// The number of the line at an offset, counted from 1.
  std::uint64_t lineAt(std::uint64_t offset) const {
    const std::string_view before = bytes_.substr(0, static_cast<std::size_t>(offset));
    return 1 + static_cast<std::uint64_t>(std::count(before.begin(), before.end(), line_end_));
  }

  template <typename... Reason>
  [[noreturn]] void refuse(std::uint64_t offset, const Reason&... reason) const {
    const bool in_lines = places_ == Places::kLines;
    throw std::runtime_error(joinedText(call_, ": '", name_, "', ", in_lines ? "line " : "byte ",
                                        in_lines ? lineAt(offset) : offset, ": ", reason...));
  }

  [[noreturn]] void refuseEnd(const char* part) const {
    refuse(size(), "the file ends inside ", part);
  }

  /// Words of broken files may be long or binary.
  static std::string shortened(std::string_view text) {
    constexpr std::size_t kMost = 40;
    std::string shown(text.substr(0, kMost));
    std::replace_if(
        shown.begin(), shown.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return text.size() > kMost ? shown + "..." : shown;
  }

 private:
  std::string_view bytes_;
  std::string name_;
  Places places_;
  const char* call_;
  char line_end_ = '\n';
  std::size_t offset_ = 0;
};

}  // namespace fcl_fibers::io
