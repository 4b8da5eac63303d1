// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace fcl_fibers::tools {

/// A page that opens without a network: page/ and three.js with `data`, which is JSON as
/// page/viewer.js reads it, in place. A fragment has no head and can be put into another page.
std::string makePage(const std::string& title, const std::string& data, bool fragment);

}  // namespace fcl_fibers::tools
