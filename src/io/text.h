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

/// Makes errors give lines, and goes to the start of the text. Editors put a mark before UTF-8.
inline void startText(ByteReader& file) {
  file.setPlaces(ByteReader::Places::kLines);
  const auto starts = [&](std::string_view mark) {
    return file.bytes().substr(0, mark.size()) == mark;
  };
  if (starts("\xFF\xFE") || starts("\xFE\xFF")) {
    file.refuse(0, "the text is in UTF-16; save it in UTF-8");
  }
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  file.seek(starts(kByteOrderMark) ? kByteOrderMark.size() : 0, "the text");
}

}  // namespace fcl_fibers::io
