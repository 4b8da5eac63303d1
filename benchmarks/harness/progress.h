// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace fcl_fibers::benchmarks {

/// What is going on, on stderr: one line that overwrites itself in a terminal, and nothing
/// elsewhere.
void showProgress(const std::string& line);

/// From now on it is plain lines elsewhere.
void showProgressEverywhere();

/// Clears the terminal's line, before something else is printed.
void endProgress();

}  // namespace fcl_fibers::benchmarks
