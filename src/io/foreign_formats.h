// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace fcl_fibers::io {

/// If a file is of a known format that is not read, what it is and what to do.
std::optional<std::string> foreignFormat(std::string_view bytes, const std::string& name);

}  // namespace fcl_fibers::io
