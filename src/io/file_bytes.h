// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace fcl_fibers::io {

// Both throw std::runtime_error with the call, the path and the reason if that cannot be done.

/// Returns what is in a regular file.
std::string readBytes(const char* call, const std::string& path);

void writeBytes(const char* call, const std::string& path, const std::string& bytes);

}  // namespace fcl_fibers::io
