// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <charconv>
#include <cstddef>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::io {

inline void appendNumber(std::string& text, double number) {
  char digits[32];
  text.append(1, ' ').append(digits, std::to_chars(digits, digits + sizeof digits, number).ptr);
}

/// An OBJ file of one face, with all digits of its corners.
inline std::string objText(const std::vector<Point>& corners) {
  std::string text, face = "f";
  for (std::size_t i = 0; i < corners.size(); ++i) {
    text += "v";
    for (const double coordinate : corners[i]) appendNumber(text, coordinate);
    text += "\n";
    face += " " + std::to_string(i + 1);
  }
  return text + face + "\n";
}

}  // namespace fcl_fibers::io
