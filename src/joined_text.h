// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <locale>
#include <sstream>
#include <string>

namespace fcl_fibers {

/// Returns the parts as one text, with numbers as C++ writes them, whatever the host's locale is.
template <typename... Parts>
std::string joinedText(const Parts&... parts) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  (text << ... << parts);
  return text.str();
}

}  // namespace fcl_fibers
