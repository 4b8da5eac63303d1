// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>

#include "io/byte_reader.h"

namespace fcl_fibers::io {

constexpr std::string_view kSpace = " \t";
constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF";  // which editors put before text

inline bool startsWith(std::string_view text, std::string_view start) {
  return text.substr(0, start.size()) == start;
}

inline bool isUtf16(std::string_view text) {
  return startsWith(text, "\xFF\xFE") || startsWith(text, "\xFE\xFF");
}

inline std::string lowerCase(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

inline std::string_view trimmed(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(kSpace), text.size()));
  return text.substr(0, text.find_last_not_of(kSpace) + 1);
}

/// Takes the first word off the text, which is empty then if there is no other.
inline std::string_view takeWord(std::string_view& text, std::string_view space = kSpace) {
  text.remove_prefix(std::min(text.find_first_not_of(space), text.size()));
  const std::string_view word = text.substr(0, text.find_first_of(space));
  text.remove_prefix(word.size());
  return word;
}

/// Makes errors give lines, and goes to the start of the text.
inline void startText(ByteReader& file) {
  file.setInLines(true);
  if (isUtf16(file.bytes())) file.refuse(0, "the text is in UTF-16; save it in UTF-8");
  file.seek(startsWith(file.bytes(), kUtf8Mark) ? kUtf8Mark.size() : 0, "the text");
}

}  // namespace fcl_fibers::io
