// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace fcl_fibers::io {

/// Returns what is in a regular file. Throws std::runtime_error with the call, the path and the
/// reason if that is not to be had.
std::string readBytes(const char* call, const std::string& path);

}  // namespace fcl_fibers::io
