// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "commands.h"

namespace fcl_fibers::tools {

/// A program's name, and what it adds to the commands, which need neither FCL nor Eigen. What is
/// missing is in no help, and its commands are unknown.
struct ProgramParts {
  std::string name = "fcl_fibers";                     ///< in --help, errors and warnings
  GeneratedScenes scenes;                              ///< adds `generate`
  std::function<int(const std::string& path)> replay;  ///< adds it
  PeerSettings peers;                                  ///< of `trade`
};

/// Runs a command line, without the program's name in front. Returns the exit code; an error is on
/// stderr. It may be called again, but not on several threads at once.
int runProgram(const std::vector<std::string>& arguments, const ProgramParts& parts);

}  // namespace fcl_fibers::tools
