// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace fcl_fibers::tools {

/// Makes a page that opens offline, from page/, three.js and `data`, the JSON that page/viewer.js
/// reads. A fragment has no head and fits into another page.
/// @param has_guide  whether a scene of the data has a guide filament
std::string makePage(const std::string& title, const std::string& data, bool fragment,
                     bool has_guide);

}  // namespace fcl_fibers::tools
