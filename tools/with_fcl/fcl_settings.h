// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tools/trade/trial.h"

namespace fcl_fibers::tools {

/// Fibers as FCL's objects, of scenes whose question is which segments touch: our managers, and
/// FCL's dynamic tree with stock boxes, which its objects have, or tight ones, and with narrow
/// phases of FCL or the closed form of two capsules in the callback.
/// @param options  which neighbours are left out
std::vector<trade::Setting> fclSettings(const trade::Scene& scene, const FiberTreeOptions& options);

}  // namespace fcl_fibers::tools
