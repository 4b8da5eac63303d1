// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>

#include <fcl_fibers/fiber_polylines.h>

#include "joined_text.h"

namespace fcl_fibers::io {

enum class ByteOrder { kLittle, kBig };

template <typename T>
T decode(const char* bytes, ByteOrder order) {
  constexpr ByteOrder kHost =
      __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__ ? ByteOrder::kBig : ByteOrder::kLittle;
  char raw[sizeof(T)];
  std::copy_n(bytes, sizeof(T), raw);
  if (order != kHost) std::reverse(raw, raw + sizeof(T));
  T number;
  std::memcpy(&number, raw, sizeof number);
  return number;
}

/// Returns the number that the whole text is, in any locale. It may have a leading '+', which
/// std::from_chars does not know. A floating-point number may be NaN or infinite if the text says
/// so.
template <typename T>
std::optional<T> parsedNumber(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  T value{};
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stop != end) return std::nullopt;
  return value;
}

/// Reads a file's bytes from front to back, and never beyond them. Errors tell the file's name, the
/// place and the reason.
class ByteReader {
 public:
  /// @param call  the function that reads, for error texts
  ByteReader(std::string_view bytes, std::string name, const char* call = "readFibers")
      : bytes_(bytes), name_(std::move(name)), call_(call) {}

  /// Of the numbers that are read from now on; little endian before.
  void setOrder(ByteOrder order) { order_ = order; }

  /// Whether errors give a place by its line rather than its byte. Lines end at each line feed, or
  /// at each carriage return if the file has no line feed.
  void setInLines(bool in_lines) {
    in_lines_ = in_lines;
    if (in_lines && bytes_.find('\n') == bytes_.npos) line_end_ = '\r';
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

  /// Goes to the points, which begin after the header and inside the file.
  /// @param field  where the file tells the offset
  void seekPoints(std::uint64_t offset, std::uint64_t header_size, std::uint64_t field) {
    if (offset < header_size) {
      refuse(field, "points start at byte ", offset, ", inside the header of ", header_size,
             " bytes");
    }
    if (offset > size()) {
      refuse(field, "points start at byte ", offset, " of a file of ", size(), " bytes");
    }
    offset_ = static_cast<std::size_t>(offset);
  }

  std::string_view take(std::uint64_t count, const char* part) {
    if (count > remaining()) refuseEnd(part);
    const std::string_view taken = bytes_.substr(offset_, static_cast<std::size_t>(count));
    offset_ += taken.size();
    return taken;
  }

  template <typename T>
  T number(const char* part) {
    return decode<T>(take(sizeof(T), part).data(), order_);
  }

  /// Three floats, which have to be finite.
  Point point() {
    Point point;
    for (double& c : point) {
      const std::uint64_t at = offset_;
      c = static_cast<double>(number<float>("the points"));
      if (!std::isfinite(c)) refuse(at, "a coordinate is ", c);
    }
    return point;
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
    throw std::runtime_error(joinedText(call_, ": '", name_, "', ", in_lines_ ? "line " : "byte ",
                                        in_lines_ ? lineAt(offset) : offset, ": ", reason...));
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
  bool in_lines_ = false;
  ByteOrder order_ = ByteOrder::kLittle;
  const char* call_;
  char line_end_ = '\n';
  std::size_t offset_ = 0;
};

}  // namespace fcl_fibers::io
