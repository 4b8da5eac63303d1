// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "contender.h"
#include "moving_fibers.h"
#include "preflight.h"

namespace fcl_fibers::benchmarks {

enum class Fcl { kDynamicTree, kAll };

/// Ours as published (`super_thread`) and by default (`bundle`), with fibers registered as fibers
/// and adjacent segments left out, as the paper does; FCL's managers on tight boxes, which cannot
/// leave them out.
std::vector<Contender> paperContenders(Fcl fcl);

/// `LayeredAABBTree/super_thread`
std::string shortName(const Contender& contender);

/// Runs each contender by itself and judges it by the counts of the others: all must have found as
/// many touching pairs, and those that report overlapping boxes, or spheres, as many of these, when
/// the pairs of adjacent segments that ours leave out are added.
std::vector<Preflight> checkContenders(const std::vector<Contender>& contenders,
                                       MovingFibers& fibers, const PreflightLimits& limits);

/// Whether none of ours is wrong; to be too slow is not.
bool oursAreRight(const std::vector<Contender>& contenders,
                  const std::vector<Preflight>& preflights);

/// Registers one benchmark `Checked/...` a contender that has nothing to measure: its counters are
/// what the check has found, its label why the contender is not timed.
void registerChecked(const std::vector<Contender>& contenders,
                     const std::vector<Preflight>& preflights, const MovingFibers& fibers);

}  // namespace fcl_fibers::benchmarks
