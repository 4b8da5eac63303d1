// SPDX-License-Identifier: BSD-3-Clause
#include "program.h"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "options.h"

namespace fcl_fibers::tools {
namespace {

int parseAndRun(std::vector<std::string> words, const ProgramParts& parts) {
  Arguments arguments{parts.scenes};
  CLI::App app("Finds collisions among fibers: hair, cables, ropes, yarn.", parts.name);
  app.footer(
      sceneHelp(parts.scenes) +
      "\nThe exit code is 2 after an error, with its message on stderr. `check` returns 1 if it "
      "finds\ncontacts" +
      (parts.replay ? ", and `replay` if managers differ.\nFiles" : ". Files") +
      " are written whole or not at all.\n`" + parts.name +
      " COMMAND --help` describes the options of a command.");
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  app.set_version_flag("--version", FCL_FIBERS_VERSION);
  app.set_help_all_flag("--help-all", "Print the help of all commands.");
  const std::vector<Command> commands = commandsOf(parts);
  for (const Command& command : commands) {
    command.addOptions(*app.add_subcommand(command.name, command.what), arguments);
  }

  const auto is_named = [&](const CLI::App* command) { return command->check_name(words.front()); };
  if (!words.empty() && words.front().substr(0, 1) != "-" &&
      app.get_subcommands(is_named).empty()) {
    throw std::invalid_argument("there is no command '" + words.front() + "'; " + parts.name +
                                " --help lists those that there are");
  }
  try {
    std::reverse(words.begin(), words.end());  // CLI11 takes the first word from the end
    app.parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    std::ostringstream answer, problem;
    const int code = app.exit(error, answer, problem);
    print(answer.str());
    std::fputs(readable(problem.str()).c_str(), stderr);
    return code == 0 ? 0 : kExitError;
  }
  const std::string name = app.get_subcommands().front()->get_name();
  const auto is_command = [&](const Command& command) { return command.name == name; };
  if (name != "replay") arguments.nameScenes();
  return std::find_if(commands.begin(), commands.end(), is_command)->run(arguments.request);
}

}  // namespace

int runProgram(const std::vector<std::string>& arguments, const ProgramParts& parts) {
  setProgramName(parts.name);
  try {
    return parseAndRun(arguments, parts);
  } catch (const std::exception& error) {
    progress("");
    std::fprintf(stderr, "%s\n", readable(parts.name + ": " + error.what()).c_str());
    return kExitError;
  }
}

}  // namespace fcl_fibers::tools
