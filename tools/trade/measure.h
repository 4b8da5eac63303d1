// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tools/trade/trial.h"

namespace fcl_fibers::tools::trade {

/// Runs a setting's trial, judges what it finds, and times it in turns with `usual`.
/// @param longest  seconds after which a frame is ended
Outcome measure(const Scene& scene, const Verdict& verdict, const Setting& setting, Trial& usual,
                double longest);

}  // namespace fcl_fibers::tools::trade
