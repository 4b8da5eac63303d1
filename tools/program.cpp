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

struct Command {
  std::string name;
  const char* what;
  void (*add)(CLI::App& command, Arguments& arguments);
  std::function<int(const Request& request)> run;
};

void addGenerate(CLI::App& command, Arguments& arguments) {
  addScene(command, "SCENE", sceneText(arguments), arguments);
  addFile(command, "-o,--output", "FILE", arguments);
}

void addConvert(CLI::App& command, Arguments& arguments) {
  addScene(command, "IN", "The file to read, or `-`.", arguments);
  addFile(command, "OUT", "", arguments);
  addRadius(command, arguments);
  command.footer(
      "No radius is needed. Radii of points are kept, except in .txt, which has no place for them. "
      "What\nelse a file holds is not, and is warned of.");
}

void addInfo(CLI::App& command, Arguments& arguments) {
  addScene(command, "SCENE", sceneText(arguments), arguments);
  addRadius(command, arguments);
  addJson(command, arguments.request);
}

void addCheck(CLI::App& command, Arguments& arguments) {
  Request& request = arguments.request;
  addScenes(command, sceneText(arguments) + " Several are frames of one\nscene.", arguments);
  CLI::Option* const against =
      command
          .add_option("--against", arguments.other,
                      "Look for pairs of each scene with SCENE, instead of pairs\nwithin it.")
          ->type_name("SCENE");
  addEnd(command, arguments,
         "List pairs that touch while the fibers move from SCENES to\nSCENE in a straight "
         "line, and when. Both have the same fibers.");
  CLI::Option* const mesh = addMeshes(command, request.meshes);
  command.add_flag("--meshes-only", request.meshes_only, "Leave out pairs of two fibers.")
      ->needs(mesh)
      ->excludes(against);
  addRadii(command, arguments);
  addSearch(command, request);
  addReport(command, request.tree);
  addList(command, request);
  addPictures(command, request);
  command.footer(
      "The exit code is 0 without contacts, 1 with contacts, and 2 after an error.\n"
      "CSV has a line for each contact. JSON has the same names, with points and normals as "
      "lists:\n"
      "  fiber_a, segment_a, s   One segment, counted from 0, and the place along it, from 0 to "
      "1.\n"
      "  fiber_b, segment_b, t   The other segment.\n"
      "  distance                From surface to surface. It is negative if they overlap.\n"
      "  point_a_x, ...          The point on the surface of a that is nearest to b, or deepest in "
      "it.\n"
      "  point_b_x, ...          The point on the surface of b, likewise.\n"
      "  normal_x, ...           The direction from a to b, of length one.\n"
      "With --mesh there are also contacts of a segment and a mesh, without fiber_b, segment_b and "
      "t:\n"
      "  mesh, triangle          A mesh, and the triangle into which the segment is deepest.\n"
      "  weight_0, ...           The place in the triangle: the weights of its three points.\n"
      "  solid                   1 if the segment is in a solid mesh, else 0.\n"
      "With --end there is the time at which a pair first touches, and the contact is that of "
      "then:\n"
      "  time                    From 0, the start, where some may touch already, to 1, the end.");
}

void addDistance(CLI::App& command, Arguments& arguments) {
  addScene(command, "SCENE", sceneText(arguments), arguments);
  command
      .add_option("OTHER", arguments.other,
                  "Another scene. The distance is then from SCENE to OTHER.")
      ->type_name("");
  addRadii(command, arguments);
  addNeighbors(command, arguments.request.tree);
  addJson(command, arguments.request);
  command.footer(
      "The distance is from surface to surface. It is negative if fibers overlap, and then it is "
      "the\ndeepest overlap; `check` lists all. Two segments of one fiber count only if the fiber "
      "turns\nback to itself: the part between them has to be longer than half a circle over their "
      "distance.");
}

void addReplay(CLI::App& command, Arguments& arguments) {
  command
      .add_option("FILE", arguments.request.path, "The file that the ShadowManager has written.")
      ->required()
      ->type_name("");
  command.footer(
      "Asks FCL's manager and ours again, up to the first call in which they differ, and explains "
      "the\ndifference. The exit code is 1 if they differ.");
}

void addView(CLI::App& command, Arguments& arguments) {
  Request& request = arguments.request;
  addScenes(command, "The scenes that the page shows.", arguments);
  addRadii(command, arguments);
  command.add_option("-o,--output", request.path, "Write the page to FILE, which ends in .html.")
      ->required()
      ->type_name("FILE");
  addEnd(command, arguments,
         "Play a step from the one scene to SCENE, which has the same\nfibers, and mark pairs "
         "when they first touch.");
  addMeshes(command, request.meshes);
  addSearch(command, request);
  addDrawing(command, request);
  const bool generated = static_cast<bool>(arguments.generated.make);
  command.footer(
      std::string(
          generated ? "Generated scenes have a radius of their own, or the key `radius`.\n"
                      "Scenes with frames are played: `paper-dynamic`, or `helix:frames=0:100:5`.\n"
                    : "") +
      "If a scene has more points than --points, every nth fiber and point is drawn.\n"
      "Contacts are searched among all points. A page marks the deepest 100,000 of a frame.\n"
      "Without --up, " +
      (generated ? "z points up in generated scenes and y in TressFX files; for others it is\n"
                 : "y points up in TressFX files; for others it is\n") +
      "guessed from how the fibers run.");
}

/// The commands of a program, in the order of its help.
std::vector<Command> commandsOf(const ProgramParts& parts) {
  std::vector<Command> commands;
  if (parts.scenes.make) {
    commands.push_back({"generate", "Write a generated scene to a file.", addGenerate, generate});
  }
  commands.push_back(
      {"convert", "Write the fibers of a file in another format.", addConvert, convert});
  commands.push_back({"info", "Count and measure a scene, and warn of oddities.", addInfo, info});
  commands.push_back({"check", "List the segments that touch.", addCheck, check});
  commands.push_back({"distance", "Find the least distance between fibers, and its place.",
                      addDistance, distance});
  if (parts.replay) {
    commands.push_back({"replay", "Make the calls of a ShadowManager's record again.", addReplay,
                        [&](const Request& request) { return parts.replay(request.path); }});
  }
  commands.push_back({"view", "Write a page that shows scenes in 3D, offline.", addView, view});
  return commands;
}

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
    command.add(*app.add_subcommand(command.name, command.what), arguments);
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
