// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace fcl_fibers::tools {

/// The program's name as its user types it, `fcl_fibers` unless setProgramName() has set another.
const std::string& programName();
void setProgramName(const std::string& name);

/// Returns the text as UTF-8 that a terminal, JSON and HTML take: what is no UTF-8 becomes U+FFFD,
/// and a control character, except tab and the end of a line, becomes `?`. A file may have any
/// name.
std::string readable(std::string_view text);

/// Puts text on stdout, or throws std::runtime_error if that fails.
void print(std::string_view text);

/// One line on stderr that overwrites itself, if that is a terminal, and nothing elsewhere; empty
/// clears it.
void progress(const std::string& line);

/// From now on it is plain lines elsewhere.
void showProgressEverywhere();

/// A line on stderr.
/// @param what  of which file or scene it warns
void warn(const std::string& what, const std::string& text);

/// `1,234,567`
std::string countText(std::size_t count);

/// `1 fiber`, `1,234 fibers`
std::string counted(std::size_t count, const char* one);

}  // namespace fcl_fibers::tools
