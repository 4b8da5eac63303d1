// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace fcl_fibers::io {

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

}  // namespace fcl_fibers::io
