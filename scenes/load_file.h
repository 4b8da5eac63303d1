// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "scenes/cosserat_rod.h"

namespace fcl_fibers::scenes {

/// Reads recorded loads of a rod's tip, in the frame of its base. A line is a state: the force and
/// then the torque, six numbers with blanks or commas between them. What follows a # is a comment,
/// and a line without anything else is none. `fcl_fibers view --record` makes such files.
///
/// Throws std::runtime_error, with the file and the line, if the file cannot be read, has no state
/// or more than 10,000, or if a line does not hold six finite numbers.
std::vector<RodLoad> readLoads(const std::string& path);

}  // namespace fcl_fibers::scenes
