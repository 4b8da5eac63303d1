// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace fcl_fibers::tools {

/// Makes the calls of a ShadowManager's record again, and explains the first difference. Returns 1
/// if there is one.
int replay(const std::string& path);

}  // namespace fcl_fibers::tools
