// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace fcl_fibers::tools {

/// The program's name as its user types it, `fcl_fibers` unless setProgramName() has set another.
const std::string& programName();
void setProgramName(const std::string& name);

/// Puts text on stdout, or throws std::runtime_error if that fails.
void print(std::string_view text);

/// One line on stderr that overwrites itself, if that is a terminal; empty clears it.
void progress(const std::string& line);

/// A line on stderr.
/// @param what  of which file or scene it warns
void warn(const std::string& what, const std::string& text);

/// `1,234,567`
std::string countText(std::size_t count);

/// `1 fiber`, `1,234 fibers`
std::string counted(std::size_t count, const char* one);

}  // namespace fcl_fibers::tools
