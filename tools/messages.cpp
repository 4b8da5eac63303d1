// SPDX-License-Identifier: BSD-3-Clause
#include "messages.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <stdexcept>

namespace fcl_fibers::tools {
namespace {

std::string program_name = "fcl_fibers";
bool is_progress_everywhere = false;

/// How many bytes the first character of the text has; 0 if it is no UTF-8.
std::size_t characterLength(std::string_view text) {
  const auto byte = [text](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
  };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  // Of what else follows these, a shorter form exists, or it is no character.
  const unsigned least = first == 0xE0 ? 0xA0 : first == 0xF0 ? 0x90 : 0x80;
  const unsigned most = first == 0xED ? 0x9F : first == 0xF4 ? 0x8F : 0xBF;
  if (first < 0xC2 || first > 0xF4 || byte(1) < least || byte(1) > most) return 0;
  for (std::size_t i = 2; i < length; ++i) {
    if (byte(i) < 0x80 || byte(i) > 0xBF) return 0;
  }
  return length;
}

}  // namespace

const std::string& programName() { return program_name; }
void setProgramName(const std::string& name) { program_name = name; }

std::string readable(std::string_view text) {
  std::string shown;
  while (!text.empty()) {
    const std::size_t length = characterLength(text);
    const std::string_view character = text.substr(0, std::max<std::size_t>(length, 1));
    const auto first = static_cast<unsigned char>(character[0]);
    const bool is_kept = first >= ' ' || first == '\t' || first == '\n';
    if (length == 0) {
      shown += "\uFFFD";
    } else if (!is_kept || character == "\x7F" || (first == 0xC2 && character < "\u00A0")) {
      shown += '?';
    } else {
      shown += character;
    }
    text.remove_prefix(character.size());
  }
  return shown;
}

void print(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    throw std::runtime_error("writing to stdout failed");
  }
}

void showProgressEverywhere() { is_progress_everywhere = true; }

void progress(const std::string& line) {
  const bool overwrites = isatty(STDERR_FILENO) != 0;
  if (!overwrites && (!is_progress_everywhere || line.empty())) return;
  // "\r\033[K" goes back to the first column and clears the line.
  std::fprintf(stderr, overwrites ? "\r\033[K%s" : "%s\n", readable(line).c_str());
  std::fflush(stderr);
}

void warn(const std::string& what, const std::string& text) {
  progress("");
  const std::string line = readable(program_name + ": warning: " + what + ": " + text);
  std::fprintf(stderr, "%s\n", line.c_str());
}

std::string countText(std::size_t count) {
  std::string text = std::to_string(count);
  for (int i = static_cast<int>(text.size()) - 3; i > 0; i -= 3) {
    text.insert(static_cast<std::size_t>(i), 1, ',');
  }
  return text;
}

std::string counted(std::size_t count, const char* one) {
  return countText(count) + " " + one + (count == 1 ? "" : "s");
}

}  // namespace fcl_fibers::tools
