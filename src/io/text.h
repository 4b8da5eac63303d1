// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <string_view>

#include "io/byte_reader.h"

namespace fcl_fibers::io {

constexpr std::string_view kSpace = " \t";

inline std::string_view trimmed(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(kSpace), text.size()));
  return text.substr(0, text.find_last_not_of(kSpace) + 1);
}

/// Takes the first word off the text, which is empty then if there is no other.
inline std::string_view takeWord(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(kSpace), text.size()));
  const std::string_view word = text.substr(0, text.find_first_of(kSpace));
  text.remove_prefix(word.size());
  return word;
}

/// Editors put a mark at the start of UTF-8.
inline void skipByteOrderMark(ByteReader& file) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (file.bytes().substr(0, kByteOrderMark.size()) == kByteOrderMark) {
    file.seek(kByteOrderMark.size(), "the byte order mark");
  }
}

}  // namespace fcl_fibers::io
