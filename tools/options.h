// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "commands.h"
#include "program.h"

namespace fcl_fibers::tools {

/// The parsed command line: a request, and the texts that name its scenes.
struct Arguments {
  const GeneratedScenes& generated;
  Request request{};
  std::vector<std::string> scenes{};
  std::string other{}, end{};
  std::optional<std::string> loads{};
  std::vector<double> radii{};
  std::string radius_from{}, groups_from{};

  /// Names the scenes of the request: `scenes`, and `other` and `end` if they are given. One radius
  /// is for all files; several are for the files in order.
  void nameScenes();
};

struct Command {
  std::string name;
  const char* what;  ///< it does
  void (*addOptions)(CLI::App& command, Arguments& arguments);
  std::function<int(const Request& request)> run;
};

/// The commands of a program, in the order of its help.
std::vector<Command> commandsOf(const ProgramParts& parts);

}  // namespace fcl_fibers::tools
